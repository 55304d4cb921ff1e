//! In any cell: no limit is exceeded, and with a wrong guess the promised number of frames see the seam.

use crate::cells;

use cells::{example, random, scan, scenario};
use nalgebra::{Matrix3, Point3, Vector3};
use trueline_dataset::{Measured, RobotSample};
use trueline_geometry::Pose;
use trueline_live::motion::{CheckedPath, derive_limits};
use trueline_plan::constraints::Constraint;
use trueline_plan::plan::PATH_PERIOD_S;
use trueline_plan::{Cell, Plan, PlanError, PlanRequest, Shape, View, plan};
use trueline_sim::Disturbance;

/// Largest length of the k-th differences of a list over the k-th power of the period, as in a robot's own motion
/// monitor. The path is at rest before and after.
fn peaks(values: Vec<Vector3<f64>>, period_s: f64) -> [f64; 3] {
    let rest = Vector3::zeros();
    let mut rates = vec![rest; 3];
    rates.extend(values);
    rates.extend([rest; 3]);
    std::array::from_fn(|_| {
        let largest = rates.iter().map(Vector3::norm).fold(0.0, f64::max);
        rates = rates.windows(2).map(|pair| (pair[1] - pair[0]) / period_s).collect();
        largest
    })
}

fn velocities(path: &[Pose], period_s: f64) -> Vec<Vector3<f64>> {
    path.windows(2).map(|p| (p[1].translation.vector - p[0].translation.vector) / period_s).collect()
}

fn rates(path: &[Pose], period_s: f64) -> Vec<Vector3<f64>> {
    path.windows(2).map(|p| (p[1].rotation * p[0].rotation.inverse()).scaled_axis() / period_s).collect()
}

fn check_path(cell: &Cell, plan: &Plan) {
    let path = plan.path();
    let period_s = PATH_PERIOD_S;
    let limits = &cell.limits;
    let [speed, acceleration, jerk] = peaks(velocities(&path, period_s), period_s);
    // Differences of positions of 1 m, rounded to 1e-16, over (4 ms)³ are off by up to 1e-8 m/s³.
    let within = |value: f64, limit: f64| assert!(value <= limit * (1.0 + 1e-6), "{value} of {limit}");
    within(speed, limits.speed_m_s);
    within(acceleration, limits.acceleration_m_s2);
    within(jerk, limits.jerk_m_s3);
    let [turn, turn_acceleration, turn_jerk] = peaks(rates(&path, period_s), period_s);
    within(turn, limits.turn_rad_s);
    within(turn_acceleration, limits.turn_acceleration_rad_s2);
    within(turn_jerk, limits.turn_jerk_rad_s3);
    for pose in &path {
        let [work, travel, spin] = tilts(cell, pose);
        for (tilt, limit) in [work, travel, spin].into_iter().zip(limits.tilt_rad) {
            // Angles of matrices that are rounded to 1e-16.
            assert!(tilt.abs() <= limit + 1e-9, "{tilt} of {limit}");
        }
        let stand_off_m = stand_off_m(cell, pose);
        let [low, high] = limits.stand_off_m;
        assert!(stand_off_m >= low - 1e-9 && stand_off_m <= high + 1e-9, "{stand_off_m}");
        if let Some([low, high]) = &limits.workspace_m {
            let at = pose.translation.vector;
            assert!((0..3).all(|k| low[k] <= at[k] && at[k] <= high[k]), "{at}");
        }
    }
}

/// Work angle, travel angle and spin of a pose: how it is turned from the nominal attitude, about the sheet's own axes there
/// (seam, stripe, range), one after the other.
fn tilts(cell: &Cell, pose: &Pose) -> [f64; 3] {
    let nominal = cell.sensor_pose.nominal_attitude();
    let camera = nominal * cell.tool_from_camera.rotation;
    let normal = cell.sheet.plane().normal().into_inner();
    let across = camera * (normal * normal.y.signum());
    let range = camera * (Vector3::z() - normal * normal.z).normalize();
    let axes = Matrix3::from_columns(&[across.cross(&range), across, range]);
    let turned = (pose.rotation * nominal.inverse()).to_rotation_matrix().into_inner();
    let r = axes.transpose() * turned * axes;
    [r[(0, 2)].atan2(r[(2, 2)]), (-r[(1, 2)]).asin(), r[(1, 0)].atan2(r[(1, 1)])]
}

/// Depth in the camera of the point where the seam meets the sheet.
fn stand_off_m(cell: &Cell, pose: &Pose) -> f64 {
    let camera_from_base = (pose * cell.tool_from_camera).inverse();
    let start = (camera_from_base * Point3::from(cell.seam.from_m)).coords;
    let along = camera_from_base * cell.seam.direction().unwrap().into_inner();
    let plane = cell.sheet.plane();
    let part = (plane.offset() - plane.normal().dot(&start)) / plane.normal().dot(&along);
    (start + along * part).z
}

/// Parts of the frames that see the seam, in view with the margin and between its ends, in cells with errors up to the
/// largest possible: sorted, and never below the promise.
fn check_view(cell: &Cell, plan: &Plan, seeds: std::ops::Range<u64>) {
    let View::Camera { camera, margin_px, .. } = &cell.view else { unreachable!() };
    let duration_s = plan.motion.design().duration_s;
    let frames = (duration_s / cell.frame_period_s - 0.5).floor();
    let mut kept: Vec<f64> = seeds
        .map(|seed| {
            let truth = cell.guess_error.disturbed(&cell.tool_from_camera, &cell.seam, 77_000 + seed);
            let mut scenario = scenario(cell, truth, duration_s);
            scenario.disturbance = Disturbance::default();
            let recording = scan(&scenario, &plan.motion, seed);
            let parameters = recording.truth.as_ref().unwrap().parameters;
            let config = trueline_method::Config::default();
            let placed =
                trueline_method::evaluate::seam_points::place(&recording, &parameters, &config).unwrap();
            let along = truth.1.direction().unwrap();
            let on_seam = placed.list.iter().filter(|point| {
                let at = along.dot(&(point.point_in_base - truth.1.from_m));
                (0.0..truth.1.length_m()).contains(&at)
            });
            let clear = recording.features.iter().filter(|feature| {
                let Measured::Pixel([u, v]) = feature.measured else { unreachable!() };
                let [width, height] = camera.size.map(f64::from);
                (u + 0.5).min(width - 0.5 - u).min(v + 0.5).min(height - 0.5 - v) > *margin_px
            });
            // At least this many are both.
            (on_seam.count() as f64 + clear.count() as f64 - recording.features.len() as f64) / frames
        })
        .collect();
    kept.sort_by(f64::total_cmp);
    // Of 60 cells 3 may keep less than 95 %. If 5 % do, more than 8 of 60 do once in 400 times. Frames that count on both
    // lists are counted twice, and the first and the last pose are not placed: 0.5 %.
    assert!(kept[8] > 0.95 - 0.01, "{kept:?}");
    // Of 240 cells that were tried none loses more than a quarter: of 60 others one may, by a little.
    assert!(kept[0] > 0.65, "{kept:?}");
}

/// The gate that guides a robot takes the path at its own pace: its limits of the tool's load are kept.
fn check_gate(cell: &Cell, plan: &Plan) {
    let poses: Vec<RobotSample> = (plan.path().into_iter().zip(0_i64..))
        .map(|(base_from_tool, k)| RobotSample { stamp_ns: k * 4_000_000, device_ns: None, base_from_tool })
        .collect();
    let limits = derive_limits::limits_for(&poses, 1.0, cell.limits.reach_m).unwrap();
    let path = CheckedPath::new(&poses, 1.0, &limits).unwrap();
    // 250 mm/s with people near (ISO 10218-1, 5.6.2).
    assert!(path.extremes().tip_m_s <= 0.250);
}

fn small(shape: Shape, duration_s: f64) -> PlanRequest {
    PlanRequest { shapes: vec![shape], evaluations: 1500, duration_s, ..PlanRequest::default() }
}

#[test]
fn no_limit_is_exceeded_in_any_cell() {
    let mut planned = 0;
    for seed in 0..12 {
        let cell = random(seed);
        match plan(&cell, &small(Shape::ALL[seed as usize % 4], 8.0 + seed as f64), &|| ()) {
            Ok(plan) => {
                planned += 1;
                check_path(&cell, &plan);
                check_gate(&cell, &plan);
                check_view(&cell, &plan, 0..60);
            }
            // A cell may be too tight; then that is said, and nothing is planned.
            Err(error) => assert!(matches!(error, PlanError::NoRoom { .. }), "{error}"),
        }
    }
    assert!(planned >= 8, "{planned} of 12 cells could be planned");
}

#[test]
fn the_box_is_kept() {
    let mut cell = example();
    let free = plan(&cell, &small(Shape::S, 15.0), &|| ()).unwrap();
    let at: Vec<Vector3<f64>> = free.path().iter().map(|pose| pose.translation.vector).collect();
    let (low, high) = at.iter().fold((at[0], at[0]), |(low, high), p| (low.inf(p), high.sup(p)));
    // A fifth narrower than what it likes best.
    let narrower = (high - low) * 0.1;
    cell.limits.workspace_m = Some([low + narrower, high - narrower]);
    check_path(&cell, &plan(&cell, &small(Shape::S, 15.0), &|| ()).unwrap());
}

#[test]
fn what_cannot_be_planned_is_refused_with_the_limit_that_stands_in_the_way() {
    let mut cell = example();
    cell.limits.speed_m_s = 0.001;
    let hasty = plan(&cell, &small(Shape::S, 5.0), &|| ()).map(|plan| plan.score);
    let Err(PlanError::NoRoom { constraint: Constraint::Speed, .. }) = hasty else {
        panic!("neither moving nor pivoting passes 90 mm in 5 s at 1 mm/s: {hasty:?}")
    };
    let mut cell = example();
    cell.guess_error.line_m = 0.1;
    let Err(PlanError::NoRoom { constraint: Constraint::View, used, .. }) =
        plan(&cell, &small(Shape::S, 20.0), &|| ())
    else {
        panic!("the view is 150 mm wide")
    };
    assert!(used > 1.0);
    let mut cell = example();
    cell.limits.tilt_rad = [0.0; 3];
    let Err(PlanError::NotShown { rank, .. }) = plan(&cell, &small(Shape::S, 20.0), &|| ()) else {
        panic!("without tilt the translation is not seen")
    };
    // Eight at a constant attitude; where the sheet stands square to the seam two more turns do not show.
    assert_eq!(rank, 6);
    let mut cell = example();
    cell.seam.to_m = cell.seam.from_m;
    assert_eq!(plan(&cell, &small(Shape::S, 20.0), &|| ()).unwrap_err(), PlanError::NoSeam);
    for duration_s in [f64::NAN, 0.0, -1.0, 1e9] {
        let refused = plan(&example(), &small(Shape::S, duration_s), &|| ());
        assert!(matches!(refused, Err(PlanError::Duration { .. })), "{duration_s}");
    }
}

#[test]
fn a_seam_that_is_short_against_the_error_of_its_ends_is_refused() {
    let mut cell = example();
    cell.seam.to_m = cell.seam.from_m + Vector3::x() * 0.03;
    let refused = plan(&cell, &small(Shape::S, 20.0), &|| ()).map(|plan| plan.score);
    assert!(
        matches!(refused, Err(PlanError::NoRoom { constraint: Constraint::SeamEnds, .. })),
        "{refused:?}"
    );
}

#[test]
fn the_same_seed_gives_the_same_plan_on_any_number_of_threads() {
    let ask = |threads| PlanRequest { evaluations: 300, duration_s: 20.0, threads, ..PlanRequest::default() };
    let mut cell = example();
    cell.guess_error.line_m = 0.0;
    let [one, two] = [1, 2].map(|threads| plan(&cell, &ask(threads), &|| ()).unwrap());
    assert_eq!(one.motion.design(), two.motion.design());
    assert_eq!(one.path(), two.path());
}
