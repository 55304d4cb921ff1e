//! Tests the rigid part of a sheet's correction: the nearest one by trial, its slopes by differences.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{DVector, Point3, Rotation2, SVector, Vector2};
use trueline_geometry::{Plane, se3};
use trueline_lsq::check::numerical_jacobian;
use trueline_model::{LaserSheet, RigidPart, SheetField, SheetShape};

const FIELD: SheetField = SheetField { width_m: [-0.020, 0.031], depth_m: [0.110, 0.168] };

/// Typical sensor errors: percents, and as much over 30 mm.
fn shape() -> SheetShape {
    SheetShape { h: [0.011, -0.007, 0.014, 0.21, -0.16], origin_m: [0.004, 0.140] }
}

fn sheet() -> LaserSheet {
    LaserSheet::from_plane(Plane::new([0.1, -0.9, 0.42].into(), 0.0557).unwrap())
}

fn squares(part: &RigidPart) -> f64 {
    let turn = Rotation2::new(part.turn_rad);
    let off = |at: Vector2<f64>| turn * at + Vector2::from(part.shift_m) - shape().corrected(&at).0;
    FIELD.grid().map(|at| off(at).norm_squared()).sum()
}

#[test]
fn no_other_motion_is_nearer() {
    let found = FIELD.rigid_part(&shape()).unwrap();
    let least = squares(&found.part);
    // 25 points of the grid: the remainder is their RMS.
    assert!((found.remains_m - (least / 25.0).sqrt()).abs() < 1e-15, "{}", found.remains_m);
    assert!(found.remains_m > 1e-5, "the shape is no rigid motion");
    let RigidPart { turn_rad, shift_m: [x, y] } = found.part;
    for [d_turn, dx, dy] in [[1e-6, 0.0, 0.0], [0.0, 1e-7, 0.0], [0.0, 0.0, 1e-7], [1e-6, -1e-7, 1e-7]] {
        for sign in [1.0, -1.0] {
            let shift_m = [x + sign * dx, y + sign * dy];
            assert!(squares(&RigidPart { turn_rad: turn_rad + sign * d_turn, shift_m }) > least);
        }
    }
}

#[test]
fn a_sensor_that_is_right_is_not_moved() {
    let exact = FIELD.rigid_part(&SheetShape::exact_about(&Vector2::new(0.0, 0.14))).unwrap();
    assert!(exact.part.turn_rad.abs() < 1e-15 && exact.part.shift_m.iter().all(|m| m.abs() < 1e-15));
    assert!(exact.remains_m < 1e-15);
}

#[test]
fn slopes_are_those_of_differences() {
    let found = FIELD.rigid_part(&shape()).unwrap();
    let motion = |h: &DVector<f64>| {
        let moved = FIELD.rigid_part(&shape().retract(&SVector::from_fn(|k, _| h[k]))).unwrap();
        let step =
            se3::difference_decoupled(&moved.part.in_camera(&sheet()), &found.part.in_camera(&sheet()));
        DVector::from_iterator(6, step.0.iter().chain(step.1.iter()).copied())
    };
    let by_differences = numerical_jacobian(5, 1e-4, motion);
    let difference = found.d_in_camera(&sheet()) - by_differences;
    // Five points with steps of 1e-4: truncation is below 1e-14, and rounding 1e-16/1e-4.
    assert!(difference.amax() < 1e-10, "{difference}");
}

#[test]
fn in_the_camera_frame_it_moves_points_of_the_sheet_in_it() {
    let (sheet, part) = (sheet(), FIELD.rigid_part(&shape()).unwrap().part);
    let turn = Rotation2::new(part.turn_rad);
    for at in FIELD.grid() {
        let moved = part.in_camera(&sheet) * Point3::from(sheet.point(&at));
        let expected = sheet.point(&(turn * at + Vector2::from(part.shift_m)));
        assert!((moved.coords - expected).norm() < 1e-15, "{at}");
    }
    // The profiler's axes are x and z, whose normal is −y.
    let profiler = LaserSheet::of_profiler();
    let at = Vector2::new(0.01, 0.15);
    let moved = part.in_camera(&profiler) * Point3::from(profiler.point(&at));
    assert!((moved.coords - profiler.point(&(turn * at + Vector2::from(part.shift_m)))).norm() < 1e-15);
}
