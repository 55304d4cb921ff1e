//! Lens distortion against OpenCV, and its behaviour beyond the invertible range.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{Vector2, Vector3};
use proptest::prelude::*;
use trueline_model::{BrownConrady, Camera, PixelError};

fn camera() -> Camera {
    Camera {
        size: [2448, 2000],
        focal: Vector2::new(3598.0, 3597.0),
        centre: Vector2::new(1211.0, 1007.0),
        distortion: BrownConrady::from_opencv([-0.08, 0.12, 2e-4, -3e-4, 0.01]),
    }
}

/// Values of OpenCV 4.14's projectPoints for the camera above.
const OPENCV: [([f64; 3], [f64; 2]); 3] = [
    ([0.01, -0.02, 0.13], [1487.0815578937013, 454.9477800662572]),
    ([-0.04, 0.03, 0.15], [258.2771270855051, 1721.3335687572016]),
    ([0.035, 0.025, 0.11], [2344.788220205234, 1816.8514840033877]),
];

#[test]
fn projection_agrees_with_opencv() {
    for (point, pixel) in OPENCV {
        let ours = camera().project(&Vector3::from(point)).unwrap();
        // Both in double precision at values of 2000: a few eps each, 1e-12.
        assert!((ours - Vector2::from(pixel)).norm() < 1e-11, "{ours}");
    }
}

#[test]
fn the_ray_of_opencvs_pixel_points_at_the_point() {
    for (point, pixel) in OPENCV {
        let (ray, _) = camera().ray(&Vector2::from(pixel)).unwrap();
        let expected = Vector3::from(point) / point[2];
        assert!((ray - expected).norm() < 1e-12, "{ray}");
    }
}

#[test]
fn a_pixel_outside_the_image_is_an_error() {
    for (u, v) in [(-0.51, 10.0), (2447.51, 10.0), (10.0, -1.0), (10.0, 1999.6), (f64::NAN, 1.0)] {
        let error = camera().ray(&Vector2::new(u, v)).unwrap_err();
        assert!(matches!(error, PixelError::OutsideImage { .. }), "{error}");
    }
    assert!(camera().ray(&Vector2::new(-0.5, 1999.5)).is_ok());
}

#[test]
fn beyond_the_fold_there_is_an_error_and_no_wrong_ray() {
    // r (1 − 0.5 r²) rises to 0.5443 at r = 0.8165 and falls beyond. Larger pixels have no ray, and every pixel below
    // belongs to two rays; the inner one is seen.
    let lens = BrownConrady { k1: -0.5, ..BrownConrady::default() };
    assert!((lens.invertible_radius_squared() - 2.0 / 3.0).abs() < 1e-12);
    assert!(lens.undistort(&Vector2::new(0.545, 0.0)).is_none());
    for radius in [0.0, 0.3, 0.6, 0.8, 0.816] {
        for angle in [0.0_f64, 1.0, 2.5, 4.0] {
            let ideal = Vector2::new(angle.cos(), angle.sin()) * radius;
            let (back, _) = lens.undistort(&lens.distort(&ideal).0).unwrap();
            // Near the fold the inverse magnifies rounding by 1/(1 − 1.5 r²) ≈ 800 at 0.816, and by its root.
            assert!((back - ideal).norm() < 1e-9, "{radius} {angle} {back}");
        }
    }
    let camera =
        Camera { distortion: lens, size: [6000, 5000], centre: Vector2::new(3000.0, 2500.0), ..camera() };
    let error = camera.ray(&Vector2::new(5999.0, 2500.0)).unwrap_err();
    assert!(matches!(error, PixelError::NotInvertible { .. }), "{error}");
    // The forward map also rejects a point beyond the fold, instead of mapping it to another point's pixel.
    assert!(camera.project(&Vector3::new(0.9, 0.0, 1.0)).is_none());
}

#[test]
fn the_first_of_several_folds_counts() {
    // 1 + 3k₁s + 5k₂s² + 7k₃s³ = (1 − s)(1 − s/2)(1 − s/3): roots 1, 2 and 3.
    let lens = BrownConrady { k1: -11.0 / 18.0, k2: 1.0 / 5.0, k3: -1.0 / 42.0, ..BrownConrady::default() };
    assert!((lens.invertible_radius_squared() - 1.0).abs() < 1e-12);
    assert_eq!(BrownConrady::default().invertible_radius_squared(), f64::INFINITY);
}

/// The lens whose fold polynomial 1 + 3k₁s + 5k₂s² + 7k₃s³ is (1 − s/first)(1 + linear s + square s²).
fn folding_at(first: f64, linear: f64, square: f64) -> BrownConrady {
    BrownConrady {
        k1: (linear - 1.0 / first) / 3.0,
        k2: (square - linear / first) / 5.0,
        k3: -square / first / 7.0,
        ..BrownConrady::default()
    }
}

// At the fold the polynomial has terms of up to 120 and a slope of at least 0.0023 (the pair below is 0.3 off the axis, or a fifth off the fold):
// 120 × 4 eps / 0.0023 = 5e-11.
const ROOT: f64 = 1e-9;

proptest! {
    #[test]
    fn the_fold_is_the_first_root_wherever_the_others_lie(
        first in 0.2..3.0_f64, real in -3.0..3.0_f64, imaginary in 0.3..2.0_f64, further in 1.2..4.0_f64, negative in 0.2..5.0_f64,
    ) {
        // Cases: a pair of complex roots, which may turn the polynomial before the fold, a more distant root and a negative one, and two of each.
        let size = real * real + imaginary * imaginary;
        let (far, below) = (1.0 / (first * further), -1.0 / negative);
        for (linear, square) in
            [(-2.0 * real / size, 1.0 / size), (-far - below, far * below), (-far - 0.8 * far, 0.8 * far * far), (0.0, 0.0)]
        {
            let found = folding_at(first, linear, square).invertible_radius_squared();
            prop_assert!((found / first - 1.0).abs() < ROOT, "{} {} {}: {}", first, linear, square, found);
        }
    }
}
