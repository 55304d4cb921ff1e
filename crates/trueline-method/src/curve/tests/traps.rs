//! Traps of an unknown curve.

use super::*;

/// Where the lever is not seen a smaller curve is smoother, and the lever follows it: a curve of another length than that of the readings
/// shows nothing.
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
    let asked = Asked { search, robot: RobotSigmas::default(), known: &known };
    let shrunk = asked.concluded(finished, Vec::new(), &course, (false, None));
    assert_eq!(shrunk.curve.collapsed_from_m, Some(2.0 * length_m));
    assert!(shrunk.components.iter().all(|seen| !*seen));
}
