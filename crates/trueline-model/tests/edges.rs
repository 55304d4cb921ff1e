//! Ends of the models from both sides: of the picture, of the lens, of the sheet, of the plate.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{Matrix3, SVector, UnitVector3, Vector2, Vector3};
use trueline_geometry::{Line, Plane, Pose, Trajectory, se3, so3};
use trueline_model::plate::{SURFACE_LENGTH_M, SURFACE_REACH_M, surface_terms};
use trueline_model::sheet_residual::{self, MIN_SINE};
use trueline_model::{
    BrownConrady, Camera, Curvature, LaserSheet, Placement, Plate, SeamInSheet, SheetShape, StripeOnPlate,
    point_to_line,
};

fn camera(distortion: BrownConrady) -> Camera {
    Camera {
        size: [640, 480],
        focal: Vector2::new(800.0, 810.0),
        centre: Vector2::new(320.0, 240.0),
        distortion,
    }
}

#[test]
fn a_picture_reaches_half_a_pixel_around_its_outer_pixels_both_ways() {
    let camera = camera(BrownConrady::default());
    // Just inside and just outside of each edge. Half a pixel belongs to the image.
    let inside = [(-0.5, 100.0), (639.5, 100.0), (100.0, -0.5), (100.0, 479.5), (0.0, 0.0), (320.0, 240.0)];
    let outside = [(-0.501, 100.0), (639.501, 100.0), (100.0, -0.501), (100.0, 479.501)];
    for (u, v) in inside {
        let pixel = Vector2::new(u, v);
        let (ray, _) = camera.ray(&pixel).unwrap();
        // Off the edge by less than rounding can undo.
        let nudged = pixel + (camera.centre - pixel) * 1e-12;
        let point = Vector3::new((nudged.x - 320.0) / 800.0, (nudged.y - 240.0) / 810.0, 1.0) * 0.3;
        assert!((camera.project(&point).unwrap() - pixel).norm() < 1e-9);
        assert!((ray * 0.3 - point).norm() < 1e-9);
    }
    for (u, v) in outside {
        assert!(camera.ray(&Vector2::new(u, v)).is_err(), "{u} {v}");
        let point = Vector3::new((u - 320.0) / 800.0, (v - 240.0) / 810.0, 1.0) * 0.3;
        assert!(camera.project(&point).is_none(), "{u} {v}");
    }
    let error = camera.ray(&Vector2::new(-1.0, 7.25)).unwrap_err();
    assert_eq!(error.to_string(), "pixel (-1.00, 7.25) is outside the image of 640 x 480");
}

#[test]
fn nothing_is_seen_behind_the_camera_or_in_its_plane() {
    let camera = camera(BrownConrady::default());
    for z in [0.0, -0.1] {
        assert!(camera.project(&Vector3::new(0.0, 0.0, z)).is_none());
        assert!(camera.project(&Vector3::new(0.01, 0.0, z)).is_none());
    }
    assert_eq!(camera.project(&Vector3::new(0.0, 0.0, 1e-3)), Some(camera.centre));
}

/// r (1 + k₁ r²) turns back at r² = −1/3k₁. A point at or beyond the fold has no pixel, and no pixel maps to it.
#[test]
fn the_fold_itself_is_on_no_pixel() {
    // A fold at r = 0.25 exactly, well inside the image.
    let lens = BrownConrady { k1: -16.0 / 3.0, ..BrownConrady::default() };
    let camera = camera(lens);
    let at = |r: f64| camera.project(&Vector3::new(r, 0.0, 1.0));
    assert!(at(0.2499).is_some() && at(0.2501).is_none() && at(0.3).is_none());
    // 0.25 (1 − 1/3) is the largest distorted radius.
    let back = |r: f64| lens.undistort(&Vector2::new(0.0, r));
    assert!(back(0.5 / 3.0 - 1e-6).is_some() && back(0.5 / 3.0 + 1e-6).is_none());
    let error = camera.ray(&Vector2::new(320.0 + 800.0 * 0.17, 240.0)).unwrap_err();
    assert_eq!(error.to_string(), "the lens distortion cannot be inverted at pixel (456.00, 240.00)");
    // A lens whose radial part never turns, but whose tangential part mirrors the image, has no ray.
    let mirror = BrownConrady { p1: -0.6, ..BrownConrady::default() };
    let (value, jacobian) = mirror.distort(&Vector2::new(0.0, 0.5));
    assert!(jacobian.determinant() < 0.0);
    assert!(mirror.undistort(&value).is_none_or(|(ideal, _)| (ideal - Vector2::new(0.0, 0.5)).norm() > 0.1));
}

/// A pixel far beyond the fold in a lens of any form: starts outside are drawn in, and the inner ray is found if it exists.
#[test]
fn pixels_whose_own_radius_is_beyond_the_fold_have_their_inner_ray() {
    // A barrel distortion compensated by k₂: distorted radii are larger than ideal ones, up to the fold.
    let lens = BrownConrady { k1: 2.0, k2: -3.0, ..BrownConrady::default() };
    let fold = lens.invertible_radius_squared().sqrt();
    let largest = lens.distort(&Vector2::new(fold, 0.0)).0.x;
    assert!(largest > 1.2 * fold);
    for share in [0.5, 0.9, 0.99, 0.9999] {
        for angle in [0.3_f64, 2.0, 4.4] {
            let ideal = Vector2::new(angle.cos(), angle.sin()) * (fold * share);
            let (back, inverse) = lens.undistort(&lens.distort(&ideal).0).unwrap();
            // Near the fold the inverse magnifies rounding by the inverse of the remaining slope, 1e-4.
            assert!((back - ideal).norm() < 1e-10, "{share} {angle}");
            let product = inverse * lens.distort(&back).1;
            assert!((product - nalgebra::Matrix2::identity()).norm() < 1e-8);
        }
    }
    assert!(lens.undistort(&Vector2::new(1.001 * largest, 0.0)).is_none());
    assert_eq!(BrownConrady::from_opencv([1.0, 2.0, 3.0, 4.0, 5.0]).to_opencv(), [1.0, 2.0, 3.0, 4.0, 5.0]);
    let named = BrownConrady::from_opencv([1.0, 2.0, 3.0, 4.0, 5.0]);
    assert_eq!([named.k1, named.k2, named.p1, named.p2, named.k3], [1.0, 2.0, 3.0, 4.0, 5.0]);
}

#[test]
fn a_sheets_axes_are_square_to_it_and_named_by_the_camera() {
    for normal in [
        Vector3::new(0.036, 2.12, -1.0),
        Vector3::new(0.899, -0.3, 0.2),
        Vector3::new(0.95, 0.2, -0.1),
        Vector3::new(-1.0, 0.0, 0.0),
    ] {
        let plane = Plane::new(normal, 0.13).unwrap();
        let sheet = LaserSheet::from_plane(plane);
        let (x, y) = (sheet.axes().column(0).into_owned(), sheet.axes().column(1).into_owned());
        let n = plane.normal().into_inner();
        let frame = Matrix3::from_columns(&[x, y, n]);
        assert!((frame.transpose() * frame - Matrix3::identity()).norm() < 1e-14);
        assert!((x.cross(&y) - n).norm() < 1e-14, "n = x × y");
        // x is the camera's x projected onto the sheet, or its y if x is steeper than 0.9 against the sheet.
        let reference = if n.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        assert!(y.dot(&reference).abs() < 1e-14 && x.dot(&reference) > 0.0, "{n}");
        assert!((sheet.origin() - n * plane.offset()).norm() < 1e-16);
        let there = Vector2::new(0.01, -0.02);
        assert!((sheet.coordinates(&(sheet.point(&there) + n * 0.3)) - there).norm() < 1e-15);
        assert!(plane.signed_distance(&sheet.point(&there)).abs() < 1e-15);
    }
    let profiler = LaserSheet::of_profiler();
    assert_eq!(profiler.point(&Vector2::new(0.3, 0.2)), Vector3::new(0.3, 0.0, 0.2));
}

#[test]
fn a_ray_meets_the_sheet_in_front_of_the_camera_or_not_at_all() {
    let sheet = LaserSheet::from_plane(Plane::new(Vector3::new(0.0, 1.0, 1.0), 0.2).unwrap());
    // n·r is cos 45° × (y + 1) for a ray (x, y, 1), whose length is about √2 at y = −1.
    let meets = |y: f64| sheet.intersect(&Vector3::new(0.0, y, 1.0));
    assert!(meets(-1.0).is_none() && meets(-1.1).is_none());
    assert!(meets(-1.0 + 1.9e-9).is_none() && meets(-1.0 + 2.1e-9).is_some());
    let (point, slope) = meets(0.5).unwrap();
    assert!((sheet.plane().signed_distance(&point)).abs() < 1e-15 && point.z > 0.0);
    // A change along the ray does not move the point.
    assert!((slope * Vector3::new(0.0, 0.5, 1.0)).norm() < 1e-15);
}

#[test]
fn a_bow_is_its_height_between_middle_and_ends() {
    let bow = Curvature { bow_m: [4e-4, -2e-4], half_length_m: 0.25, middle_m: 0.1 };
    let at = |along_m: f64| bow.offset_at(along_m);
    let rise = (at(0.35) + at(-0.15)) / 2.0 - at(0.1);
    assert!((rise - Vector2::new(4e-4, -2e-4)).norm() < 1e-18);
    // Its mean over the visible length is zero.
    let mean = (0..10_000).map(|k| bow.form(-0.15 + 0.5 * (f64::from(k) + 0.5) / 1e4).0).sum::<f64>() / 1e4;
    assert!(mean.abs() < 1e-8, "{mean}");
    // Slope by differences of a parabola: exact.
    let slope = (bow.form(0.21).0 - bow.form(0.19).0) / 0.02;
    assert!((bow.form(0.2).1 - slope).abs() < 1e-13);
    // 0.3 mm plus a millimetre per metre of the visible 0.5 m.
    assert!((bow.prior_sigma_m() - 0.8e-3).abs() < 1e-18);
    let moved = bow.retract(&Vector2::new(1e-4, 2e-4));
    assert!((Vector2::from(moved.bow_m) - Vector2::new(5e-4, 0.0)).norm() < 1e-18);
    assert_eq!((moved.half_length_m, moved.middle_m), (0.25, 0.1));
}

/// A tool at rest at the origin.
fn at_rest() -> Placement {
    let trajectory = Trajectory::new(vec![0.0, 1.0], &[Pose::identity(); 2]).unwrap();
    Placement::new(trajectory.segment(0).unwrap(), 0.5, &Pose::identity())
}

#[test]
fn a_line_along_the_sheet_is_not_met_up_to_the_least_sine() {
    let (placement, sheet) = (at_rest(), LaserSheet::of_profiler());
    let point = Vector3::new(0.01, 0.0, 0.21);
    let bow = Curvature { bow_m: [0.0; 2], half_length_m: 0.1, middle_m: 0.0 };
    for (factor, met) in [(0.999, false), (1.001, true), (-0.999, false), (-1.001, true), (0.0, false)] {
        let sine = MIN_SINE * factor;
        let direction = Vector3::new((1.0 - sine * sine).sqrt(), sine, 0.0);
        let line = Line::new(Vector3::new(0.0, 0.0, 0.2), &UnitVector3::new_normalize(direction));
        assert_eq!(sheet_residual::residual(&placement, &sheet, &point, &line).is_some(), met, "{factor}");
        assert_eq!(sheet_residual::linearize(&placement, &sheet, &point, &line).is_some(), met, "{factor}");
        let seam = SeamInSheet { line: &line, curvature: &bow, shape: None };
        assert_eq!(seam.linearize(&placement, &sheet, &point).is_some(), met, "{factor}");
        // The paper's distance is defined there too.
        assert!(point_to_line::residual(&placement, &point, &line).norm() > 0.0);
    }
    // A seam that bows until it is parallel to the sheet at their intersection: at s = 0 the bow has no height, φ = (s₀/ℓ)² − 1/3 = 0, and a slope
    // of −2 s₀/ℓ².
    let across =
        Line::new(Vector3::new(0.0, 0.0, 0.2), &UnitVector3::new_normalize(Vector3::new(1.0, 0.1, 0.0)));
    let axes = across.axes();
    let (half_length_m, middle_m) = (0.1_f64, 0.1 / 3.0_f64.sqrt());
    let heights = [axes.column(1).y, axes.column(2).y];
    let out_of_sheet = heights[0].hypot(heights[1]);
    for (left, met) in [(0.9e-3, false), (1.1e-3, true), (-0.9e-3, false), (-1.1e-3, true)] {
        let bow_m = (across.direction().y - left) / (2.0 * middle_m / half_length_m.powi(2) * out_of_sheet);
        let bow =
            Curvature { bow_m: heights.map(|height| height / out_of_sheet * bow_m), half_length_m, middle_m };
        let seam = SeamInSheet { line: &across, curvature: &bow, shape: None };
        assert_eq!(seam.linearize(&placement, &sheet, &point).is_some(), met, "{left}");
    }
}

#[test]
fn a_plate_along_the_sheet_has_no_stripe_up_to_the_least_sine() {
    let (placement, sheet) = (at_rest(), LaserSheet::of_profiler());
    let stripe_on = |sine: f64| {
        // The plate's normal leans from the sheet's by this sine.
        let normal = UnitVector3::new_normalize(Vector3::new(0.0, (1.0 - sine * sine).sqrt(), sine));
        let plate = Plate::flat(Vector3::new(0.0, 0.0, 0.2), &normal, &Vector3::x()).unwrap();
        let stripe = StripeOnPlate { plate: &plate, sheet: &sheet, shape: None };
        let at = Vector2::new(0.001, 0.2);
        assert_eq!(stripe.residual(&placement, &at).is_some(), stripe.linearize(&placement, &at).is_some());
        stripe.residual(&placement, &at)
    };
    assert!(stripe_on(0.000_999).is_none() && stripe_on(0.001_001).is_some());
    assert!(stripe_on(-0.000_999).is_none() && stripe_on(-0.001_001).is_some());
}

#[test]
fn the_residual_alone_is_that_of_the_linearization() {
    let (placement, sheet) = (at_rest(), LaserSheet::of_profiler());
    let normal = UnitVector3::new_normalize(Vector3::new(0.3, -0.4, 0.8));
    let flat = Plate::flat(Vector3::new(0.0, 0.01, 0.2), &normal, &Vector3::new(0.2, 1.0, 0.1)).unwrap();
    let plate = Plate { surface_m: [1e-4, -2e-4, 3e-4, -1e-4, 2e-4, 1e-4, -3e-4], ..flat };
    let shape = SheetShape { h: [0.01, -0.02, 0.013, 0.3, -0.4], origin_m: [0.003, 0.2] };
    for shape in [None, Some(&shape)] {
        let stripe = StripeOnPlate { plate: &plate, sheet: &sheet, shape };
        for k in 0..9 {
            let at = Vector2::new(0.004 * f64::from(k) - 0.015, 0.2 - 0.002 * f64::from(k));
            let all = stripe.linearize(&placement, &at).unwrap();
            assert!((stripe.residual(&placement, &at).unwrap() - all.residual).abs() < 1e-16);
            assert!((all.normal.norm() - 1.0).abs() < 1e-14);
            // The foot is on the plate up to 0.1 µm squared over the curve's radius of some metres, after its last step.
            let foot = at - all.normal * all.residual;
            let foot = sheet.point(&shape.map_or(foot, |shape| shape.corrected(&foot).0));
            assert!(plate.distance(&placement.point_in_base(&foot)).value.abs() < 1e-12);
        }
    }
}

#[test]
fn the_terms_of_a_surface_are_what_the_page_says_at_their_reach() {
    assert_eq!(surface_terms(2.0, 3.0), SVector::from([4.0, 6.0, 9.0, 8.0, 12.0, 18.0, 27.0]));
    let plate =
        Plate::flat(Vector3::new(1.0, 0.0, 0.5), &Vector3::z_axis(), &Vector3::new(0.0, 2.0, 0.7)).unwrap();
    assert_eq!((plate.chart.along, plate.chart.outward), (Vector3::y(), Vector3::x()));
    let corner = plate.chart.centre + Vector3::new(SURFACE_REACH_M, SURFACE_LENGTH_M, 0.0);
    for k in 0..7 {
        let mut surface_m = [0.0; 7];
        surface_m[k] = 1e-3;
        let bent = Plate { surface_m, ..plate };
        // Each number is the height of the plate at 25 mm from the seam and 100 mm along it.
        assert!((bent.distance(&corner).value + 1e-3).abs() < 1e-16, "{k}");
    }
    assert!(Plate::flat(Vector3::zeros(), &Vector3::z_axis(), &Vector3::new(1e-7, 0.0, 1.0)).is_none());
    assert!(Plate::flat(Vector3::zeros(), &Vector3::z_axis(), &Vector3::new(1e-5, 0.0, 1.0)).is_some());
    let moved = plate.retract(&Vector3::new(0.0, 0.0, 0.01), &SVector::repeat(1e-4));
    assert_eq!((moved.offset_m, moved.surface_m), (0.01, [1e-4; 7]));
    assert!((moved.offset_in_base_m() - 0.51).abs() < 1e-15);
    // A rotation about the seam tilts the normal towards −outward, and one about outward tilts it towards along.
    let turned = |step: Vector3<f64>| plate.retract(&step, &SVector::zeros()).normal.into_inner();
    assert!((turned(Vector3::new(1e-6, 0.0, 0.0)) - Vector3::new(1e-6, 0.0, 1.0)).norm() < 1e-11);
    assert!((turned(Vector3::new(0.0, 1e-6, 0.0)) - Vector3::new(0.0, -1e-6, 1.0)).norm() < 1e-11);
}

#[test]
fn a_shape_that_is_exact_reports_what_is_there() {
    let exact = SheetShape::exact_about(&Vector2::new(0.01, 0.2));
    let at = Vector2::new(0.03, 0.15);
    assert_eq!((exact.corrected(&at).0, exact.reported(&at).reported), (at, at));
    assert_eq!(exact.origin_m, [0.01, 0.2]);
    // The formula as documented: a′ = ((1 + h₁) a + h₃ b)/w, b′ = (1 + h₂) b/w.
    let shape = SheetShape { h: [0.01, -0.02, 0.013, 0.3, -0.4], ..exact };
    let (a, b) = (0.02, -0.05);
    let w = 1.0 + 0.3 * a - 0.4 * b;
    let expected = Vector2::new(0.01 + (1.01 * a + 0.013 * b) / w, 0.2 + 0.98 * b / w);
    assert!((shape.corrected(&at).0 - expected).norm() < 1e-16);
    let stepped = shape.retract(&SVector::from([0.1, 0.2, 0.3, 0.4, 0.5]));
    assert!((SVector::from(stepped.h) - SVector::from([0.11, 0.18, 0.313, 0.7, 0.1])).norm() < 1e-15);
}

/// A point carried by the moving tool: its position, and its rate against differences of the pose.
#[test]
fn the_time_offset_moves_the_point_as_the_robot_does_backwards() {
    let poses = [0.0, 1.0].map(|t: f64| {
        se3::from_parts(
            so3::exp(&Vector3::new(0.3, -0.2, 0.9)) * so3::exp(&(Vector3::new(0.2, 0.5, -0.4) * t)),
            Vector3::new(0.5 + 0.1 * t, -0.2, 0.3 - 0.2 * t),
        )
    });
    let trajectory = Trajectory::new(vec![0.0, 1.0], &poses).unwrap();
    let segment = trajectory.segment(0).unwrap();
    let sensor = se3::from_parts(so3::exp(&Vector3::new(1.0, 0.2, -0.3)), Vector3::new(0.1, 0.05, 0.2));
    let point = Vector3::new(0.01, 0.02, 0.15);
    let at = |time_s: f64| Placement::new(segment, time_s, &sensor).point_in_base(&point);
    let placement = Placement::new(segment, 0.4, &sensor);
    assert!((placement.base_from_camera() * nalgebra::Point3::from(point) - at(0.4)).coords.norm() < 1e-14);
    let slope = (at(0.4 + 1e-5) - at(0.4 - 1e-5)) / 2e-5;
    // h² of a third derivative below 1, and 1e-16 over h.
    let jacobian = placement.jacobian(&point);
    assert!((jacobian.d_point_d_time_offset + slope).norm() < 1e-10);
    // The gradient of a number is the Jacobian from the left by it.
    let by_point = Vector3::new(0.4, -0.9, 0.2);
    let links = placement.carried(&placement.by_pose(&at(0.4), &by_point));
    assert!((links[0] - by_point.dot(&jacobian.d_point_d_time_offset)).abs() < 1e-14);
    let [turn, shift] = [1, 4].map(|first| links.fixed_rows::<3>(first).into_owned());
    assert!((turn - jacobian.d_point_d_rotation.transpose() * by_point).norm() < 1e-14);
    assert!((shift - jacobian.d_point_d_translation.transpose() * by_point).norm() < 1e-14);
}
