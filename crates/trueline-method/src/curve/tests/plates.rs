//! Readings with the plates beside a seam.

use super::*;
use crate::curve::plates::{Direction, Plates};
use crate::curve::readings::SupportPoint;
use crate::curve::rows::ROWS;
use crate::curve::sight::{HandEye, moving};

/// Plates that twist along a seam, one towards its first normal and one beside it, rad.
fn twisting(state: &State) -> Plates {
    let direction = |u_m: &f64| {
        let basis = state.spline.basis(*u_m);
        let tangent = state.spline.at(&basis).1.normalize();
        let up = (Vector3::z() - tangent * tangent.z).normalize();
        let aside = tangent.cross(&up);
        let angle = 0.2 * (30.0 * u_m).sin();
        let along = [0.0, 1.5].map(|from| up * (angle + from).cos() + aside * (angle + from).sin());
        Direction { u_m: *u_m, along }
    };
    let directions: Vec<Direction> = state.u_m.iter().map(direction).collect();
    Plates::through(&state.spline, &directions, 12).unwrap()
}

/// A support point on a plate at a place of the seam, in the camera frame of a reading.
fn support(readings: &Readings, reading: &Reading, state: &State, at: (f64, f64, usize)) -> SupportPoint {
    let ((u_m, reach_m, plate), spline) = (at, &state.spline);
    let basis = spline.basis(u_m);
    let ((point, slope), second) = (spline.at(&basis), spline.second(&basis, u_m));
    let across = state.plates.as_ref().unwrap().across((spline, &basis), u_m, (&slope, &second), plate);
    let in_base = point + across.outward * reach_m;
    let moving = moving(readings, reading, &state.at).unwrap();
    let hand_eye = HandEye::of(&state.at);
    let in_tool = moving.attitude.tr_mul(&(in_base - moving.position));
    let point = hand_eye.rotation.tr_mul(&(in_tool - hand_eye.translation));
    SupportPoint { point, in_sheet: point.xz(), variance: 1e-10 }
}

fn with_supports(kind: CurveKind) -> (Readings, State) {
    let (recording, _) = scan_curve(&CurveScan::good(kind).exact(), 3);
    let (mut readings, truth) = readings(&recording, true);
    let mut state = at_truth(&readings, &truth);
    state.plates = Some(twisting(&state));
    for k in 0..readings.list.len() {
        let (reading, u_m) = (readings.list[k], state.u_m[k]);
        let places = [(-3e-3, 4e-3, 0), (-6e-3, 13e-3, 0), (2e-3, 3e-3, 1), (9e-3, 12e-3, 1)];
        let supports: [SupportPoint; ROWS] = places.map(|(ahead_m, reach_m, plate)| {
            support(&readings, &reading, &state, (u_m + ahead_m, reach_m, plate))
        });
        readings.list[k].light = Light::Supports(supports);
    }
    (readings, state)
}

/// A point on a plate is at distance zero from it: the foot is found to 1e-9 m, and the plate turns by at most 1 rad in 10 mm there.
#[test]
fn points_on_the_plates_have_no_residual() {
    for kind in [CurveKind::Free, CurveKind::Pipe] {
        let (readings, state) = with_supports(kind);
        let seen: Vec<_> = sights(&readings, &state).into_iter().flatten().collect();
        assert!(seen.len() > 500, "{kind:?}: {}", seen.len());
        let worst = seen.iter().map(|seen| seen.residual.amax()).fold(0.0, f64::max);
        assert!(worst < 1e-9, "{kind:?}: {worst:e}");
    }
}

#[test]
fn supports_follow_from_every_unknown_as_differences_say() {
    for kind in [CurveKind::Free, CurveKind::Pipe] {
        let (readings, state) = with_supports(kind);
        for k in (40..readings.list.len() - 40).step_by(97) {
            assert_columns(&readings, &state, k);
        }
    }
}
