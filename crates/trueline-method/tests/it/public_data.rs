//! Tests the authors' public simulation (RoboticsPolyu/LVS_ST_CALIB, data/calib), if available.
//!
//! It has no licence and is not part of this repository: without it these tests say so and pass. It is looked for in
//! the folder named by `TRUELINE_LVS_ST_CALIB`, else beside the repository.

use nalgebra::{UnitVector3, Vector3};
use std::io::Write as _;
use std::path::PathBuf;
use trueline_dataset::{Guess, Recording, import::lvs_st_calib};
use trueline_geometry::{Line, se3, so3};
use trueline_method::{Calibration, Config, Reason, ResidualKind, Status, calibrate};

fn recording() -> Option<Recording> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/lvs_st_calib");
    let folder =
        std::env::var_os("TRUELINE_LVS_ST_CALIB").map_or_else(|| PathBuf::from(beside), PathBuf::from);
    if !folder.join("egm.txt").exists() {
        let mut stderr = std::io::stderr();
        writeln!(stderr, "SKIPPED: public_data: not in {}", folder.display()).unwrap();
        return None;
    }
    Some(lvs_st_calib::read_simulation(&folder).unwrap())
}

/// RMS distance that an independent joint solve over all frames reached with the stamps as recorded, m.
const RAW_RMS_M: f64 = 0.0389e-3;
/// The same with dejittered stamps, m.
const REGULAR_RMS_M: f64 = 0.0283e-3;

/// Their lines are straight and sharp.
fn straight() -> Config {
    Config { edge_radius_m: Some(0.0), waviness_m: Some(0.0), ..Config::default() }
}

/// The authors' truth, with tolerances from the independent solve.
fn assert_optimum(calibration: &Calibration, rms_m: f64, offset_tolerance_s: f64) {
    assert_eq!(calibration.status(), Status::Accepted, "{:?}", calibration.reasons());
    let estimate = calibration.best_fit();
    let truth = se3::from_parts(so3::exp(&Vector3::zeros()), Vector3::new(0.010, 0.020, 0.030));
    let (turn, shift) = se3::difference_decoupled(&estimate.tool_from_camera, &truth);
    assert!((estimate.time_offset_s - 0.012).abs() < offset_tolerance_s, "{}", estimate.time_offset_s);
    assert!(turn.norm() < 0.09_f64.to_radians(), "{turn}");
    assert!(shift.norm() < 0.20e-3, "{shift}");
    assert!(
        (calibration.findings.fit.residuals.rms_m - rms_m).abs() < 0.0001e-3,
        "{}",
        calibration.findings.fit.residuals.rms_m
    );
    for (line, side) in estimate.lines.iter().zip([1.0, -1.0]) {
        let from = Vector3::new(2.100, 0.005 * side, 0.900);
        let along = Vector3::new(2.500, 0.020 * side, 0.910) - from;
        let truth = Line::new(from, &UnitVector3::new_normalize(along));
        assert!(truth.distance(line.anchor()) < 0.03e-3, "{}", truth.distance(line.anchor()));
    }
}

#[test]
fn without_a_guess() {
    let Some(recording) = recording() else { return };
    let calibration = calibrate(&recording, None, &straight()).unwrap();
    assert_optimum(&calibration, REGULAR_RMS_M, 0.015e-3);
    assert!(calibration.findings.streams.robot.dejittered && calibration.findings.streams.images.dejittered);
}

#[test]
fn with_stamps_as_recorded() {
    let Some(recording) = recording() else { return };
    let config = Config { stamps: trueline_method::Stamps::Raw, ..straight() };
    assert_optimum(&calibrate(&recording, None, &config).unwrap(), RAW_RMS_M, 0.03e-3);
}

/// A repeating path: with the wrong offset 87 % of the features fit equally well.
#[test]
fn a_guess_in_the_wrong_alias_is_not_accepted() {
    let Some(recording) = recording() else { return };
    let tool_from_camera = se3::from_parts(so3::exp(&Vector3::zeros()), Vector3::new(0.010, 0.020, 0.030));
    let guess = Guess { time_offset_s: 1.345, tool_from_camera };
    let calibration = calibrate(&recording, Some(&guess), &straight()).unwrap();
    assert_eq!(calibration.status(), Status::NotAccepted);
    // Either check may find the better answer first, but it must be the true 12 ms.
    let better_s = calibration.reasons().iter().find_map(|reason| match reason {
        Reason::WrongTimeOffset { better_time_offset_s, .. }
        | Reason::WorseMinimum { better_time_offset_s } => Some(*better_time_offset_s),
        _ => None,
    });
    assert!(better_s.is_some_and(|s| (s - 0.012).abs() < 0.1e-3), "{:?}", calibration.reasons());
}

#[test]
fn from_the_papers_kind_of_start() {
    let Some(recording) = recording() else { return };
    let shift = Vector3::new(2.0, -2.5, 2.0) * 1e-3;
    let turn = Vector3::new(1.0, 1.0, 1.0).normalize() * 1.7_f64.to_radians();
    let start = se3::from_parts(so3::exp(&turn), Vector3::new(0.010, 0.020, 0.030) + shift);
    let guess = Guess { time_offset_s: 0.0, tool_from_camera: start };
    let calibration = calibrate(&recording, Some(&guess), &straight()).unwrap();
    assert_optimum(&calibration, REGULAR_RMS_M, 0.015e-3);
    // With an estimated detector bias everything is fitted again a few times; the steps are those of the fit alone.
    let without_bias = Config { feature_bias_px: 0.0, ..straight() };
    let calibration = calibrate(&recording, Some(&guess), &without_bias).unwrap();
    assert!(calibration.findings.fit.iterations.len() <= 15, "{}", calibration.findings.fit.iterations.len());
}

#[test]
fn with_the_papers_residual() {
    let Some(recording) = recording() else { return };
    let config = Config { residual: ResidualKind::PointToLine, ..Config::default() };
    let calibration = calibrate(&recording, None, &config).unwrap();
    assert_optimum(&calibration, RAW_RMS_M, 0.03e-3);
    // A plain joint solve of the same residual ends 0.011 ms above the truth.
    let error_ms = (calibration.best_fit().time_offset_s - 0.012) * 1e3;
    assert!((error_ms - 0.011).abs() < 0.001, "{error_ms}");
}
