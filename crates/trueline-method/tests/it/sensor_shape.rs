//! A sensor with a wrong calibration: the shape absorbs the error, and the statement about a seam point is true.

use nalgebra::{Vector2, Vector3};
use trueline_dataset::sensor_setup::SensorUncertainty;
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_geometry::{Plane, so3};
use trueline_method::{Calibration, Config, Reason, SensorMode, Status, Warning, calibrate};
use trueline_model::{Camera, LaserSheet};
use trueline_sim::{Preset, random_cell, simulate};

fn parts(sensor: &Sensor) -> (Camera, Plane) {
    let Sensor::CameraLaser { camera, laser_plane_in_camera } = sensor else { panic!("a camera") };
    (*camera, *laser_plane_in_camera)
}

/// The same recording, read with a changed sensor.
fn with_sensor(recording: &Recording, change: impl Fn(&mut Camera, &mut Plane)) -> Recording {
    let mut recording = recording.clone();
    let (mut camera, mut plane) = parts(&recording.sensor);
    change(&mut camera, &mut plane);
    recording.sensor = Sensor::CameraLaser { camera, laser_plane_in_camera: plane };
    recording
}

/// Root mean square distance, in the tool frame, between a calibration's places of the sensor's points and their true
/// places, over the pixels of the scan.
fn seam_error_m(true_recording: &Recording, wrong: &Recording, c: &Calibration) -> f64 {
    let truth = true_recording.truth.as_ref().unwrap().parameters.tool_from_camera;
    let lift = |sensor: &Sensor, pixel: &Vector2<f64>| {
        let (camera, plane) = parts(sensor);
        LaserSheet::from_plane(plane).intersect(&camera.ray(pixel).unwrap().0).unwrap().0
    };
    let sheet = LaserSheet::from_plane(parts(&wrong.sensor).1);
    let squared: Vec<f64> = true_recording
        .features
        .iter()
        .step_by(7)
        .map(|feature| {
            let Measured::Pixel(pixel) = feature.measured else { panic!("pixels") };
            let pixel = Vector2::from(pixel);
            let there = truth * nalgebra::Point3::from(lift(&true_recording.sensor, &pixel));
            let corrected = c.best_fit().corrected(&sheet, &lift(&wrong.sensor, &pixel));
            let said = c.best_fit().tool_from_camera * nalgebra::Point3::from(corrected);
            (there - said).norm_squared()
        })
        .collect();
    (squared.iter().sum::<f64>() / squared.len() as f64).sqrt()
}

/// An ideal robot, features without bias, static points: only noise and sensor errors remain.
fn ideal_robot(sensor: SensorMode) -> Config {
    let mut config = Config { sensor, ..Config::noise_only() };
    config.used_at.speed_m_s = 0.0;
    config
}

fn tilted(plane: &Plane, degrees: f64) -> Plane {
    let axes = *LaserSheet::from_plane(*plane).axes();
    let axis: Vector3<f64> = axes.column(0).into();
    Plane::new(so3::exp(&(axis * degrees.to_radians())) * plane.normal().into_inner(), plane.offset())
        .unwrap()
}

/// The corrected camera and laser plane in the written file, with their own hand-eye transform, put every pixel at the
/// shape's place.
fn assert_corrected_camera_measures_the_same(what: &str, wrong: &Recording, c: &Calibration) {
    let corrected = c.findings.unknowns.corrected.as_ref().unwrap();
    let lift = |sensor: &Sensor, pixel: &Vector2<f64>| {
        let (camera, plane) = parts(sensor);
        LaserSheet::from_plane(plane).intersect(&camera.ray(pixel).unwrap().0).unwrap().0
    };
    let sheet = LaserSheet::from_plane(parts(&wrong.sensor).1);
    for feature in wrong.features.iter().step_by(50) {
        let Measured::Pixel(pixel) = feature.measured else { panic!("pixels") };
        let pixel = Vector2::from(pixel);
        let by_shape = c.best_fit().corrected(&sheet, &lift(&wrong.sensor, &pixel));
        let by_shape = c.best_fit().tool_from_camera * nalgebra::Point3::from(by_shape);
        let tool_from_corrected = c.best_fit().tool_from_camera * corrected.frame.camera_from_file;
        let by_camera = tool_from_corrected * nalgebra::Point3::from(lift(&corrected.sensor, &pixel));
        // The two free numbers of the seven change the lens distortion slightly: a percent of it over a few pixels.
        assert!((by_shape - by_camera).norm() < 3e-6, "{what}: {}", (by_shape - by_camera).norm());
    }
}

/// The same scan with wrong values in its sensor file.
fn with_wrong_sensors(recording: &Recording) -> [(&'static str, Recording); 8] {
    let moved = |by: f64| {
        move |_: &mut Camera, plane: &mut Plane| {
            *plane = Plane::new(plane.normal().into_inner(), plane.offset() + by).unwrap();
        }
    };
    [
        ("as it is", with_sensor(recording, moved(0.0))),
        ("plane 0.05 mm", with_sensor(recording, moved(0.05e-3))),
        ("plane 0.25 mm", with_sensor(recording, moved(0.25e-3))),
        ("plane 1 mm", with_sensor(recording, moved(1e-3))),
        ("tilted 0.1°", with_sensor(recording, |_, plane| *plane = tilted(plane, 0.1))),
        ("tilted 0.5°", with_sensor(recording, |_, plane| *plane = tilted(plane, 0.5))),
        ("focal 0.5 %", with_sensor(recording, |camera, _| camera.focal *= 1.005)),
        ("centre 20 px", with_sensor(recording, |camera, _| camera.centre.x += 20.0)),
    ]
}

/// Over eight cells, with some ten degrees of freedom in each: ± 8 % of the root.
#[test]
fn a_sensor_that_is_off_leaves_seam_points_where_they_are() {
    let mut squares = [0.0; 8];
    for seed in 1..=8 {
        let recording = simulate(&random_cell(&Preset::Quick.scenario(), seed, 1.0), seed).unwrap();
        for (k, (what, wrong)) in with_wrong_sensors(&recording).iter().enumerate() {
            let c = calibrate(wrong, None, &ideal_robot(SensorMode::Prior)).unwrap();
            let said = c.findings.checks.seam_error.unwrap().rms_m;
            squares[k] += (seam_error_m(&recording, wrong, &c) / said).powi(2) / 8.0;
            assert_corrected_camera_measures_the_same(what, wrong, &c);
        }
    }
    println!("{:.2?}", squares.map(f64::sqrt));
    assert!(squares.iter().all(|square| square.sqrt() < 1.3), "{squares:?}");
}

#[test]
fn a_sensor_that_is_held_and_off_is_refused() {
    let recording = simulate(&random_cell(&Preset::Quick.scenario(), 3, 1.0), 3).unwrap();
    let wrong = with_wrong_sensors(&recording);
    let refused = |wrong: &Recording| {
        let held = calibrate(wrong, None, &ideal_robot(SensorMode::Fixed)).unwrap();
        let refused = held.reasons().iter().any(|reason| matches!(reason, Reason::SensorOff { .. }));
        (refused, seam_error_m(&recording, wrong, &held))
    };
    let (as_it_is, (_, off)) = (&wrong[0].1, &wrong[3]);
    assert!(!refused(as_it_is).0);
    let estimated = calibrate(off, None, &ideal_robot(SensorMode::Prior)).unwrap();
    assert!(estimated.warnings().iter().any(|warning| matches!(warning, Warning::SensorOff { .. })));
    let (is_refused, held_error_m) = refused(off);
    assert!(is_refused && held_error_m > 5.0 * seam_error_m(&recording, off, &estimated));
}

#[test]
fn the_files_uncertainty_becomes_a_prior_of_the_shape() {
    let recording = simulate(&random_cell(&Preset::Quick.scenario(), 5, 1.0), 5).unwrap();
    // One millimetre, stated as one sigma. Along the only uncertain direction, h is one sigma of its prior.
    let mut wrong = with_sensor(&recording, |_, plane| {
        *plane = Plane::new(plane.normal().into_inner(), plane.offset() + 1e-3).unwrap();
    });
    wrong.setup.uncertainty =
        Some(SensorUncertainty { plane_offset_m: Some(1e-3), ..SensorUncertainty::default() });
    let c = calibrate(&wrong, None, &ideal_robot(SensorMode::Prior)).unwrap();
    let sensor = c.findings.unknowns.sensor.unwrap();
    assert!(sensor.stated && sensor.improved());
    let largest = (0..5).max_by(|&a, &b| sensor.prior_sigma[a].total_cmp(&sensor.prior_sigma[b])).unwrap();
    let ratio = sensor.shape.h[largest] / sensor.prior_sigma[largest];
    // To first order. A millimetre of 130 is a second-order 1 %, and the noise of h is a few percent of this prior.
    assert!((ratio.abs() - 1.0).abs() < 0.1, "{ratio}");
    // Without a stated uncertainty it would be significantly off.
    wrong.setup.uncertainty = None;
    let free = calibrate(&wrong, None, &ideal_robot(SensorMode::Prior)).unwrap();
    let free = free.findings.unknowns.sensor.unwrap();
    assert!(free.is_off() && !free.stated, "{}", free.wald);
}

/// The sensor file corrected by a scan replaces the scan's own file: the same answer with the same uncertainty.
#[test]
fn a_scan_counts_once_although_its_sensors_file_was_written_from_it() {
    let mut recording = simulate(&random_cell(&Preset::Profiler.scenario(), 3, 0.1), 3).unwrap();
    recording.inputs.insert("robot.csv".to_owned(), "the digest of the robot's file".to_owned());
    let config = ideal_robot(SensorMode::Prior);
    let first = calibrate(&recording, None, &config).unwrap();
    let corrected = first.findings.unknowns.corrected.clone().unwrap();
    let mut again = recording.clone();
    again.setup.shape = corrected.shape;
    again.setup.uncertainty = corrected.uncertainty;
    let second = calibrate(&again, None, &config).unwrap();
    assert_eq!(second.status(), Status::Accepted, "{:?}", second.reasons());
    assert!(second.warnings().contains(&Warning::SensorOfItsOwnScan), "{:?}", second.warnings());
    let moved = second.best_fit().minus(&first.best_fit().guess());
    for k in 0..7 {
        let [before, after] = [&first, &second].map(|c| c.best_fit_covariance()[(k, k)].sqrt());
        // The robust weights follow the shape to second order.
        assert!(moved[k].abs() < 0.02 * before, "{k}: {} of {before}", moved[k]);
        assert!((after / before - 1.0).abs() < 0.02, "{k}: {before} {after}");
    }
    // Another scan of the same sensor uses the file's statement.
    again.inputs.insert("robot.csv".to_owned(), "another".to_owned());
    let other = calibrate(&again, None, &config).unwrap();
    assert!(!other.warnings().contains(&Warning::SensorOfItsOwnScan));
    assert!(other.findings.unknowns.sensor.is_some_and(|sensor| sensor.stated));
    // … and a scan counted twice would gain from it: by the root of two where only the scan determines the sensor.
    let sigma = |c: &Calibration, k: usize| c.best_fit_covariance()[(k, k)].sqrt();
    let ratios = (0..7).map(|k| sigma(&other, k) / sigma(&first, k));
    let least = ratios.fold(1.0, f64::min);
    println!("{least}");
    assert!(least < 0.9, "{least}");
}

/// The effect of a false statement on the residuals is not a lag, a bias or a bad robot.
#[test]
fn a_sensor_that_is_worse_than_its_file_states_is_the_only_thing_to_be_named() {
    for (preset, seed) in [(Preset::Good, 1), (Preset::Quick, 1), (Preset::Quick, 2)] {
        let recording = simulate(&random_cell(&preset.scenario(), seed, 1.0), seed).unwrap();
        let stated = |normal_deg: f64| {
            let mut wrong = with_sensor(&recording, |_, plane| *plane = tilted(plane, 0.5));
            wrong.setup.uncertainty = Some(SensorUncertainty {
                plane_offset_m: Some(0.05e-3),
                plane_normal_rad: Some(normal_deg.to_radians()),
                ..SensorUncertainty::default()
            });
            calibrate(&wrong, None, &Config::default()).unwrap()
        };
        let off = |reason: &Reason| matches!(reason, Reason::SensorOff { beyond_stated: true, .. });
        let contradicted = stated(0.02);
        assert!(contradicted.reasons().iter().all(off), "{:?}", contradicted.reasons());
        assert_eq!(contradicted.status(), Status::NotAccepted);
        assert!(contradicted.warnings().is_empty(), "{:?}", contradicted.warnings());
        // The same tilt, stated as one sigma.
        assert_eq!(stated(0.5).status(), Status::Accepted, "{:?}", stated(0.5).reasons());
    }
}

#[test]
fn a_held_sensor_of_stated_uncertainty_is_in_the_budget() {
    let recording = simulate(&Preset::Quick.scenario(), 7).unwrap();
    let budget = |recording: &Recording| {
        let c = calibrate(recording, None, &ideal_robot(SensorMode::Fixed)).unwrap();
        assert!(c.findings.unknowns.sensor.is_none());
        c.findings.checks.seam_error.unwrap().budget_m
    };
    let alone = budget(&recording);
    assert!(alone.sensor == 0.0 && alone.robot == 0.0 && alone.feature_bias == 0.0);
    let mut stated = recording.clone();
    stated.setup.uncertainty =
        Some(SensorUncertainty { plane_offset_m: Some(0.25e-3), ..SensorUncertainty::default() });
    // Linear in the stated value.
    let (once, mut twice) = (budget(&stated).sensor, stated);
    twice.setup.uncertainty.as_mut().unwrap().plane_offset_m = Some(0.5e-3);
    let ratio = budget(&twice).sensor / once;
    // The least sigma, which keeps a covariance invertible, is some 1e-3 of this one.
    assert!(once > 0.0 && (ratio - 2.0).abs() < 1e-2, "{once} {ratio}");
}

#[test]
fn a_robot_and_a_bias_widen_the_uncertainty_and_move_nothing() {
    let recording = simulate(&Preset::Quick.scenario(), 8).unwrap();
    let with = |robot_accuracy_m: f64, feature_bias_px: f64| {
        let config = Config {
            robot_accuracy_m: Some(robot_accuracy_m),
            feature_bias_px,
            ..ideal_robot(SensorMode::Fixed)
        };
        calibrate(&recording, None, &config).unwrap()
    };
    let (alone, robot, biased) = (with(0.0, 0.0), with(0.3e-3, 0.0), with(0.0, 0.2));
    assert!((0..7).all(|k| alone.sigma(k) == alone.noise_sigma(k)));
    for c in [&robot, &biased] {
        assert_eq!(c.best_fit(), alone.best_fit());
        assert!((0..7).all(|k| c.noise_sigma(k) == alone.noise_sigma(k)));
        assert!((0..7).all(|k| c.sigma(k) > alone.sigma(k)));
    }
    let twice = with(0.6e-3, 0.0);
    let ratio = twice.findings.checks.seam_error.unwrap().budget_m.robot
        / robot.findings.checks.seam_error.unwrap().budget_m.robot;
    assert!((ratio - 2.0).abs() < 1e-9, "{ratio}");
    assert!(biased.findings.checks.seam_error.unwrap().budget_m.feature_bias > 0.0);
}
