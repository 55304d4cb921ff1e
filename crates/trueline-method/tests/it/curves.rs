//! Scans over curves with other statements of a user: a bad guess, held values, a free sensor, options without effect.

use nalgebra::Vector3;
use trueline_dataset::{Guess, Recording};
use trueline_geometry::{se3, so3};
use trueline_lsq::Loss;
use trueline_method::verdict::{Reason, Warning};
use trueline_method::{Config, Error, Hold, SensorMode, Target, calibrate};
use trueline_sim::curves::{CurveKind, CurveScan, scan_curve};

fn scanned(kind: CurveKind) -> (Recording, Guess) {
    let (recording, _) = scan_curve(&CurveScan::good(kind), 3);
    let truth = recording.truth.as_ref().unwrap().parameters;
    (recording, truth)
}

#[test]
fn a_bad_guess_makes_no_curve_of_a_straight_seam() {
    let (recording, _) = scanned(CurveKind::Straight);
    let turn = so3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
    let far =
        Guess { time_offset_s: 2.5, tool_from_camera: se3::from_parts(turn, Vector3::new(0.9, 0.9, -0.9)) };
    let config = Config { threads: 2, ..Config::default() };
    let answer = calibrate(&recording, Some(&far), &config).unwrap();
    assert!(answer.findings.curve.is_none(), "{:?}", answer.reasons());
    assert!(
        answer.reasons().iter().any(|reason| matches!(reason, Reason::WorseMinimum { .. })),
        "{:?}",
        answer.reasons()
    );
}

#[test]
fn an_untried_curve_is_reported() {
    let (recording, truth) = scanned(CurveKind::Pipe);
    let config = Config { hold: vec![Hold::TimeOffset], threads: 2, ..Config::default() };
    let answer = calibrate(&recording, Some(&truth), &config).unwrap();
    assert!(!answer.reasons().is_empty() && answer.findings.curve.is_none());
    let untried = |warning: &Warning| matches!(warning, Warning::CurveUntried { .. });
    assert!(answer.warnings().iter().any(untried), "{:?}", answer.warnings());
    // A straight seam gives none of them.
    let (recording, truth) = scanned(CurveKind::Straight);
    let answer = calibrate(&recording, Some(&truth), &config).unwrap();
    assert!(!answer.warnings().iter().any(untried), "{:?}", answer.warnings());
}

#[test]
fn options_unused_on_a_curve_are_refused_or_reported() {
    let (recording, truth) = scanned(CurveKind::Pipe);
    let base = Config { threads: 2, ..Config::default() };
    let loss = Config { loss: Some(Loss::Huber { scale: 2.0 }), ..base.clone() };
    let forced = Config { target: Target::Curve, ..loss.clone() };
    assert!(matches!(calibrate(&recording, Some(&truth), &forced), Err(Error::NoCurve { .. })));
    let free = Config { target: Target::Curve, sensor: SensorMode::Free, ..base };
    assert!(matches!(calibrate(&recording, Some(&truth), &free), Err(Error::NoCurve { .. })));
    let answer = calibrate(&recording, Some(&truth), &loss).unwrap();
    assert!(answer.findings.curve.is_some(), "{:?}", answer.reasons());
    let named = |warning: &Warning| *warning == Warning::UnusedOnCurve { options: vec!["--loss"] };
    assert!(answer.warnings().iter().any(named), "{:?}", answer.warnings());
}

/// In this scan the first orders of the readings are open, and a curve through them runs away where no reading holds it.
#[test]
fn a_closed_curve_whose_first_order_is_open_does_not_run_away() {
    let (recording, _) = scan_curve(&CurveScan::good(CurveKind::Pipe), 80);
    let truth = recording.truth.as_ref().unwrap().parameters;
    let config = Config { robot_accuracy_m: Some(0.0), threads: 2, ..Config::default() };
    let answer = calibrate(&recording, None, &config).unwrap();
    let curve = answer.findings.curve.as_ref().unwrap();
    // A circle of 50 mm radius. Errors of 0.1 mm in the radius are 0.2 %.
    assert!(
        curve.closed && (curve.length_m / (0.1 * std::f64::consts::PI) - 1.0).abs() < 2e-3,
        "{}",
        curve.length_m
    );
    let off = answer.best_fit().time_offset_s - truth.time_offset_s;
    assert!(off.abs() < 4.0 * answer.sigma(0).unwrap(), "{off}");
}
