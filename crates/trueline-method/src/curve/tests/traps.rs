//! Traps of an unknown curve.

use super::*;

/// If the lever is not observable, a smaller curve is smoother, and the lever follows it. A curve with another length than its
/// readings determines nothing.
#[test]
fn a_curve_that_shrank_shows_nothing() {
    let (recording, _) = scan_curve(&CurveScan::good(CurveKind::Arc), 5);
    let (readings, _) = readings(&recording, false);
    let answer = answered(&readings).unwrap();
    assert!(answer.curve.collapsed_from_m.is_none() && answer.components.iter().all(|seen| *seen));
    let (length_m, course) = (answer.curve.length_m, answer.course);
    let mut finished = answer.finished;
    finished.first_length_m = 2.0 * length_m;
    let known = KnownOfCell::default();
    let search = Search { readings: &readings, within_s: 0.6, guess: None, threads: 1 };
    let asked = Asked { search, errors: Errors::NONE, known: &known };
    let shrunk = asked.concluded(finished, Vec::new(), &course, (false, None));
    assert_eq!(shrunk.curve.collapsed_from_m, Some(2.0 * length_m));
    assert!(shrunk.components.iter().all(|seen| !*seen));
}

/// The prior of a curve is no information on the hand-eye transform. With it a weave with hardly any tilt seems to determine
/// everything, and is wrong.
#[test]
fn the_prior_of_a_curve_gives_no_rank() {
    let woven = CurveScan {
        tilt_rad: 1.0_f64.to_radians(),
        weave_hz: 2.0,
        passes: 1.0,
        ..CurveScan::good(CurveKind::Free)
    };
    let (recording, _) = scan_curve(&woven, 21);
    let (readings, truth) = readings(&recording, false);
    let state = at_truth(&readings, &truth);
    let known = Known::of_any_sensor(&truth);
    // Ten thousand times too stiff: a strong prior.
    let s3_m = loosest_m(state.spline.spacing_m) * 1e-4;
    let weighing = Weighing::Noise { factor: 2.0 };
    let fitted = Terms { readings: &readings, weighing, s3_m, known: &known, steps: 4 }.fit(state).unwrap();
    let parts = Parts::of(&fitted, &known);
    let off = |covariance| squared_sigmas(&truth, &fitted.state.at, covariance).unwrap();
    // The posterior is that of a curve of known form. Seven squared sigmas exceed 30 in one of ten thousand scans.
    let posterior = Seen::of_known_form(&parts, s3_m, 1.0).unwrap();
    assert!(posterior.rank == 7 && off(&posterior.covariance) > 30.0);
    let seen = Seen::of(&fitted, &parts, s3_m, 1.0).unwrap();
    assert!(seen.rank < 5 && off(&seen.covariance) < 30.0, "{}", seen.rank);
}
