//! Circles and curves: nearest points and fits.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{UnitVector3, Vector3};
use trueline_geometry::{Circle, Polyline, fit};

fn circle() -> Circle {
    let axis = UnitVector3::new_normalize(Vector3::new(0.1, -0.3, 0.9));
    Circle::new(Vector3::new(1.0, 0.5, -0.2), axis, 0.6).unwrap()
}

/// Points of an arc, moved by a small pattern.
fn arc(circle: &Circle, from: f64, to: f64, off_m: f64) -> Vec<Vector3<f64>> {
    let axis = circle.axis().into_inner();
    let u = axis.cross(&Vector3::x()).normalize();
    let v = axis.cross(&u);
    (0..200)
        .map(|k| {
            let a = from + (to - from) * f64::from(k) / 199.0;
            let jitter = Vector3::new((17.0 * a).sin(), (29.0 * a).cos(), (41.0 * a).sin()) * off_m;
            circle.centre() + (u * a.cos() + v * a.sin()) * circle.radius() + jitter
        })
        .collect()
}

#[test]
fn the_nearest_point_is_on_the_circle_and_square_to_it() {
    let circle = circle();
    for point in arc(&circle, 0.0, 6.0, 0.1) {
        let nearest = circle.nearest(&point);
        let outward = nearest - circle.centre();
        assert!((outward.norm() - circle.radius()).abs() < 1e-14);
        assert!(circle.axis().dot(&outward).abs() < 1e-14);
        let tangent = circle.axis().cross(&outward);
        assert!(tangent.dot(&(point - nearest)).abs() < 1e-14);
    }
}

#[test]
fn an_exact_arc_is_recovered_from_any_part_of_it() {
    let truth = circle();
    for to in [0.5, 1.6, 3.0, 6.2] {
        let found = fit::robust_circle(&arc(&truth, 0.0, to, 0.0)).unwrap();
        // An arc of half a radian rises by 3 % of the radius, so rounding of 1e-16 grows by 30² in the centre.
        assert!((found.centre() - truth.centre()).norm() < 1e-11, "{to}");
        assert!((found.radius() - truth.radius()).abs() < 1e-11);
        assert!(found.axis().dot(truth.axis()).abs() > 1.0 - 1e-14);
    }
}

#[test]
fn wild_points_do_not_move_the_circle() {
    let truth = circle();
    let mut points = arc(&truth, 0.0, 1.6, 1e-5);
    for point in points.iter_mut().step_by(5) {
        point.z += 0.05;
    }
    let found = fit::robust_circle(&points).unwrap();
    // 160 points off by 0.01 mm each. The centre of a quarter circle is ten times less certain than a point.
    assert!((found.centre() - truth.centre()).norm() < 1e-4);
}

#[test]
fn a_circle_needs_points_that_bend() {
    assert!(fit::robust_circle(&[Vector3::x(), Vector3::y()]).is_none());
    let straight: Vec<Vector3<f64>> = (0..10).map(|k| Vector3::x() * f64::from(k)).collect();
    assert!(fit::robust_circle(&straight).is_none_or(|circle| circle.radius() > 1e3));
    assert!(Circle::new(Vector3::zeros(), Vector3::z_axis(), 0.0).is_none());
    assert!(Circle::new(Vector3::zeros(), Vector3::z_axis(), f64::NAN).is_none());
}

#[test]
fn a_curve_has_ends() {
    let corner = vec![Vector3::zeros(), Vector3::x(), Vector3::x() + Vector3::y()];
    let curve = Polyline::new(corner).unwrap();
    let inside = curve.nearest(&Vector3::new(0.4, 0.1, 0.2));
    assert_eq!((inside.point, inside.beyond_end), (Vector3::new(0.4, 0.0, 0.0), false));
    // Outside a corner the corner is nearest, and it is no end.
    assert!(!curve.nearest(&Vector3::new(1.3, -0.3, 0.0)).beyond_end);
    assert!(curve.nearest(&Vector3::new(-0.1, 0.0, 0.0)).beyond_end);
    assert!(curve.nearest(&Vector3::new(1.0, 1.1, 0.0)).beyond_end);
    let loop_ = vec![Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::zeros()];
    assert!(!Polyline::new(loop_).unwrap().nearest(&Vector3::new(-0.1, -0.1, 0.0)).beyond_end);
    assert!(Polyline::new(vec![Vector3::x()]).is_none());
    assert!(Polyline::new(vec![Vector3::x(), Vector3::x()]).is_none());
}
