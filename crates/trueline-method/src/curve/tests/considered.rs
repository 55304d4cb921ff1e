//! Considered errors beside a curve, and a removed drift.

use super::*;
use crate::assess::share::ShareOf;
use crate::config::PartMoves;
use crate::curve::considered::{EdgeError, ShapeError};
use crate::curve::moved::Moves;
use nalgebra::{SMatrix, SVector};
use trueline_model::SheetShape;

/// The answer to a scan from near its truth, with some errors.
fn answered_with(readings: &Readings, truth: &Guess, errors: Errors<'_>) -> Answered {
    Asked { search: near(readings, truth), errors, known: &KnownOfCell::default() }.answer().unwrap()
}

fn near<'a>(readings: &'a Readings, truth: &'a Guess) -> Search<'a> {
    Search { readings, within_s: 0.2, guess: Some(truth), threads: 2 }
}

fn columns(answer: &Answered, of: ShareOf) -> nalgebra::DMatrix<f64> {
    answer.shares.iter().find(|share| share.of == of).unwrap().columns.clone()
}

/// A sensor with an error of its shape moves the answer as predicted by its column.
#[test]
fn a_sensor_that_is_off_moves_the_answer_as_its_column_says() {
    let (recording, _) = scan_curve(&CurveScan::good(CurveKind::Free).exact(), 3);
    let (readings, truth) = readings(&recording, true);
    let places = || readings.list.iter().map(|reading| reading.in_sheet);
    let origin_m = places().sum::<Vector2<f64>>() / readings.list.len() as f64;
    let sigmas = SVector::<f64, 5>::from([1e-3, 1e-3, 1e-3, 0.03, 0.03]);
    let covariance = nalgebra::Matrix5::from_diagonal(&sigmas.map(|s| s * s));
    let shape = Some(ShapeError { covariance, origin_m, is_estimated: false });
    let exact = answered_with(&readings, &truth, Errors { shape, ..Errors::NONE });
    let expected = columns(&exact, ShareOf::Sensor);
    let moved_by = |answer: &Answered| step_between(&exact.at(), &answer.at());
    for error in [1, 2] {
        // The used value is 1 σ above the true one.
        let mut step = SVector::<f64, 5>::zeros();
        step[error] = -sigmas[error];
        let true_shape = SheetShape::exact_about(&origin_m).retract(&step);
        let mut spoilt = readings.clone();
        for reading in &mut spoilt.list {
            reading.in_sheet = true_shape.reported(&reading.in_sheet).reported;
            reading.point = Vector3::new(reading.in_sheet.x, 0.0, reading.in_sheet.y);
        }
        let moved = moved_by(&answered_with(&spoilt, &truth, Errors::NONE));
        let expected = expected.column(error);
        // The curve of the spoilt readings takes up a part of it that the columns leave to clock and hand-eye: up to 81 % of each kind here. The other sign would
        // be 200 %.
        for (from, count) in [(0, 1), (1, 3), (4, 3)] {
            let of =
                |v: &dyn Fn(usize) -> f64| (from..from + count).map(|k| v(k).powi(2)).sum::<f64>().sqrt();
            let (size, off) = (of(&|k| expected[k]), of(&|k| moved[k] - expected[k]));
            let least = [2e-5, 1e-5, 5e-6][usize::from(from > 0) + usize::from(from > 3)];
            assert!(off < size + least, "{error} {from}: {moved} {expected}");
        }
    }
}

/// A shape error of one standard deviation is found from readings without noise, and the answer equals that of an exact sensor.
#[test]
fn a_shape_that_the_scan_shows_is_taken_out() {
    let (recording, _) = scan_curve(&CurveScan::good(CurveKind::Pipe), 3);
    let (readings, truth) = readings(&recording, false);
    let places = || readings.list.iter().map(|reading| reading.in_sheet);
    let origin_m = places().sum::<Vector2<f64>>() / readings.list.len() as f64;
    let sigmas = SVector::<f64, 5>::from([5e-3, 5e-3, 5e-3, 0.15, 0.15]);
    let covariance = nalgebra::Matrix5::from_diagonal(&sigmas.map(|s| s * s));
    let held = ShapeError { covariance, origin_m, is_estimated: false };
    let estimated = ShapeError { is_estimated: true, ..held };
    let mut spoilt = readings.clone();
    let step = SVector::<f64, 5>::from([5e-3, -5e-3, 4e-3, 0.1, -0.1]);
    let true_shape = SheetShape::exact_about(&origin_m).retract(&step);
    for reading in &mut spoilt.list {
        reading.in_sheet = true_shape.reported(&reading.in_sheet).reported;
        reading.point = Vector3::new(reading.in_sheet.x, 0.0, reading.in_sheet.y);
    }
    let with = |shape| answered_with(&spoilt, &truth, Errors { shape: Some(shape), ..Errors::NONE });
    let (held, found) = (with(held), with(estimated));
    let shape = found.shape.unwrap();
    assert!(held.shape.is_none());
    let squares = |columns: &nalgebra::DMatrix<f64>| columns.norm_squared();
    let share = found.shares.iter().find(|share| share.of == ShareOf::Sensor).unwrap();
    // The error is within 4 of its standard deviations, which are smaller than the prior ones.
    let sigma = share.shape.as_ref().unwrap();
    for k in 0..5 {
        let own = sigma.row(k).norm();
        assert!(own < sigmas[k], "{k}: {own}");
        assert!((shape.h[k] - step[k]).abs() < 4.0 * own, "{k}: {} {own}", shape.h[k]);
    }
    assert!(squares(&share.columns) < 0.5 * squares(&columns(&held, ShareOf::Sensor)));
    assert!(found.finished.factor < held.finished.factor);
}

/// A sensor that is nearer by the radius sees the same, but only along its range.
#[test]
fn the_radius_of_an_edge_is_a_shift_along_the_range() {
    let (recording, _) = scan_curve(&CurveScan::good(CurveKind::Free), 3);
    let (readings, truth) = readings(&recording, false);
    let edge = EdgeError { radius_m: 0.3e-3, from_origin: false };
    let answer = answered_with(&readings, &truth, Errors { edge, ..Errors::NONE });
    let moved = columns(&answer, ShareOf::EdgeRadius);
    let along = answer.at().tool_from_camera.rotation * Vector3::z();
    let shift = Vector3::new(moved[(4, 0)], moved[(5, 0)], moved[(6, 0)]);
    // Square to the seam it is longer by 1/cos of the tilt, of 18° at most, less than 5 %; the turns that go with that move it by a part of it.
    assert!((shift.dot(&along).abs() - 0.3e-3).abs() < 0.06e-3, "{moved}");
    let none = answered_with(&readings, &truth, Errors::NONE);
    assert!(none.shares.iter().all(|share| share.of != ShareOf::EdgeRadius));
    assert_eq!(Moves::default().columns(&none.finished.fitted, &none.finished.root).ncols(), 0);
}

/// A fast clock is detected. Without its drift the answer equals that of a steady clock.
#[test]
fn a_drift_of_the_clock_is_taken_out() {
    let (recording, _) = scan_curve(&CurveScan::good(CurveKind::Free), 3);
    let (mut readings, truth) = readings(&recording, false);
    let known = KnownOfCell::default();
    let still = Asked { search: near(&readings, &truth), errors: Errors::NONE, known: &known };
    let free = still.without_drift(still.answer().unwrap(), 0.0);
    assert!(free.drifted.is_none() && free.readings.is_none());
    let own = free.drift.unwrap();
    assert!(own.ppm.abs() < 4.0 * own.sigma_ppm, "{own:?}");
    let middle_s = own.about_s;
    for reading in &mut readings.list {
        reading.stamp_s += 1e-3 * (reading.stamp_s - middle_s);
    }
    let drifting = Asked { search: near(&readings, &truth), errors: Errors::NONE, known: &known };
    let free = drifting.without_drift(drifting.answer().unwrap(), 0.0);
    let drift = free.drifted.unwrap();
    assert!((drift.ppm - 1000.0).abs() < 4.0 * drift.sigma_ppm && drift.sigma_ppm < 100.0, "{drift:?}");
    // Where the offset is reported, the stamps are off by the drift since the middle.
    let expected_s = truth.time_offset_s + 1e-3 * (drift.about_s - middle_s);
    let off_s = (free.answer.at().time_offset_s - expected_s).abs();
    assert!(off_s < 4.0 * free.answer.noise[(0, 0)].sqrt(), "{off_s}");
    assert!(free.readings.is_some());
}

/// A part that a fixture puts elsewhere in each pass: with its six numbers for each pass the answer is within its ±. Without them it is not, and
/// the move is reported.
#[test]
fn a_part_that_moves_between_passes_is_taken_out() {
    let moves = PartMoves { shift_m: 0.3e-3, turn_rad: 0.1_f64.to_radians() };
    let part_moves = [moves.shift_m, moves.turn_rad];
    for kind in [CurveKind::Free, CurveKind::Pipe] {
        let (mut with, mut without) = (0.0, 0.0);
        const SCANS: u64 = 4;
        for seed in 3..3 + SCANS {
            let (recording, _) = scan_curve(&CurveScan { part_moves, ..CurveScan::good(kind) }, seed);
            let (readings, truth) = readings(&recording, false);
            let off = |part: Option<PartMoves>| {
                let answer = answered_with(&readings, &truth, Errors { part, ..Errors::NONE });
                // Of two moves of 0.3 mm along three axes the larger is beyond 2 mm in one of ten million.
                let moved_m = answer.curve.part_moved_m;
                let is_told = moved_m.is_some_and(|shift_m| (0.05e-3..2e-3).contains(&shift_m));
                assert_eq!(is_told, part.is_none(), "{}-{seed}: {moved_m:?}", kind.name());
                let shares = answer.shares.iter().map(|share| &share.columns * share.columns.transpose());
                let more = shares.fold(nalgebra::DMatrix::zeros(7, 7), |sum, share| sum + share);
                let covariance = answer.noise + SMatrix::<f64, 7, 7>::from_fn(|i, j| more[(i, j)]);
                squared_sigmas(&truth, &answer.at(), &covariance).unwrap() / (7 * SCANS) as f64
            };
            with += off(Some(moves));
            without += off(None);
        }
        // χ²₂₈/28 exceeds 2.2 in one of ten thousand.
        assert!(with < 2.2 && without > 10.0, "{}: {with} {without}", kind.name());
    }
}

/// Outliers of a part at rest are no move. A pass that is partly left out still shows its move.
#[test]
fn a_part_at_rest_is_not_said_to_have_moved() {
    for (kind, outliers, shift_m) in [
        (CurveKind::Free, 0.02, 0.0),
        (CurveKind::Pipe, 0.02, 0.0),
        (CurveKind::Free, 0.25, 0.0),
        (CurveKind::Pipe, 0.25, 0.0),
        (CurveKind::Free, 0.02, 0.5e-3),
    ] {
        let scan = CurveScan { outliers, part_moves: [shift_m, 0.0], ..CurveScan::good(kind) };
        let (readings, truth) = readings(&scan_curve(&scan, 5).0, false);
        let moved_m = answered_with(&readings, &truth, Errors::NONE).curve.part_moved_m;
        assert_eq!(moved_m.is_some(), shift_m > 0.0, "{} {outliers} {shift_m}: {moved_m:?}", kind.name());
    }
}
