//! A sensor that was calibrated before a board, with all that is then known of it, in line scans: carried as a prior, and held.
#![allow(clippy::print_stdout, reason = "figures of the statistics, shown by --nocapture")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{Point3, Vector2, Vector3};
use trueline_dataset::sensor_setup::{SensorCovariance, SensorUncertainty};
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_geometry::{Plane, Pose, se3, so3};
use trueline_method::{Calibration, Config, SensorMode, calibrate};
use trueline_model::{Camera, LaserSheet};
use trueline_sensor::intrinsics::{DistortionModel, fit};
use trueline_sensor::laser_plane::{KnownCamera, StripedView, fit_joint};
use trueline_sensor::projection::project_from_board;
use trueline_sensor::{Board, FoundCorner, View};
use trueline_sim::noise::Noise;
use trueline_sim::{Preset, random_cell, simulate};

/// Small enough to fill the view at 131 mm.
const BOARD: Board = Board { columns: 10, rows: 7, square_m: 0.006 };
/// Noise of the stripe's pixels, px.
const STRIPE_PX: f64 = 0.5;

/// How somebody calibrates his sensor.
#[derive(Clone, Copy)]
struct Bench {
    name: &'static str,
    /// Pictures without, and as many with the laser.
    pictures: usize,
    /// Noise of corners, px.
    corner_px: f64,
    /// Boards with the laser are so far from the middle one, along the laser plane, m.
    reach_m: f64,
    /// Offset of a board's surface at its stripe, m, and change of it over 50 mm.
    flatness_m: f64,
}

/// All of the depth in which the sensor measures, and a board of glass.
const CAREFUL: Bench =
    Bench { name: "careful", pictures: 12, corner_px: 0.15, reach_m: 0.02, flatness_m: 2e-6 };
/// As the boards of the paper's authors are: within 12 mm of depth, 0.05 mm off the plane.
const NARROW: Bench =
    Bench { name: "narrow", pictures: 18, corner_px: 0.15, reach_m: 0.006, flatness_m: 5e-5 };

/// `camera_from_board`: tilted to every side, near and far, its middle at a point.
fn view(k: usize, middle: &Vector3<f64>) -> Pose {
    let angle = 2.399_963 * k as f64;
    let turn = Vector3::new(angle.cos(), angle.sin(), 0.0) * (0.25 + 0.25 * (k % 3) as f64 / 2.0);
    let rotation = so3::exp(&turn);
    se3::from_parts(rotation, middle - rotation * BOARD.middle())
}

fn corners(camera: &Camera, pose: &Pose, corner_px: f64, noise: &mut Noise) -> View {
    let mut corners = Vec::new();
    for (row, column) in (0..BOARD.rows).flat_map(|row| (0..BOARD.columns).map(move |column| (row, column))) {
        let seen = project_from_board(camera, pose, &BOARD.corner(column, row)).unwrap().pixel;
        let pixel = seen + Vector2::from_fn(|_, _| noise.normal(corner_px));
        let inside = |x: f64, size: u32| x > 5.0 && x < f64::from(size) - 6.0;
        if inside(pixel.x, camera.size[0]) && inside(pixel.y, camera.size[1]) {
            corners.push(FoundCorner { column, row, pixel });
        }
    }
    View { complete: corners.len() == BOARD.corners(), corners }
}

/// The stripe of a plane on a board that is flat to so much: where both meet, projected.
fn stripe(
    camera: &Camera,
    plane: &Plane,
    pose: &Pose,
    flatness_m: f64,
    noise: &mut Noise,
) -> Vec<Vector2<f64>> {
    let normal = pose.rotation * Vector3::z();
    let along = normal.cross(plane.normal()).normalize();
    let middle = pose * Point3::from(BOARD.middle());
    // Down the board's steepest line to the plane.
    let down = along.cross(&normal);
    let on_plane = middle.coords - down * (plane.signed_distance(&middle.coords) / plane.normal().dot(&down));
    // Off the board, the laser's light stays on its plane.
    let off_board = along.cross(plane.normal());
    let off_board = off_board / off_board.dot(&normal);
    let (bulge_m, twist) = (noise.normal(flatness_m), noise.normal(flatness_m / 0.05));
    let pixels = (-100..=100).map(|n| {
        let s = f64::from(n) * 2e-4;
        let point = on_plane + along * s + off_board * (bulge_m + twist * s);
        let seen = project_from_board(camera, &Pose::identity(), &point).unwrap().pixel;
        seen + Vector2::from_fn(|_, _| noise.normal(STRIPE_PX))
    });
    pixels.collect()
}

/// The scan as somebody reads it whose sensor was calibrated with noisy pictures of a board.
fn with_calibrated_sensor(truth: &Recording, by: &Bench, seed: u64) -> Recording {
    let mut noise = Noise::new(seed, 91);
    let Sensor::CameraLaser { camera, laser_plane_in_camera: plane } = &truth.sensor else {
        panic!("a camera")
    };
    let depth = |k: usize| 0.115 + 0.04 * (0.618_034 * k as f64).fract();
    let views: Vec<View> = (0..by.pictures)
        .map(|k| {
            let aside = Vector3::new((k as f64).cos() * 0.07, (k as f64).sin() * 0.06, 1.0);
            corners(camera, &view(k, &(aside * depth(k))), by.corner_px, &mut noise)
        })
        .collect();
    let bench = fit(camera.size, &BOARD, &views, Some(DistortionModel::K1K2P1P2)).unwrap();
    let known = KnownCamera { camera: bench.state.camera, covariance: bench.covariance };
    let striped: Vec<StripedView> = (0..by.pictures)
        .map(|k| {
            let ray = Vector3::new(0.0, 0.0, 1.0);
            let (middle, _) = LaserSheet::from_plane(*plane).intersect(&ray).unwrap();
            // Along the sheet, near and far.
            let sheet = LaserSheet::from_plane(*plane);
            let away = sheet.axes().column(1) * (by.reach_m * (1.3 * k as f64).sin());
            let pose = view(k, &(middle + away));
            StripedView {
                view: corners(camera, &pose, by.corner_px, &mut noise),
                stripe: stripe(camera, plane, &pose, by.flatness_m, &mut noise),
            }
        })
        .collect();
    let bench = fit_joint(&known, &BOARD, &striped).unwrap();
    let mut calibrated = truth.clone();
    calibrated.sensor =
        Sensor::CameraLaser { camera: bench.state.camera, laser_plane_in_camera: bench.plane().unwrap() };
    let covariance = SensorCovariance::of_free(&bench.covariance);
    calibrated.setup.uncertainty = Some(SensorUncertainty::default().with_joint(covariance));
    calibrated
}

/// Mean square distance, in the tool frame, between where seam points are and where the calibration puts them, m².
fn seam_error(truth: &Recording, read: &Recording, c: &Calibration) -> f64 {
    let lift = |sensor: &Sensor, uv: [f64; 2]| {
        let Sensor::CameraLaser { camera, laser_plane_in_camera: plane } = sensor else { panic!("a camera") };
        LaserSheet::from_plane(*plane).intersect(&camera.ray(&uv.into()).unwrap().0).unwrap().0
    };
    let Sensor::CameraLaser { laser_plane_in_camera: plane, .. } = &read.sensor else { panic!("a camera") };
    let (sheet, found) = (LaserSheet::from_plane(*plane), c.best_fit());
    let hand_eye = truth.truth.as_ref().unwrap().parameters.tool_from_camera;
    let squares = truth.features.iter().step_by(5).filter_map(|feature| {
        let Measured::Pixel(uv) = feature.measured else { return None };
        let there = hand_eye * Point3::from(lift(&truth.sensor, uv));
        let said = found.tool_from_camera * Point3::from(found.corrected(&sheet, &lift(&read.sensor, uv)));
        Some((there - said).norm_squared())
    });
    let squares: Vec<f64> = squares.collect();
    squares.iter().sum::<f64>() / squares.len() as f64
}

/// Root mean squares over cells.
struct Outcome {
    /// Seam error with the sensor as a prior, and held, mm.
    achieved_mm: [f64; 2],
    /// Its size by the results, mm.
    said_mm: [f64; 2],
    /// Cells in which the prior was the better.
    better: u64,
}

fn outcome(by: &Bench, cells: u64) -> Outcome {
    let (mut squares, mut said, mut better) = ([0.0; 2], [0.0; 2], 0);
    for seed in 0..cells {
        let truth = simulate(&random_cell(&Preset::Good.scenario(), seed, 0.1), seed).unwrap();
        let read = with_calibrated_sensor(&truth, by, seed);
        let of = [SensorMode::Prior, SensorMode::Fixed].map(|sensor| {
            let config =
                Config { sensor, robot_accuracy_m: Some(0.0), feature_bias_px: 0.0, ..Config::default() };
            let c = calibrate(&read, None, &config).unwrap();
            let said = c.findings.checks.seam_error.map_or(f64::NAN, |error| error.rms_m);
            (seam_error(&truth, &read, &c), said * said)
        });
        for k in 0..2 {
            squares[k] += of[k].0 / cells as f64;
            said[k] += of[k].1 / cells as f64;
        }
        better += u64::from(of[0].0 < of[1].0);
    }
    let mm = |squares: [f64; 2]| squares.map(|square| square.sqrt() * 1e3);
    Outcome { achieved_mm: mm(squares), said_mm: mm(said), better }
}

#[test]
fn a_sensor_from_the_board_is_better_carried_as_a_prior_than_held() {
    let cells = std::env::var("TRUELINE_CELLS").ok().and_then(|n| n.parse().ok()).unwrap_or(12_u64);
    for (by, at_most) in [(CAREFUL, 1.0), (NARROW, 0.5)] {
        let of = outcome(&by, cells);
        let ([prior, held], [prior_said, held_said]) = (of.achieved_mm, of.said_mm);
        let (name, better) = (by.name, of.better);
        println!(
            "{name}: prior {prior:.4} mm (said {prior_said:.4}), held {held:.4} mm (said {held_said:.4}), better in {better} of {cells}"
        );
        // The same cells and sensors for both: their difference is not one of chance.
        assert!(prior < at_most * held, "{name}: prior {prior} mm, held {held} mm");
        // Root mean squares over a dozen cells, each of some five numbers that matter: good to 1/√120 = 9 %.
        assert!(
            (0.7..1.4).contains(&(prior / prior_said)),
            "{name}: achieved {prior} mm, said {prior_said} mm"
        );
    }
}
