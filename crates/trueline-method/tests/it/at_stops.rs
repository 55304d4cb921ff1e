//! Tests a robot that stands at each reading: the time offset is no unknown, and the hand-eye transform agrees with its uncertainty.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use std::path::{Path, PathBuf};
use trueline_dataset::sensor_setup::SensorSetup;
use trueline_dataset::{Feature, Guess, Measured, Recording, RobotSample, Sensor, calibration_file, folder};
use trueline_geometry::{Pose, se3, so3};
use trueline_method::input::stops::{Stops, stand_at_readings};
use trueline_method::{Calibration, Config, Error, Hold, Reason, SensorMode, Status, calibrate};
use trueline_sim::SlowErrors;
use trueline_sim::noise::Noise;

const SIGMA_M: f64 = 0.03e-3;

fn euler_zyx(deg: [f64; 3]) -> UnitQuaternion<f64> {
    let [z, y, x] = deg.map(f64::to_radians);
    so3::exp(&(Vector3::z() * z)) * so3::exp(&(Vector3::y() * y)) * so3::exp(&(Vector3::x() * x))
}

fn tool_from_camera() -> Pose {
    se3::from_parts(euler_zyx([130.0, -2.0, -175.0]), Vector3::new(0.077, -0.010, 0.266))
}

/// A profiler in front of an edge at this many stops, tilted by up to `tilt_deg`. Poses are logged at 50 Hz while the robot
/// stands, and once a stop it reads a seam point.
fn stops(count: usize, tilt_deg: f64, seed: u64) -> Recording {
    let (mut noise, direction) = (Noise::new(seed, 1), Vector3::new(0.94, -0.34, 0.02).normalize());
    let mut within = |most: f64| noise.uniform(-most, most);
    let (mut robot, mut features) = (Vec::new(), Vec::new());
    for k in 0..count {
        let attitude = euler_zyx([-138.0 + within(20.0), within(tilt_deg), -178.0 + within(tilt_deg)]);
        let seen = Vector3::new(within(0.030), 0.0, within(0.020));
        let seam = Vector3::new(0.100, 0.030, 0.0) + direction * within(0.040);
        let place = seam - attitude * (tool_from_camera() * nalgebra::Point3::from(seen)).coords;
        let base_from_tool = se3::from_parts(attitude, place);
        let stamp_ns = (k as i64 + 1) * 1_000_000_000;
        robot.extend((-25..25).map(|step| RobotSample {
            stamp_ns: stamp_ns + step * 20_000_000,
            device_ns: None,
            base_from_tool,
        }));
        features.push((stamp_ns, seen));
    }
    let mut normal = |sigma: f64| noise.normal(sigma);
    let features = features.into_iter().map(|(stamp_ns, seen)| Feature {
        stamp_ns,
        line: 0,
        frame: None,
        device_ns: None,
        measured: Measured::Profile([seen.x + normal(SIGMA_M), seen.z + normal(SIGMA_M)]),
        sigma: Some([SIGMA_M; 2]),
        correlation: 0.0,
    });
    Recording::new(Sensor::Profiler, SensorSetup::default(), robot, features.collect())
}

fn guess() -> Guess {
    let near = Vector3::new(0.070, -0.005, 0.260);
    Guess { time_offset_s: 0.0, tool_from_camera: se3::from_parts(tool_from_camera().rotation, near) }
}

fn stated() -> Config {
    Config { at_stops: true, ..Config::default() }
}

fn error(found: &Calibration) -> Vector6<f64> {
    let (turn, shift) = se3::difference_decoupled(&found.best_fit().tool_from_camera, &tool_from_camera());
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

/// No time offset, and no number larger than any measured quantity.
fn assert_says_nothing_of_time(found: &Calibration, what: &str) {
    assert!(found.time_offset().is_err() && found.sigma(0).is_none(), "{what}");
    let error_m = found.findings.checks.seam_error.map(|error| error.rms_m);
    assert!(error_m.is_none_or(|error_m| error_m < 0.1), "{what}: {error_m:?}");
    for k in 1..7 {
        assert!(found.sigma(k).is_none_or(|sigma| sigma < 0.1), "{what}: component {k}");
    }
}

#[test]
fn stops_give_the_hand_eye_transform_with_a_guess_and_without() {
    let recording = stops(40, 20.0, 2);
    for guess in [Some(guess()), None] {
        let found = calibrate(&recording, guess.as_ref(), &stated()).unwrap();
        assert_eq!(found.status(), Status::Accepted, "{:?}", found.reasons());
        assert_eq!(found.findings.stops, Some(Stops::Stated));
        assert_says_nothing_of_time(&found, "40 stops");
        let HandEyeSigmas(sigmas) = HandEyeSigmas::of(&found);
        // Six numbers beyond four standard deviations are one run in 2,600.
        for (k, (error, sigma)) in error(&found).iter().zip(sigmas.iter()).enumerate() {
            assert!(error.abs() < 4.0 * sigma, "component {k}: {error} ± {sigma}");
        }
    }
}

struct HandEyeSigmas(Vector6<f64>);

impl HandEyeSigmas {
    fn of(found: &Calibration) -> Self {
        Self(Vector6::from_fn(|k, _| found.sigma(k + 1).unwrap()))
    }
}

#[test]
fn the_stated_covariance_is_that_of_many_cells() {
    // NEES of six numbers. Its mean over n cells has a standard deviation of √(12/n), about the 6 of a true covariance. 40 cells: 0.55.
    let config = Config { robot_accuracy_m: Some(0.0), ..Config { at_stops: true, ..Config::noise_only() } };
    let cells = 40;
    let mut sum = 0.0;
    for seed in 0..cells {
        let tilt_deg = [10.0, 15.0, 20.0, 25.0][seed as usize % 4];
        let found = calibrate(&stops(40, tilt_deg, 100 + seed), Some(&guess()), &config).unwrap();
        let covariance = found.tool_from_camera().unwrap().covariance;
        let error = error(&found);
        sum += error.dot(&covariance.cholesky().unwrap().solve(&error));
    }
    let mean = sum / cells as f64;
    // Four of its standard deviations, and 10 % that the residuals' own scale adds on one side.
    assert!((6.0 - 4.0 * 0.55..6.0 * 1.1 + 4.0 * 0.55).contains(&mean), "{mean}");
}

/// Per axis of position, m, and of attitude, rad, of a robot of 0.3 mm.
const OF_ROBOT: [f64; 2] = [0.05e-3, 0.05e-3 / 1.5];

/// A robot that errs anew at each stop.
fn restless(recording: &Recording, seed: u64) -> Recording {
    let mut off = recording.clone();
    let mut noise = Noise::new(seed, 2);
    let [shift_m, turn_rad] = OF_ROBOT;
    // 50 poses are logged at each stop.
    for stop in off.robot.chunks_mut(50) {
        let mut three = |sigma: f64| Vector3::from_fn(|_, _| noise.normal(sigma));
        let (turn, shift) = (three(turn_rad), three(shift_m));
        for sample in stop {
            sample.base_from_tool = se3::retract_decoupled(&sample.base_from_tool, &turn, &shift);
        }
    }
    off
}

/// A robot whose errors change slowly over its workspace.
fn slow(recording: &Recording, seed: u64) -> Recording {
    let mut off = recording.clone();
    let [shift, turn] = OF_ROBOT;
    let middle = recording.robot[0].base_from_tool;
    SlowErrors::drawn(&mut Noise::new(seed, 3), middle, shift, turn).add_to(&mut off.robot);
    off
}

/// A stated accuracy covers all errors of the robot. What the residuals show of them must not count once more as an error of the workspace.
#[test]
fn the_errors_of_a_robot_count_once() {
    let config = Config {
        robot_accuracy_m: Some(0.3e-3),
        feature_bias_px: 0.0,
        edge_radius_m: Some(0.0),
        waviness_m: Some(0.0),
        sensor: SensorMode::Fixed,
        ..stated()
    };
    type Errs = fn(&Recording, u64) -> Recording;
    let robots: [(&str, Errs); 2] = [("restless", restless), ("slow", slow)];
    for (name, errs) in robots {
        let cells = 60;
        let mut sum = 0.0;
        for seed in 0..cells {
            let recording = errs(&stops(40, [15.0, 20.0, 25.0][seed as usize % 3], 300 + seed), seed);
            let found = calibrate(&recording, Some(&guess()), &config).unwrap();
            let covariance = found.tool_from_camera().unwrap().covariance;
            let error = error(&found);
            sum += error.dot(&covariance.cholesky().unwrap().solve(&error)) / 6.0;
        }
        let mean = sum / cells as f64;
        eprintln!("{name}: {mean}");
        // √(2 / 6 / 60) is 0.075: three of these, and a tenth for the estimated size of the noise.
        assert!((0.75..1.35).contains(&mean), "{name}: {mean}");
    }
}

#[test]
fn a_robot_that_stands_is_recognised_and_its_time_offset_is_no_number() {
    let recording = stops(30, 20.0, 3);
    assert!(stand_at_readings(&recording));
    let found = calibrate(&recording, None, &Config::default()).unwrap();
    let reason = Reason::AtStops { stops: 30 };
    assert_eq!((found.status(), found.reasons()), (Status::NotAccepted, &[reason.clone()][..]));
    assert!(reason.to_string().contains("--at-stops") && reason.code() == "unobservable");
    assert_says_nothing_of_time(&found, "unstated");
    // Holding the offset states that there is none to estimate.
    let held = Config { hold: vec![Hold::TimeOffset], ..Config::default() };
    let found = calibrate(&recording, Some(&guess()), &held).unwrap();
    assert_eq!(found.status(), Status::Accepted, "{:?}", found.reasons());
    assert_says_nothing_of_time(&found, "held");
}

#[test]
fn stamps_only_pair_readings_and_poses() {
    let recording = stops(40, 20.0, 5);
    let translation = |recording: &Recording| {
        let found = calibrate(recording, Some(&guess()), &stated()).unwrap();
        found.best_fit().tool_from_camera.translation.vector
    };
    let as_stamped = translation(&recording);
    // Images that are 0.1 s late, and one pose for each stop.
    let mut late = recording.clone();
    late.features.iter_mut().for_each(|feature| feature.stamp_ns += 100_000_000);
    let mut once = recording.clone();
    once.robot.retain(|sample| sample.stamp_ns % 1_000_000_000 == 0);
    for other in [late, once] {
        assert!((translation(&other) - as_stamped).norm() < 1e-9);
    }
}

#[test]
fn readings_without_a_stop_are_refused() {
    let mut moving = stops(20, 20.0, 7);
    for sample in &mut moving.robot[250..300] {
        sample.base_from_tool.translation.vector.x += 1e-9 * (sample.stamp_ns % 1_000_000_000) as f64 * 0.01;
    }
    let error = calibrate(&moving, Some(&guess()), &stated()).unwrap_err();
    assert!(matches!(error, Error::MovesAtStop { stamp_s, .. } if stamp_s == 6.0), "{error}");
    let mut lost = stops(20, 20.0, 7);
    lost.robot.retain(|sample| (sample.stamp_ns - 6_000_000_000).abs() > 600_000_000);
    let error = calibrate(&lost, Some(&guess()), &stated()).unwrap_err();
    assert!(matches!(error, Error::NoPoseAtStop { stamp_s } if stamp_s == 6.0), "{error}");
    let mut still = stops(20, 20.0, 7);
    let first = still.robot[0].base_from_tool;
    still.robot.iter_mut().for_each(|sample| sample.base_from_tool = first);
    let error = calibrate(&still, Some(&guess()), &stated()).unwrap_err();
    assert!(matches!(error, Error::RobotStandsStill { .. }), "{error}");
}

/// A long tool at few stops: translation and attitude must be found together.
#[test]
fn sixteen_stops_need_no_guess() {
    const SCANS: u64 = 12;
    let mut found_by_nothing = 0;
    for seed in 0..SCANS {
        let found = calibrate(&stops(16, 20.0, 300 + seed), None, &stated()).unwrap();
        let covariance = found.best_fit_covariance().view((1, 1), (6, 6)).into_owned();
        let off = error(&found);
        let squared = off.dot(&(covariance.cholesky().unwrap().solve(&off)));
        if found.status() == Status::Accepted {
            found_by_nothing += 1;
            // χ²₆ exceeds 30 once in 26,000.
            assert!(squared < 30.0, "seed {seed}: {squared}");
        }
    }
    // Two of twelve may be too weak to separate two attitudes. With starts without a translation half would fail.
    assert!(found_by_nothing + 2 >= SCANS, "{found_by_nothing}");
}

fn shared(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/cases").join(name);
    if !folder.exists() {
        eprintln!("SKIPPED: stops_data: there is no {}", folder.display());
        return None;
    }
    Some(folder)
}

#[test]
fn a_real_profiler_before_a_part_at_eleven_stops_is_where_an_own_fit_has_it() {
    let Some(folder) = shared("standing-profiles") else { return };
    let recording = folder::read(&folder).unwrap();
    let guess = calibration_file::read_guess(&folder.join("guess.toml")).unwrap();
    let found = calibrate(&recording, Some(&guess), &stated()).unwrap();
    assert_eq!(found.status(), Status::Accepted, "{:?}", found.reasons());
    assert_says_nothing_of_time(&found, "standing-profiles");
    let at = found.file_tool_from_camera().translation.vector * 1e3;
    for (k, own) in [77.0, -10.4, 266.2].into_iter().enumerate() {
        let sigma = found.sigma(4 + k).unwrap() * 1e3;
        // Its uncertainties are 2.1, 1.6 and 1.2 mm, nine tenths of them from a robot error of 0.3 mm.
        assert!((at[k] - own).abs() < 2.0 * sigma && sigma < 3.0, "axis {k}: {} ± {sigma}", at[k]);
    }
    // Without a guess eleven stops lead to another minimum, which is detected as a bad fit.
    let lost = calibrate(&recording, None, &stated()).unwrap();
    assert_eq!(lost.status(), Status::NotAccepted, "{:?}", lost.best_fit());
    // One stop has readings that match no place of the part. No unobservable number is reported.
    let recording = folder::read(&folder.join("with-stop-9")).unwrap();
    let found = calibrate(&recording, None, &Config::default()).unwrap();
    assert_eq!(found.status(), Status::NotAccepted);
    assert!(found.time_offset().is_err() && found.sigma(0).is_none());
}

#[test]
fn a_profiler_before_an_edge_is_where_it_was_made_to_be() {
    let Some(folder) = shared("standing-stops/scan") else { return };
    let recording = folder::read(&folder).unwrap();
    let found = calibrate(&recording, None, &stated()).unwrap();
    assert_eq!(found.status(), Status::Accepted, "{:?}", found.reasons());
    assert_says_nothing_of_time(&found, "standing-stops");
    let at = found.best_fit().tool_from_camera.translation.vector * 1e3;
    for (k, made) in [77.0, -10.0, 266.0].into_iter().enumerate() {
        let sigma = found.sigma(4 + k).unwrap() * 1e3;
        assert!((at[k] - made).abs() < 4.0 * sigma && sigma < 0.5, "axis {k}: {} ± {sigma}", at[k]);
    }
}
