//! A drawing of the seam: derivatives of its place, its pose, the information that it adds, and limits of this information.

use super::*;
use crate::config::SeamCad;
use crate::curve::cad::checked;
use crate::curve::placed::Placed;
use crate::curve::registration::{Evenly, laid};
use crate::error::cad_problem::{CadProblem, CadUnit};
use nalgebra::{SMatrix, UnitQuaternion};
use trueline_geometry::{Polyline, Pose, se3};

fn asked(readings: &Readings) -> Asked<'_> {
    const KNOWN: &KnownOfCell = &KnownOfCell { offset_within_s: None, looks: None };
    let search = Search { readings, within_s: 0.6, guess: None, threads: 2 };
    Asked { search, errors: Errors::NONE, known: KNOWN }
}

/// The drawing of a kind of seam, accurate to a micrometre, times a factor.
fn drawing(kind: CurveKind, factor: f64) -> SeamCad {
    let points = (0..=2000).map(|k| kind.point(f64::from(k) / 2000.0) * factor).collect();
    SeamCad { file: "drawing".to_owned(), curve: Polyline::new(points).unwrap(), tolerance_m: 20e-6 }
}

fn evenly(cad: &SeamCad) -> Evenly {
    Evenly::of_drawing(&cad.curve, 1.0, 1e-4).unwrap()
}

fn anywhere() -> Pose {
    se3::from_parts(
        UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -1.1, 2.0)),
        Vector3::new(0.6, -0.2, 0.4),
    )
}

/// A curve that was placed elsewhere, at even steps; reversed if requested.
fn elsewhere(cad: &SeamCad, pose: &Pose, reversed: bool) -> Evenly {
    let at = |point: &Vector3<f64>| pose.rotation * point + pose.translation.vector;
    let mut points: Vec<Vector3<f64>> = cad.curve.points().iter().map(at).collect();
    if reversed {
        points.reverse();
    }
    Evenly::of_drawing(&Polyline::new(points).unwrap(), 1.0, 1e-4).unwrap()
}

#[test]
fn sights_follow_from_place_size_and_form_of_a_drawn_curve_as_differences_say() {
    let (recording, _) = scan_curve(&CurveScan::good(CurveKind::Free).exact(), 3);
    let (readings, truth) = readings(&recording, true);
    let free = at_truth(&readings, &truth);
    let placed = Placed::new(free.spline.clone(), Pose::identity());
    let state = State { placed: Some(placed), ..free };
    for k in (20..readings.list.len() - 20).step_by(131) {
        assert_columns(&readings, &state, k);
    }
}

#[test]
fn a_drawing_is_laid_over_a_curve_wherever_that_is_and_its_symmetries_are_named() {
    let pose = anywhere();
    for kind in [CurveKind::Wavy, CurveKind::Corner, CurveKind::Free] {
        for reversed in [false, true] {
            let cad = drawing(kind, 1.0);
            let found = laid(&elsewhere(&cad, &pose, reversed), &evenly(&cad), 20e-6).unwrap();
            // Chords of a tenth of a millimetre are rounded by less than a micrometre.
            assert!(found.rms_m < 3e-6, "{}: {}", kind.name(), found.rms_m);
            if kind == CurveKind::Free {
                let off = found.base_from_part.inverse() * pose;
                assert!(off.rotation.angle() < 1e-4 && off.translation.vector.norm() < 1e-4, "{off}");
                assert!(found.symmetry.is_none());
            }
        }
    }
    let axis = pose.rotation * Vector3::z();
    // A ring turns about its axis by any angle, a saddle by half a turn.
    for (kind, angle_rad) in [(CurveKind::Pipe, None), (CurveKind::Saddle, Some(std::f64::consts::PI))] {
        let cad = drawing(kind, 1.0);
        let found = laid(&elsewhere(&cad, &pose, false), &evenly(&cad), 20e-6).unwrap();
        assert!(found.rms_m < 3e-6, "{}: {}", kind.name(), found.rms_m);
        let symmetry = found.symmetry.unwrap();
        let of_axis = symmetry.point_m - pose.translation.vector;
        match angle_rad {
            None => assert!(symmetry.angle_rad.is_none()),
            Some(angle) => assert!((symmetry.angle_rad.unwrap() - angle).abs() < 1e-2),
        }
        if kind == CurveKind::Pipe {
            assert!(symmetry.axis.dot(&axis).abs() > 0.999, "{}", symmetry.axis);
            assert!((of_axis - axis * axis.dot(&of_axis)).norm() < 1e-3, "{of_axis}");
        }
    }
}

/// The ± of a saddle fall by a third or more [the design's table of prices], and the error stays within them.
#[test]
fn a_drawing_makes_the_answer_surer_and_not_wrong() {
    let (recording, _) = scan_curve(&CurveScan::good(CurveKind::Saddle), 12);
    let (readings, truth) = readings(&recording, false);
    let free = answered(&readings).unwrap();
    let before = free.noise;
    let answer = asked(&readings).by_cad(free, &drawing(CurveKind::Saddle, 1.0)).unwrap();
    assert!(answer.components.iter().all(|seen| *seen));
    let sum = |noise: &SMatrix<f64, 7, 7>| (4..7).map(|k| noise[(k, k)]).sum::<f64>();
    assert!(sum(&answer.noise) < 0.8 * sum(&before), "{} {}", answer.noise, before);
    assert!(answer.noise[(0, 0)] < before[(0, 0)]);
    let squared = squared_sigmas(&truth, &answer.at(), &answer.noise).unwrap();
    assert!(squared < 30.0, "{squared}");
    let cad = answer.curve.cad.unwrap();
    assert!(cad.rms_m < 60e-6 && cad.symmetry.is_some());
}

/// At a constant attitude in base, a shift of the part looks like the lever, however well its form is known.
#[test]
fn a_drawing_does_not_show_the_lever_of_a_constant_attitude() {
    let flat = CurveScan { tilt_rad: 0.0, ..CurveScan::good(CurveKind::Arc) };
    let (recording, _) = scan_curve(&flat, 21);
    let (readings, _) = readings(&recording, false);
    let Some(free) = answered(&readings) else { return };
    if let Ok(answer) = asked(&readings).by_cad(free, &drawing(CurveKind::Arc, 1.0)) {
        assert!(answer.finished.seen.rank < 7, "{}", answer.finished.seen.rank);
        assert!(!answer.components[4..].iter().all(|seen| *seen));
    }
}

#[test]
fn drawings_that_are_of_no_use_are_refused_with_what_is_wrong() {
    assert!(matches!(checked(&drawing(CurveKind::Straight, 1.0)), Err(CadProblem::Straight { .. })));
    let (recording, _) = scan_curve(&CurveScan::good(CurveKind::Wavy), 13);
    let (readings, _) = readings(&recording, false);
    let refused = |cad: &SeamCad| {
        let free = answered(&readings).unwrap();
        asked(&readings).by_cad(free, cad).err().unwrap()
    };
    for (unit, factor) in [(CadUnit::Inches, 25.4), (CadUnit::Metres, 1000.0), (CadUnit::NotMetres, 1e-3)] {
        match refused(&drawing(CurveKind::Wavy, 1.0 / factor)) {
            CadProblem::OtherUnit { unit: found, .. } => assert_eq!(found, unit),
            other => unreachable!("{other}"),
        }
    }
    match refused(&drawing(CurveKind::Corner, 1.2)) {
        CadProblem::Off { rms_m, .. } => assert!(rms_m > 1e-3, "{rms_m}"),
        other => unreachable!("{other}"),
    }
    assert!(matches!(refused(&drawing(CurveKind::Wavy, 0.6)), CadProblem::TooShort { .. }));
}
