//! Tests every analytic Jacobian against two independent oracles: central differences, and dual numbers in a separate implementation of the
//! measurement in plain arithmetic.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod dual;
mod view;

use dual::{Dual, Vec3, rotate_exp};
use nalgebra::{DMatrix, DVector, UnitVector3, Vector2, Vector3, Vector4};
use proptest::prelude::*;
use trueline_geometry::{Line, Plane, Pose};
use trueline_lsq::check::numerical_jacobian;
use trueline_model::point_to_line::{self, ResidualJacobian};
use trueline_model::{BrownConrady, Camera, LaserSheet, Placement, sheet_residual};
use view::{View, vector, view};

/// One measured point with everything around it.
#[derive(Clone, Debug)]
struct Case {
    view: View,
    placement: Placement,
    point_in_camera: Vector3<f64>,
    line: Line,
}

fn case() -> impl Strategy<Value = Case> {
    // The angle between line and sheet is within 0.4 rad of a right angle, and the line misses the point by up to 2 mm.
    (view(), vector(0.4), vector(0.002)).prop_map(|(view, turn, miss)| Case {
        placement: view.placement(),
        point_in_camera: view.point_in_camera(),
        line: view.line(&turn, &miss),
        view,
    })
}

/// Perturbs (t_d, rotation, translation, line) by the conventions and measures again.
fn perturbed(case: &Case, step: &DVector<f64>) -> (Placement, Line) {
    let line = case.line.retract(&Vector4::new(step[7], step[8], step[9], step[10]));
    (case.view.stepped(step), line)
}

fn stacked(j: &ResidualJacobian, placement: &Placement) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(2, 11);
    all.view_mut((0, 0), (2, 7)).copy_from(&j.by_links(placement));
    all.view_mut((0, 7), (2, 4)).copy_from(&j.d_line);
    all
}

fn close(analytic: &DMatrix<f64>, oracle: &DMatrix<f64>, tolerance: f64) -> Result<(), TestCaseError> {
    // Entries reach metres per radian and metres per second, so errors are relative to the largest.
    let scale = 1.0 + oracle.amax();
    let error = (analytic - oracle).amax() / scale;
    prop_assert!(error < tolerance, "error {error}\nanalytic {analytic}\noracle {oracle}");
    Ok(())
}

/// The residual in the sheet by intersecting line and sheet, written out with dual numbers.
fn sheet_residual_by_duals(case: &Case, unknown: usize) -> [f64; 2] {
    let d = |k: usize| Dual { value: 0.0, slope: f64::from(u8::from(k == unknown)) };
    let base_from_camera = |p: Vec3| dual::base_from_camera(case_arrays(case), p, &d);
    // Three points of the camera frame span its axes in base.
    let origin = base_from_camera(dual::constant([0.0; 3]));
    let axis = |e: [f64; 3]| dual::sub(base_from_camera(dual::constant(e)), origin);
    let axes = [axis([1.0, 0.0, 0.0]), axis([0.0, 1.0, 0.0]), axis([0.0, 0.0, 1.0])];
    let (anchor, direction) = perturbed_line(case, &d);
    // Line in the camera frame, then n·(a + s v) = d.
    let to_camera = |p: Vec3| axes.map(|e| dual::dot(e, p));
    let (a, v) = (to_camera(dual::sub(anchor, origin)), to_camera(direction));
    let n = dual::constant(case.view.sheet.plane().normal().into_inner().into());
    let s = (Dual::constant(case.view.sheet.plane().offset()) - dual::dot(n, a)) / dual::dot(n, v);
    let hit = dual::add(a, v.map(|x| x * s));
    let measured = case.view.sheet.coordinates(&case.point_in_camera);
    let foot = case.view.sheet.point(&Vector2::zeros());
    [0, 1].map(|row| {
        let e: [f64; 3] = case.view.sheet.axes().column(row).into_owned().into();
        let predicted = dual::dot(dual::constant(e), dual::sub(hit, dual::constant(foot.into())));
        (Dual::constant(measured[row]) - predicted).slope
    })
}

fn perturbed_line(case: &Case, d: &dyn Fn(usize) -> Dual) -> (Vec3, Vec3) {
    let axes = case.line.axes();
    let column = |k: usize| dual::constant(axes.column(k).into_owned().into());
    let turn = dual::add(column(1).map(|x| x * d(7)), column(2).map(|x| x * d(8)));
    let shift = dual::add(column(1).map(|x| x * d(9)), column(2).map(|x| x * d(10)));
    let anchor = dual::add(dual::constant((*case.line.anchor()).into()), shift);
    (anchor, rotate_exp(turn, column(0)))
}

fn case_arrays(case: &Case) -> dual::Chain {
    let rotation = |p: &Pose| {
        let m = p.rotation.to_rotation_matrix();
        [0, 1, 2].map(|r| [0, 1, 2].map(|c| m[(r, c)]))
    };
    dual::Chain {
        robot_rotation: rotation(&case.view.segment.base_from_tool),
        robot_position: case.view.segment.base_from_tool.translation.vector.into(),
        body_rate: case.view.segment.body_rate.into(),
        velocity: case.view.segment.velocity.into(),
        elapsed: case.view.exposure - case.view.segment.start,
        hand_eye_rotation: rotation(&case.view.tool_from_camera),
        hand_eye_translation: case.view.tool_from_camera.translation.vector.into(),
    }
}

fn point_to_line_by_duals(case: &Case, unknown: usize) -> [f64; 2] {
    let d = |k: usize| Dual { value: 0.0, slope: f64::from(u8::from(k == unknown)) };
    let p = dual::base_from_camera(case_arrays(case), dual::constant(case.point_in_camera.into()), &d);
    let axes = case.line.axes();
    let (anchor, _) = perturbed_line(case, &d);
    let column = |k: usize| dual::constant(axes.column(k).into_owned().into());
    let turn = dual::add(column(1).map(|x| x * d(7)), column(2).map(|x| x * d(8)));
    [1, 2].map(|k| dual::dot(rotate_exp(turn, column(k)), dual::sub(p, anchor)).slope)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn sheet_residual_jacobian(case in case()) {
        let placement = case.placement;
        let parts =
            sheet_residual::linearize(&placement, &case.view.sheet, &case.point_in_camera, &case.line).unwrap();
        let analytic = stacked(&parts, &placement);
        let numerical = numerical_jacobian(11, 1e-3, |step| {
            let (placement, line) = perturbed(&case, step);
            let r = sheet_residual::residual(&placement, &case.view.sheet, &case.point_in_camera, &line).unwrap();
            DVector::from_column_slice(r.as_slice())
        });
        // Five-point stencil, h = 1e-3: truncation h⁴/30·f⁽⁵⁾ ≈ 1e-12·(a few), rounding eps/h = 2e-13.
        close(&analytic, &numerical, 1e-9)?;
        let by_duals = DMatrix::from_fn(2, 11, |row, k| sheet_residual_by_duals(&case, k)[row]);
        // Dual numbers are exact to rounding. The line's distance of metres costs two or three digits.
        close(&analytic, &by_duals, 1e-12)?;
    }

    #[test]
    fn point_to_line_jacobian(case in case()) {
        let placement = case.placement;
        let parts = point_to_line::linearize(&placement, &case.point_in_camera, &case.line);
        let analytic = stacked(&parts, &placement);
        let numerical = numerical_jacobian(11, 1e-3, |step| {
            let (placement, line) = perturbed(&case, step);
            let r = point_to_line::residual(&placement, &case.point_in_camera, &line);
            DVector::from_column_slice(r.as_slice())
        });
        close(&analytic, &numerical, 1e-9)?;
        let by_duals = DMatrix::from_fn(2, 11, |row, k| point_to_line_by_duals(&case, k)[row]);
        close(&analytic, &by_duals, 1e-12)?;
    }

    #[test]
    fn noise_in_base_is_carried_into_the_sheet(case in case(), push in vector(1e-3)) {
        let placement = case.placement;
        let parts =
            sheet_residual::linearize(&placement, &case.view.sheet, &case.point_in_camera, &case.line).unwrap();
        let mut pushed = placement;
        pushed.base_from_tool.translation.vector += push;
        let r = sheet_residual::residual(&pushed, &case.view.sheet, &case.point_in_camera, &case.line).unwrap();
        // A shift of the sensor moves the residual exactly linearly.
        prop_assert!((r - parts.residual - parts.by_shift() * push).norm() < 1e-13);
    }

    #[test]
    fn residuals_agree_that_a_point_on_the_line_is_on_it(case in case(), along in -0.3..0.3_f64) {
        let placement = case.placement;
        let through = Line::new(
            placement.point_in_base(&case.point_in_camera) + case.line.direction() * along,
            &UnitVector3::new_normalize(case.line.direction()),
        );
        let sheet = sheet_residual::residual(&placement, &case.view.sheet, &case.point_in_camera, &through).unwrap();
        let distance = point_to_line::residual(&placement, &case.point_in_camera, &through);
        // Coordinates of metres: 1e-15 each, a handful of operations.
        prop_assert!(sheet.norm() < 1e-13 && distance.norm() < 1e-13);
    }

    #[test]
    fn pixel_to_sheet_jacobian(u in 50.0..2400.0_f64, v in 50.0..1950.0_f64) {
        let camera = Camera {
            size: [2448, 2000],
            focal: Vector2::new(3598.0, 3597.0),
            centre: Vector2::new(1211.0, 1007.0),
            distortion: BrownConrady { k1: -0.08, k2: 0.12, p1: 2e-4, p2: -3e-4, k3: 0.01 },
        };
        let sheet = LaserSheet::from_plane(Plane::from_height(0.036, 2.12, 0.1307).unwrap());
        let (ray, d_ray) = camera.ray(&Vector2::new(u, v)).unwrap();
        let (point, d_point) = sheet.intersect(&ray).unwrap();
        let analytic = d_point * d_ray;
        let numerical = numerical_jacobian(2, 0.5, |step| {
            let (ray, _) = camera.ray(&Vector2::new(u + step[0], v + step[1])).unwrap();
            DVector::from_column_slice(sheet.intersect(&ray).unwrap().0.as_slice())
        });
        // Metres per pixel, about 4e-5. The undistortion is converged to 1e-15 of a focal length.
        let error = (analytic - numerical).amax();
        prop_assert!(error < 1e-13, "{error}");
        // Forward again, the point projects onto its pixel, to the inverse's 1e-12 of a focal length.
        let again = camera.project(&point).unwrap();
        prop_assert!((again - Vector2::new(u, v)).norm() < 1e-8);
        prop_assert!(sheet.plane().signed_distance(&point).abs() < 1e-15);
    }
}
