//! The stripe on a plate: the distance by a search along the curve itself, the Jacobian by differences of it, and the effect
//! of the obvious residual on a sensor's shape.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{DMatrix, DVector, SVector, UnitVector3, Vector2, Vector3};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use trueline_geometry::{Plane, Pose, Trajectory, se3, so3};
use trueline_lsq::check::numerical_jacobian;
use trueline_model::{LaserSheet, Placement, Plate, SheetShape, StripeOnPlate, SupportPair};
use view::{View, shape, vector, view};

const UNKNOWNS: usize = 22;

mod view;

#[derive(Clone, Debug)]
struct Case {
    view: View,
    plate: Plate,
    shape: SheetShape,
}

fn case() -> impl Strategy<Value = Case> {
    let plate = (vector(0.3), -0.001..0.001_f64, prop::array::uniform7(-3e-4..3e-4_f64), 0.3..1.2_f64);
    (view(), plate, shape()).prop_map(|(view, (turn, miss_m, surface_m, lean), shape)| {
        let placement = view.placement();
        let base_from_camera = placement.base_from_camera().rotation;
        // The plate is inclined to the sheet, which it cuts along a direction of the stripe.
        let along_stripe = base_from_camera * (view.sheet.axes() * Vector2::new(lean.cos(), lean.sin()));
        let along = so3::exp(&turn) * (base_from_camera * view.sheet.plane().normal().into_inner());
        let normal = UnitVector3::new_normalize(along_stripe.cross(&along));
        let there = placement.point_in_base(&view.point_in_camera());
        let centre = there + normal.as_ref() * miss_m + along * 0.03 - along_stripe * 0.01;
        let plate = Plate { surface_m, ..Plate::flat(centre, &normal, &along).unwrap() };
        Case { view, plate, shape }
    })
}

/// Place of a plate's surface, written out: height over its own plane, without the model's derivatives.
fn height_over_plate(plate: &Plate, point: &Vector3<f64>) -> f64 {
    let from = point - plate.chart.centre;
    let (r, s) = (from.dot(&plate.chart.outward) / 0.025, from.dot(&plate.chart.along) / 0.1);
    let [a, b, c, d, e, f, g] = plate.surface_m;
    let surface = r * (a * r + b * s + r * (d * r + e * s)) + s * s * (c + f * r + g * s);
    from.dot(&plate.normal) - plate.offset_m - surface
}

/// Signed distance after a step of all unknowns by search. Along the normals of a straight guess the curve is bracketed and bisected, and the least
/// distance is found by golden sections.
fn searched(case: &Case, step: &DVector<f64>) -> f64 {
    let three = |k: usize| Vector3::new(step[k], step[k + 1], step[k + 2]);
    let placement = case.view.stepped(step);
    let plate = case.plate.retract(&three(7), &SVector::from_fn(|k, _| step[10 + k]));
    let shape = case.shape.retract(&SVector::from_fn(|k, _| step[17 + k]));
    let height = |at: &Vector2<f64>| {
        let point = case.view.sheet.point(&shape.corrected(at).0);
        height_over_plate(&plate, &placement.point_in_base(&point))
    };
    let d = 1e-5;
    let slope = |axis: usize| {
        let by = Vector2::ith(axis, d);
        (height(&(case.view.in_sheet + by)) - height(&(case.view.in_sheet - by))) / (2.0 * d)
    };
    let up = Vector2::new(slope(0), slope(1)).normalize();
    let side = Vector2::new(-up.y, up.x);
    let on_curve = |t: f64| {
        let (mut low, mut high) = (-0.02, 0.02);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            let at = case.view.in_sheet + side * t + up * middle;
            if height(&at) > 0.0 { high = middle } else { low = middle }
        }
        Vector2::new(t, 0.5 * (low + high))
    };
    let (mut low, mut high) = (-2e-3, 2e-3);
    for _ in 0..60 {
        let [a, b] = [low + 0.382 * (high - low), low + 0.618 * (high - low)];
        if on_curve(a).norm() < on_curve(b).norm() { high = b } else { low = a }
    }
    let nearest = on_curve(0.5 * (low + high));
    -nearest.norm() * nearest.y.signum()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 25, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_residual_is_the_distance_and_its_jacobian_that_of_differences(case in case()) {
        let placement = case.view.placement();
        let stripe = StripeOnPlate { plate: &case.plate, sheet: &case.view.sheet, shape: Some(&case.shape) };
        let parts = stripe.linearize(&placement, &case.view.in_sheet).unwrap();
        let alone = stripe.residual(&placement, &case.view.in_sheet).unwrap();
        prop_assert!((alone - parts.residual).abs() < 1e-15);
        // Golden sections end where distances differ by rounding of 1e-2 m: the root of 1e-16 in t, squared in ρ.
        prop_assert!((parts.residual - searched(&case, &DVector::zeros(UNKNOWNS))).abs() < 1e-12);
        let mut analytic = DMatrix::zeros(1, UNKNOWNS);
        let links = placement.carried(&parts.by_pose);
        analytic.view_mut((0, 0), (1, 7)).copy_from(&links.transpose());
        analytic.view_mut((0, 7), (1, 3)).copy_from(&parts.d_plate.transpose());
        analytic.view_mut((0, 10), (1, 7)).copy_from(&parts.d_surface.transpose());
        analytic.view_mut((0, 17), (1, 5)).copy_from(&parts.d_shape.transpose());
        let numerical = numerical_jacobian(UNKNOWNS, 1e-4, |step| DVector::from_element(1, searched(&case, step)));
        // Entries reach some metres per radian. Differences of distances with errors of 1e-13 m over 1e-4 give 1e-8. Truncation h⁴ f⁽⁵⁾/30 is far
        // below it.
        let error = (&analytic - &numerical).amax();
        prop_assert!(error < 2e-7, "{error:e}\n{analytic}\n{numerical}");
    }
}

#[test]
fn the_plane_of_a_plate_has_an_offset_in_base() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    for _ in 0..20 {
        let flat = case().new_tree(&mut runner).unwrap().current().plate;
        let plate = flat.retract(&Vector3::new(0.01, -0.02, 0.003), &SVector::zeros());
        let chart = &plate.chart;
        // Any point of the plane n·(p − centre) = offset.
        let aside = chart.along - plate.normal.as_ref() * plate.normal.dot(&chart.along);
        let point = chart.centre + plate.normal.as_ref() * plate.offset_m + aside * 0.07;
        // Sums of a few numbers near 1.
        assert!((plate.normal.dot(&point) - plate.offset_in_base_m()).abs() < 1e-14);
    }
}

#[test]
fn a_shift_and_a_turn_of_the_sensor_move_the_residual_by_their_gradients() {
    let sheet = LaserSheet::from_plane(Plane::from_height(0.036, 2.12, 0.13).unwrap());
    let trajectory = Trajectory::new(
        vec![0.0, 1.0],
        &[
            Pose::identity(),
            se3::from_parts(so3::exp(&Vector3::new(0.0, 0.1, 0.0)), Vector3::new(0.1, 0.0, 0.0)),
        ],
    )
    .unwrap();
    let normal = UnitVector3::new_normalize(Vector3::new(0.3, -0.5, 0.8));
    let plate = Plate::flat(Vector3::new(0.0, 0.0, 0.15), &normal, &Vector3::new(0.1, 1.0, 0.2)).unwrap();
    let stripe = StripeOnPlate { plate: &plate, sheet: &sheet, shape: None };
    let hand_eye = se3::from_parts(so3::exp(&Vector3::zeros()), Vector3::new(0.02, -0.03, 0.01));
    let reported = Vector2::new(0.004, 0.01);
    let at = |shift: Vector3<f64>, turn: Vector3<f64>| {
        let mut placement = Placement::new(trajectory.segment(0).unwrap(), 0.3, &hand_eye);
        let robot = &mut placement.base_from_tool;
        robot.translation.vector += shift;
        robot.rotation = so3::exp(&turn) * robot.rotation;
        (stripe.linearize(&placement, &reported).unwrap(), placement)
    };
    let none = Vector3::zeros();
    let (rest, there) = at(none, none);
    for axis in 0..3 {
        let by = Vector3::ith(axis, 1e-4);
        // A flat plate and an exact sensor: linear in a shift, up to rounding over 2e-4. In a rotation, linear up to the square of 1e-4.
        let slope = (at(by, none).0.residual - at(-by, none).0.residual) / 2e-4;
        assert!((slope - rest.by_pose.by_shift[axis]).abs() < 1e-9, "{axis}: {slope}");
        let slope = (at(none, by).0.residual - at(none, -by).0.residual) / 2e-4;
        assert!((slope - rest.by_pose.by_turn[axis]).abs() < 1e-7, "{axis}: {slope}");
    }
    // The foot lies on the plate. A plate along the sheet has no stripe.
    let foot = sheet.point(&(reported - rest.normal * rest.residual));
    assert!(plate.distance(&there.point_in_base(&foot)).value.abs() < 1e-12);
    let placement = Placement::new(trajectory.segment(0).unwrap(), 0.3, &Pose::identity());
    let in_base = placement.base_from_camera() * sheet.plane().normal().into_inner();
    let beside = Plate::flat(
        Vector3::new(0.0, 0.0, 0.15),
        &UnitVector3::new_normalize(in_base),
        &in_base.cross(&Vector3::x()),
    );
    assert!(
        StripeOnPlate { plate: &beside.unwrap(), ..stripe }
            .linearize(&placement, &Vector2::zeros())
            .is_none()
    );
}

/// A linear congruential generator, fully determined by its seed.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

const POINTS: usize = 6000;
const NOISE_M: f64 = 2e-3;

/// Points of a stripe with noise perpendicular to it, and the sensor's placements.
fn noisy_points(plate: &Plate, sheet: &LaserSheet) -> Vec<(Placement, Vector2<f64>)> {
    let mut random = Random(5);
    let point = |_| {
        let mut number = |size: f64| size * (2.0 * random.uniform() - 1.0);
        let turn = Vector3::new(number(0.2), number(0.2), number(0.2));
        let shift = Vector3::new(number(0.015), number(0.05), number(0.015));
        let start = se3::from_parts(so3::exp(&turn), shift);
        let trajectory = Trajectory::new(vec![0.0, 1.0], &[start, start]).unwrap();
        let placement = Placement::new(trajectory.segment(0).unwrap(), 0.5, &Pose::identity());
        let near = Vector2::new(number(0.015), 0.13);
        let on_plate = StripeOnPlate { plate, sheet, shape: None }.linearize(&placement, &near).unwrap();
        let exact = near - on_plate.normal * on_plate.residual;
        (placement, exact + on_plate.normal * (NOISE_M * random.normal()))
    };
    (0..POINTS).map(point).collect()
}

/// Plane and depth scale by Gauss–Newton from the truth, from rows (r, J). Returns the depth scale h₂ and its standard deviation.
fn depth_scale(
    mut rows: impl FnMut(&Plate, &SheetShape) -> Vec<(f64, SVector<f64, 4>)>,
    plate: &Plate,
) -> (f64, f64) {
    let (mut plate, mut shape) = (*plate, SheetShape { h: [0.0; 5], origin_m: [0.0, 0.13] });
    let mut variance = 0.0;
    for _ in 0..5 {
        let (mut hessian, mut gradient) =
            (nalgebra::SMatrix::<f64, 4, 4>::zeros(), SVector::<f64, 4>::zeros());
        for (residual, jacobian) in rows(&plate, &shape) {
            hessian += jacobian * jacobian.transpose();
            gradient += jacobian * residual;
        }
        let inverse = hessian.try_inverse().unwrap();
        let step = -(inverse * gradient);
        plate = plate.retract(&step.fixed_rows::<3>(0).into(), &SVector::zeros());
        shape.h[1] += step[3];
        variance = inverse[(3, 3)] * NOISE_M * NOISE_M;
    }
    (shape.h[1], variance.sqrt())
}

/// The obvious residual, distance of the placed point from the plate, uses the measured point as the true one in its
/// derivative. With noise σ and depths that spread by b, the depth scale is biased by about σ²/b², for any number of
/// points.
#[test]
fn the_obvious_residual_is_biased_and_the_forward_one_is_not() {
    let sheet = LaserSheet::of_profiler();
    let normal = UnitVector3::new_normalize(Vector3::new(0.5, 0.1, -0.85));
    let plate = Plate::flat(Vector3::new(0.0, 0.0, 0.13), &normal, &Vector3::y()).unwrap();
    let points = noisy_points(&plate, &sheet);
    let forward = |plate: &Plate, shape: &SheetShape| {
        let stripe = StripeOnPlate { plate, sheet: &sheet, shape: Some(shape) };
        let row = |(placement, at): &(Placement, Vector2<f64>)| {
            let parts = stripe.linearize(placement, at).unwrap();
            let mut jacobian = SVector::<f64, 4>::zeros();
            jacobian.fixed_rows_mut::<3>(0).copy_from(&parts.d_plate);
            jacobian[3] = parts.d_shape[1];
            (parts.residual, jacobian)
        };
        points.iter().map(row).collect()
    };
    let obvious = |plate: &Plate, shape: &SheetShape| {
        let row = |(placement, at): &(Placement, Vector2<f64>)| {
            let value = |step: &SVector<f64, 4>| {
                let plate = plate.retract(&step.fixed_rows::<3>(0).into(), &SVector::zeros());
                let mut shape = *shape;
                shape.h[1] += step[3];
                plate.distance(&placement.point_in_base(&sheet.point(&shape.corrected(at).0))).value
            };
            let slope = |k: usize| {
                let step = SVector::<f64, 4>::ith(k, 1e-5);
                (value(&step) - value(&-step)) / 2e-5
            };
            (value(&SVector::zeros()), SVector::from_fn(|k, _| slope(k)))
        };
        points.iter().map(row).collect()
    };
    let (unbiased, sigma) = depth_scale(forward, &plate);
    let (biased, biased_sigma) = depth_scale(obvious, &plate);
    println!("forward {unbiased:.5} ± {sigma:.5}, obvious {biased:.5} ± {biased_sigma:.5}");
    assert!(unbiased.abs() < 3.5 * sigma, "{unbiased} ± {sigma}");
    assert!(biased.abs() > 5.0 * biased_sigma, "{biased} ± {biased_sigma}");
}

/// A whole stripe: two points of its line.
fn whole(case: &Case, half_m: f64, turn: f64) -> [Vector2<f64>; 2] {
    let placement = case.view.placement();
    let stripe = StripeOnPlate { plate: &case.plate, sheet: &case.view.sheet, shape: Some(&case.shape) };
    let up = stripe.linearize(&placement, &case.view.in_sheet).unwrap().normal;
    let along = nalgebra::Rotation2::new(turn) * Vector2::new(up.y, -up.x);
    [case.view.in_sheet - along * half_m, case.view.in_sheet + along * half_m]
}

/// What lines of least squares through many columns say that are even in the picture: that through the stripe under a
/// reported line, in the line's own direction, each column by bisection. A place of the picture is a point of the line by
/// homogeneous coordinates, with depths as weights; a length there has the more pixels the nearer it is.
fn fitted(case: &Case, supports: &SupportPair, step: &DVector<f64>) -> [f64; 2] {
    const COLUMNS: usize = 300;
    let three = |k: usize| Vector3::new(step[k], step[k + 1], step[k + 2]);
    let placement = case.view.stepped(step);
    let plate = case.plate.retract(&three(7), &SVector::from_fn(|k, _| step[10 + k]));
    let shape = case.shape.retract(&SVector::from_fn(|k, _| step[17 + k]));
    let height = |at: &Vector2<f64>| {
        let point = case.view.sheet.point(&shape.corrected(at).0);
        height_over_plate(&plate, &placement.point_in_base(&point))
    };
    let ([one, other], depth) = (supports.reported, supports.depth_ratio);
    let (middle, way) = (0.5 * (one + other), 0.5 * (other - one));
    let mut up = Vector2::new(-way.y, way.x).normalize();
    if height(&(middle + up * 1e-4)) < height(&(middle - up * 1e-4)) {
        up = -up;
    }
    let (mut mean, mut moment, mut spread) = (0.0, 0.0, 0.0);
    for k in 0..COLUMNS {
        let t = 3.0_f64.sqrt() * ((2 * k + 1) as f64 / COLUMNS as f64 - 1.0);
        let (mut low, mut high) = (-0.02, 0.02);
        for _ in 0..60 {
            let at = 0.5 * (low + high);
            let shares = [0.5 * (1.0 - t), 0.5 * (1.0 + t) / depth];
            let place = (one * shares[0] + other * shares[1]) / (shares[0] + shares[1]);
            if height(&(place - up * at)) > 0.0 { low = at } else { high = at }
        }
        let nearness = 0.5 * (1.0 - t) + 0.5 * (1.0 + t) / depth;
        mean += low * nearness / COLUMNS as f64;
        moment += t * low * nearness;
        spread += t * t;
    }
    [(-1.0, 1.0), (1.0, depth)].map(|(t, depth)| (mean + moment / spread * t) * depth)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20, failure_persistence: None, ..ProptestConfig::default() })]

    /// The second number is the angle of the line relative to that of a bowed stripe's line.
    #[test]
    fn the_line_of_a_stripe_is_compared_with_that_of_the_predicted_stripe(
        case in case(), half_m in 5e-3..15e-3_f64, turn in -0.01..0.01_f64, depth_ratio in 0.9..1.1_f64
    ) {
        let placement = case.view.placement();
        let supports = SupportPair { reported: whole(&case, half_m, turn), depth_ratio };
        let stripe = StripeOnPlate { plate: &case.plate, sheet: &case.view.sheet, shape: Some(&case.shape) };
        let rows = stripe.linearize_supports(&placement, &supports).unwrap();
        let alone = stripe.support_residuals(&placement, &supports).unwrap();
        let said = fitted(&case, &supports, &DVector::zeros(UNKNOWNS));
        for (k, row) in rows.iter().enumerate() {
            prop_assert!((alone[k] - row.residual).abs() < 1e-15);
            // Bows of 1.5 mm at the ends. The mean of even columns' squares is less by 1/n², and the fifth-degree part is a
            // thousandth of the bow's. Of third degrees, up to a third of them, goes beyond the third by place what is
            // below.
            let tolerance = 5e-8 + 0.5e-3 * 0.1 * (depth_ratio - 1.0_f64).powi(2);
            prop_assert!((row.residual - said[k]).abs() < tolerance, "{} {}", row.residual, said[k]);
            let mut analytic = DVector::zeros(UNKNOWNS);
            let links = placement.carried(&row.by_pose);
            analytic.rows_mut(0, 7).copy_from(&links);
            analytic.rows_mut(7, 3).copy_from(&row.d_plate);
            analytic.rows_mut(10, 7).copy_from(&row.d_surface);
            analytic.rows_mut(17, 5).copy_from(&row.d_shape);
            let numerical = numerical_jacobian(UNKNOWNS, 1e-4, |step| {
                DVector::from_element(1, fitted(&case, &supports, step)[k])
            });
            for (of, (a, b)) in analytic.iter().zip(numerical.iter()).enumerate() {
                // The mean of even columns' powers up to the fourth is less by up to 10/(3 n²) of the summed values, up to
                // one; three points miss a part of a bowed stripe, of the order of its slope squared, 2e-4. By place a third
                // degree in the picture goes on with a tenth of the depths' difference squared.
                let tolerance = 5e-4 + 0.1 * (depth_ratio - 1.0_f64).powi(2);
                prop_assert!((a - b).abs() < tolerance * b.abs().max(1.0), "{of}: {a} {b}");
            }
        }
    }
}

/// A strongly bowed stripe, with third-degree terms of 0.2 mm at 25 mm and 60 mm reach from the seam, agrees with its own line within a millionth of
/// the bow that a straight line leaves out.
#[test]
fn the_line_of_a_long_bowed_stripe_has_no_residual_but_for_noise() {
    let sheet = LaserSheet::of_profiler();
    let normal = UnitVector3::new_normalize(Vector3::new(0.5, 0.1, -0.85));
    let mut plate = Plate::flat(Vector3::new(0.0, 0.0, 0.13), &normal, &Vector3::y()).unwrap();
    plate.surface_m = [-2e-4, -1e-4, 2e-4, 2e-4, -2e-4, 2e-4, -1e-4];
    let still = Trajectory::new(vec![0.0, 1.0], &[Pose::identity(), Pose::identity()]).unwrap();
    let turned = se3::from_parts(so3::exp(&Vector3::new(0.02, -0.1, 0.3)), Vector3::zeros());
    let placement = Placement::new(still.segment(0).unwrap(), 0.5, &turned);
    let stripe = StripeOnPlate { plate: &plate, sheet: &sheet, shape: None };
    let flat = Plate { surface_m: [0.0; 7], ..plate };
    let begin =
        StripeOnPlate { plate: &flat, ..stripe }.linearize(&placement, &Vector2::new(0.004, 0.13)).unwrap();
    let along = Vector2::new(begin.normal.y, -begin.normal.x);
    let along = along * along.x.signum();
    let mut supports = [0.2, 0.8].map(|part| Vector2::new(0.004, 0.13) + along * (0.06 * part));
    // The line of a curve does not depend on the line to which it refers, except for the spacing along it.
    for _ in 0..8 {
        let pair = SupportPair { reported: supports, depth_ratio: 1.0 };
        let off = stripe.support_residuals(&placement, &pair).unwrap();
        let across = Vector2::new(supports[0].y - supports[1].y, supports[1].x - supports[0].x).normalize();
        let across = across * across.dot(&begin.normal).signum();
        supports = [0, 1].map(|k| supports[k] - across * off[k]);
    }
    let columns = fitted_to_columns(&stripe, &placement, &supports);
    let pair = SupportPair { reported: supports, depth_ratio: 1.0 };
    let left = stripe.support_residuals(&placement, &pair).unwrap();
    let beside = supports.map(|at| stripe.residual(&placement, &at).unwrap());
    for k in [0, 1] {
        assert!(beside[k].abs() > 2e-5, "{beside:?}");
        assert!(left[k].abs() < 1e-9 && columns[k].abs() < 2e-7, "{left:?} {columns:?}");
    }
}

/// The line through equally spaced columns, from distances of a curve that is followed column by column.
fn fitted_to_columns(
    stripe: &StripeOnPlate<'_>,
    placement: &Placement,
    supports: &[Vector2<f64>; 2],
) -> [f64; 2] {
    const COLUMNS: usize = 1000;
    let (middle, way) = (0.5 * (supports[0] + supports[1]), 0.5 * (supports[1] - supports[0]));
    let up = Vector2::new(-way.y, way.x).normalize();
    let (mut mean, mut moment, mut spread) = (0.0, 0.0, 0.0);
    for k in 0..COLUMNS {
        let t = 3.0_f64.sqrt() * ((2 * k + 1) as f64 / COLUMNS as f64 - 1.0);
        let phi = |height: f64| {
            let in_base = placement.point_in_base(&stripe.sheet.point(&(middle + way * t + up * height)));
            height_over_plate(stripe.plate, &in_base)
        };
        let (mut low, mut high) = (-0.01, 0.01);
        for _ in 0..60 {
            let at = 0.5 * (low + high);
            if (phi(at) > 0.0) == (phi(-0.01) > 0.0) { low = at } else { high = at }
        }
        mean += low / COLUMNS as f64;
        moment += t * low;
        spread += t * t;
    }
    [-1.0, 1.0].map(|t| mean + moment / spread * t)
}
