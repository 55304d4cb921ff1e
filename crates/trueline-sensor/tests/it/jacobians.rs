//! Derivatives against differences of values.

use crate::scenes;

use nalgebra::{DVector, SMatrix, Vector3};
use scenes::{board, camera, plane, striped_bundle};
use trueline_geometry::{se3, so3};
use trueline_lsq::check::{gradient_error, numerical_jacobian};
use trueline_sensor::bundle::SHARED_SIZE;
use trueline_sensor::projection::{CameraVector, from_vector, project_from_board, to_vector};
use trueline_sensor::sheet_tilt;

#[test]
fn a_projected_corner_moves_as_its_jacobian_says() {
    let (camera, board) = (camera(), board());
    let pose = se3::from_parts(so3::exp(&Vector3::new(0.3, -0.2, 0.5)), Vector3::new(-0.05, -0.04, 0.4));
    let point = board.corner(5, 3);
    let projected = project_from_board(&camera, &pose, &point).unwrap();
    // Steps of a thousandth of each parameter's size: see `numerical_jacobian` for what is left of them.
    let size = CameraVector::from_column_slice(&[500.0, 500.0, 300.0, 300.0, 1.0, 1.0, 1.0, 1.0, 1.0]);
    let of_camera = numerical_jacobian(9, 1e-3, |step| {
        let moved =
            to_vector(&camera) + CameraVector::from_column_slice(step.as_slice()).component_mul(&size);
        let pixel = project_from_board(&from_vector(camera.size, &moved), &pose, &point).unwrap().pixel;
        DVector::from_column_slice(pixel.as_slice())
    });
    for (k, size) in size.iter().enumerate() {
        let difference = (of_camera.column(k) / *size - projected.d_camera.column(k)).norm();
        assert!(
            difference < 1e-8 * projected.d_camera.column(k).norm().max(1.0),
            "parameter {k}: {difference}"
        );
    }
    let of_pose = numerical_jacobian(6, 1e-4, |step| {
        let moved =
            se3::retract_decoupled(&pose, &step.fixed_rows::<3>(0).into(), &step.fixed_rows::<3>(3).into());
        let pixel = project_from_board(&camera, &moved, &point).unwrap().pixel;
        DVector::from_column_slice(pixel.as_slice())
    });
    // Pixels move by thousands a metre; rounding is 1e-16 × 500 px / 1e-4 = 5e-10.
    assert!((of_pose - projected.d_pose).abs().max() < 1e-6);
}

#[test]
fn a_plane_tilts_toward_its_axes() {
    let plane = plane();
    let axes: SMatrix<f64, 3, 2> = sheet_tilt::axes(&plane);
    let moved = sheet_tilt::moved(&plane, &Vector3::new(1e-6, -2e-6, 3e-6));
    let tilt = (moved.normal().into_inner() - plane.normal().into_inner()).transpose() * axes;
    // Second order: 1e-12.
    assert!((tilt[0] - 1e-6).abs() < 1e-11 && (tilt[1] + 2e-6).abs() < 1e-11);
    assert!((moved.offset() - plane.offset() - 3e-6).abs() < 1e-15);
}

#[test]
fn the_gradient_is_that_of_the_cost_with_boards_eliminated() {
    // Off the optimum, with noise, a stripe, flatness and a prior: everything that the cost is made of.
    let (bundle, state) = striped_bundle(7);
    let state = bundle.fitted(state);
    let mut steps = DVector::from_element(SHARED_SIZE, 1e-3);
    // A thousandth of what each may move: px, coefficients, rad, m, and parts of the sheet.
    let sizes =
        [0.5, 0.5, 0.5, 0.5, 1e-3, 1e-3, 1e-4, 1e-4, 1e-3, 1e-4, 1e-4, 1e-5, 1e-4, 1e-4, 1e-4, 1e-5, 1e-5];
    for (k, step) in sizes.into_iter().enumerate() {
        steps[k] = step;
    }
    // In standard deviations of residual. The boards settle to 1e-9 of them, which differences over steps of about one
    // divide by one; truncation of the five-point stencil is the larger part.
    let error = gradient_error(&bundle, &state, &steps);
    assert!(error < 1e-4, "{error}");
}
