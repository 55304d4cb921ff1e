//! Traps of an unknown curve, each with and without its cure.

use super::*;
use nalgebra::SymmetricEigen;

/// Directions that an information shows better than 5 ms, 1° and 5 mm.
fn rank(information: &SMatrix<f64, 7, 7>) -> usize {
    let unit = |k: usize| [5e-3, std::f64::consts::PI / 180.0, 5e-3][usize::from(k > 0) + usize::from(k > 3)];
    let scaled = SMatrix::<f64, 7, 7>::from_fn(|i, j| information[(i, j)] * unit(i) * unit(j));
    SymmetricEigen::new(scaled).eigenvalues.iter().filter(|value| **value >= 1.0).count()
}

/// The prior of a curve is no source of rank: read from the posterior the scan shows more than it does.
#[test]
fn the_prior_of_a_curve_gives_no_rank() {
    let flat = CurveScan { tilt_rad: 0.0, ..CurveScan::good(CurveKind::Wavy) };
    let (recording, _) = scan_curve(&flat, 21);
    let (readings, truth) = readings(&recording, false);
    let state = at_truth(&readings, &truth);
    let (known, s3_m) = (Known::of_any_sensor(&truth), loosest_m(state.spline.spacing_m) * 1e-4);
    let weighing = Weighing::Noise { factor: 2.0 };
    let fitted = Terms { readings: &readings, weighing, s3_m, known: &known, steps: 4 }.fit(state).unwrap();
    let parts = Parts::of(&fitted, &known);
    let posterior = parts.with(s3_m).root().unwrap().shared_information();
    let seen = Seen::of(&fitted, &parts, s3_m, 1.0).unwrap();
    assert!(rank(&posterior) > seen.rank, "{} {}", rank(&posterior), seen.rank);
}

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
