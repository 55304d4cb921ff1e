//! Tests a bowed seam measured by a sensor whose sheet has a shape: the geometry by construction, the Jacobian by differences.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{DMatrix, DVector, SVector, Vector2, Vector3, Vector4};
use proptest::prelude::*;
use trueline_geometry::Line;
use trueline_lsq::check::numerical_jacobian;
use trueline_model::{Curvature, Placement, SeamInSheet, SheetShape, sheet_residual};
use view::{View, shape, vector, view};

mod view;

#[derive(Clone, Debug)]
struct Case {
    view: View,
    placement: Placement,
    point_in_camera: Vector3<f64>,
    line: Line,
    curvature: Curvature,
    shape: SheetShape,
}

fn case() -> impl Strategy<Value = Case> {
    let line = (vector(0.4), vector(0.002), vector(0.0005), -0.05..0.05_f64);
    (view(), line, shape()).prop_map(|(view, (turn, miss, bow, middle_m), shape)| Case {
        placement: view.placement(),
        point_in_camera: view.point_in_camera(),
        line: view.line(&turn, &miss),
        curvature: Curvature { bow_m: [bow.x, bow.y], half_length_m: 0.1, middle_m },
        shape,
        view,
    })
}

/// Residual after a step of all 18 unknowns.
fn residual(case: &Case, step: &DVector<f64>) -> Vector2<f64> {
    let placement = case.view.stepped(step);
    let line = case.line.retract(&Vector4::new(step[7], step[8], step[9], step[10]));
    let curvature = case.curvature.retract(&Vector2::new(step[11], step[12]));
    let shape = case.shape.retract(&SVector::from_fn(|k, _| step[13 + k]));
    let seam = SeamInSheet { line: &line, curvature: &curvature, shape: Some(&shape) };
    seam.linearize(&placement, &case.view.sheet, &case.point_in_camera).unwrap().straight.residual
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_jacobian_is_that_of_differences(case in case()) {
        let placement = case.placement;
        let seam = SeamInSheet { line: &case.line, curvature: &case.curvature, shape: Some(&case.shape) };
        let parts = seam.linearize(&placement, &case.view.sheet, &case.point_in_camera).unwrap();
        let mut analytic = DMatrix::zeros(2, 18);
        analytic.view_mut((0, 0), (2, 7)).copy_from(&parts.straight.by_links(&placement));
        analytic.view_mut((0, 7), (2, 4)).copy_from(&parts.straight.d_line);
        analytic.view_mut((0, 11), (2, 2)).copy_from(&parts.d_curvature);
        analytic.view_mut((0, 13), (2, 5)).copy_from(&parts.d_shape);
        let numerical = numerical_jacobian(18, 1e-4, |step| {
            DVector::from_column_slice(residual(&case, step).as_slice())
        });
        // Truncation h⁴/30 with fifth derivatives of some 10⁴ (a rotation moves the intersection on a bow of 1/100 mm), and rounding of metres,
        // 1e-15/h. Both are below 1e-10 of entries that reach metres.
        let error = (&analytic - &numerical).amax() / (1.0 + numerical.amax());
        prop_assert!(error < 1e-9, "error {error}\nanalytic {analytic}\nnumerical {numerical}");
    }

    /// The report of a seam point through the sensor's shape has no residual.
    #[test]
    fn the_report_through_the_shape_has_no_residual(case in case(), along in -0.08..0.08_f64) {
        let axes = case.line.axes();
        let offset = case.curvature.offset_at(along);
        let in_base = case.line.anchor() + axes * Vector3::new(along, offset.x, offset.y);
        // The sheet passes through that point: the tool is moved there.
        let placement = case.placement;
        let there = case.view.sheet.coordinates(&case.point_in_camera);
        let mut moved = placement;
        moved.base_from_tool.translation.vector += in_base - placement.point_in_base(&case.point_in_camera);
        let reported = case.view.sheet.point(&case.shape.reported(&there).reported);
        let seam = SeamInSheet { line: &case.line, curvature: &case.curvature, shape: Some(&case.shape) };
        let residual = seam.linearize(&moved, &case.view.sheet, &reported).unwrap().straight.residual;
        // Metres to 1e-15, a dozen operations, an oblique intersection.
        prop_assert!(residual.norm() < 1e-13, "{}", residual.norm());
    }

    #[test]
    fn a_straight_seam_and_an_exact_sensor_are_the_plain_residual(case in case()) {
        let placement = case.placement;
        let straight = Curvature { bow_m: [0.0; 2], ..case.curvature };
        let seam = SeamInSheet { line: &case.line, curvature: &straight, shape: None };
        let parts = seam.linearize(&placement, &case.view.sheet, &case.point_in_camera).unwrap();
        let plain =
            sheet_residual::linearize(&placement, &case.view.sheet, &case.point_in_camera, &case.line).unwrap();
        prop_assert!((parts.straight.residual - plain.residual).norm() < 1e-14);
        prop_assert!((parts.straight.by_turn() - plain.by_turn()).norm() < 1e-13);
        prop_assert!((parts.straight.d_line - plain.d_line).norm() < 1e-13);
        prop_assert!((parts.straight.by_shift() - plain.by_shift()).norm() < 1e-14);
    }

    #[test]
    fn reported_and_corrected_are_inverse(case in case(), a in -0.03..0.03_f64, b in -0.03..0.03_f64) {
        let at = Vector2::new(a, b) + Vector2::from(case.shape.origin_m);
        let report = case.shape.reported(&at);
        let (back, slope) = case.shape.corrected(&report.reported);
        prop_assert!((back - at).norm() < 1e-16);
        prop_assert!((slope * report.d_true - nalgebra::Matrix2::identity()).norm() < 1e-14);
    }

    #[test]
    fn shapes_about_one_origin_follow_each_other(case in case(), a in -0.03..0.03_f64, h in vector(0.02)) {
        let second = SheetShape { h: [h.x, h.y, h.z, 0.2, -0.1], ..case.shape };
        let at = Vector2::new(a, 0.01);
        let one_by_one = second.corrected(&case.shape.corrected(&at).0).0;
        let together = second.after(&case.shape).corrected(&at).0;
        prop_assert!((one_by_one - together).norm() < 1e-15);
    }
}
