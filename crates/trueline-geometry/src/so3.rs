//! Rotations: exponential, logarithm and the Jacobian of the exponential.
//!
//! | symbol | code | meaning |
//! |---|---|---|
//! | ω | `rotation_vector` | axis times angle, rad |
//! | \[a\]× | `hat(a)` | skew matrix with `hat(a) * b = a × b` |
//! | Exp, Log | [`exp`], [`log`] | SO(3) ↔ R³ |
//! | V(ω) | [`left_jacobian`] | Exp(ω + δ) ≈ Exp(V(ω) δ) Exp(ω) |
//!
//! Source: \[Sola2018, Eqs. 132–145\].

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Angle (rad) below which the series of sin(x)/x and similar functions are exact to double precision with the terms used here: the first omitted
/// term is x⁶/5040 < 1e-15.
const SERIES_ANGLE: f64 = 5e-3;
/// Sine of half the angle below which the series of the logarithm is exact: the first omitted term is x¹²/13 < 3e-18.
const SERIES_SINE: f64 = 0.04;

/// Returns the skew matrix of `a`, so that `hat(a) * b = a × b`.
#[must_use]
pub fn hat(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// Exponential map: the rotation about `rotation_vector` by its length in radians.
///
/// ```
/// use nalgebra::Vector3;
/// use trueline_geometry::so3;
/// let quarter_turn = so3::exp(&Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
/// assert!((quarter_turn * Vector3::x() - Vector3::y()).norm() < 1e-15);
/// ```
#[must_use]
pub fn exp(rotation_vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    let angle = rotation_vector.norm();
    let half = 0.5 * angle;
    let sine_over_angle = if angle < SERIES_ANGLE {
        let h2 = half * half;
        0.5 * (1.0 - h2 / 6.0 * (1.0 - h2 / 20.0))
    } else {
        half.sin() / angle
    };
    let v = rotation_vector * sine_over_angle;
    UnitQuaternion::new_normalize(Quaternion::new(half.cos(), v.x, v.y, v.z))
}

/// Logarithm map: the rotation vector (rad, length at most π) of `rotation`.
///
/// At exactly half a turn the sign of the axis is arbitrary. Both signs are the same rotation.
#[must_use]
pub fn log(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let q = rotation.quaternion();
    // q and −q are the same rotation. The one with w ≥ 0 has an angle of at most half a turn.
    let (w, v) = if q.w < 0.0 { (-q.w, -q.imag()) } else { (q.w, q.imag()) };
    let sine2 = v.norm_squared();
    if sine2 < SERIES_SINE * SERIES_SINE {
        // 2 atan(s/w)/s = 2/w (1 − (s/w)²/3 + (s/w)⁴/5 − …)
        let inverse = w.recip();
        let x = sine2 * inverse * inverse;
        let series = 1.0 - x * (1.0 / 3.0 - x * (1.0 / 5.0 - x * (1.0 / 7.0 - x * (1.0 / 9.0 - x / 11.0))));
        return v * (2.0 * inverse * series);
    }
    let sine = sine2.sqrt();
    v * (2.0 * sine.atan2(w) / sine)
}

/// Left Jacobian V(ω) of the exponential: 3×3, `Exp(ω + δ) ≈ Exp(V(ω) δ) Exp(ω)` \[Sola2018, Eq. 145\].
///
/// It also maps the `rho` of an se(3) logarithm to a translation.
#[must_use]
pub fn left_jacobian(rotation_vector: &Vector3<f64>) -> Matrix3<f64> {
    let angle = rotation_vector.norm();
    let angle2 = angle * angle;
    let (a, b) = if angle < 1e-2 {
        // (1 − cos x)/x² and (x − sin x)/x³; the first omitted terms are x⁶/40320 and x⁶/362880.
        (0.5 - angle2 / 24.0 + angle2 * angle2 / 720.0, 1.0 / 6.0 - angle2 / 120.0 + angle2 * angle2 / 5040.0)
    } else {
        ((1.0 - angle.cos()) / angle2, (angle - angle.sin()) / (angle2 * angle))
    };
    let w = hat(rotation_vector);
    Matrix3::identity() + w * a + w * w * b
}

/// Inverse of [`left_jacobian`]: `Log(Exp(δ) Exp(ω)) ≈ ω + V⁻¹(ω) δ` \[Sola2018, Eq. 146\].
#[must_use]
pub fn left_jacobian_inverse(rotation_vector: &Vector3<f64>) -> Matrix3<f64> {
    let angle2 = rotation_vector.norm_squared();
    let c = if angle2 < 1e-2 {
        1.0 / 12.0 + angle2 / 720.0 + angle2 * angle2 / 30240.0 + angle2.powi(3) / 1_209_600.0
    } else {
        let half = 0.5 * angle2.sqrt();
        (1.0 - half / half.tan()) / angle2
    };
    let w = hat(rotation_vector);
    Matrix3::identity() - w * 0.5 + w * w * c
}

/// The 24 rotations of the cube onto itself: an even cover of all attitudes, with no attitude more than 62.8° away.
///
/// A search without prior knowledge begins there; they are deterministic, unlike random rotations.
#[must_use]
pub fn cube_rotations() -> Vec<UnitQuaternion<f64>> {
    use std::f64::consts::FRAC_PI_2;
    let faces = [
        UnitQuaternion::identity(),
        exp(&Vector3::new(FRAC_PI_2, 0.0, 0.0)),
        exp(&Vector3::new(-FRAC_PI_2, 0.0, 0.0)),
        exp(&Vector3::new(2.0 * FRAC_PI_2, 0.0, 0.0)),
        exp(&Vector3::new(0.0, FRAC_PI_2, 0.0)),
        exp(&Vector3::new(0.0, -FRAC_PI_2, 0.0)),
    ];
    let turns = (0..4).map(|k| exp(&Vector3::new(0.0, 0.0, f64::from(k) * FRAC_PI_2)));
    turns.flat_map(|turn| faces.map(|face| face * turn)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cube_rotations_are_24_different_ones() {
        let all = cube_rotations();
        assert_eq!(all.len(), 24);
        for (i, a) in all.iter().enumerate() {
            for b in &all[i + 1..] {
                // The two nearest elements of the group are a quarter turn apart.
                assert!(a.angle_to(b) > 1.5, "{a} {b}");
            }
        }
    }

    #[test]
    fn left_jacobian_and_inverse_agree_on_both_sides_of_the_series_limit() {
        for angle in [0.0, 1e-9, 0.99e-2, 1.01e-2, 0.099, 0.101, 1.0, 3.1] {
            let w = Vector3::new(0.6, -0.48, 0.64) * angle;
            let product = left_jacobian(&w) * left_jacobian_inverse(&w);
            // Two 3×3 matrices with entries of O(1): rounding of a few eps. The series errors are below 1e-15.
            assert!((product - Matrix3::identity()).norm() < 1e-13, "angle {angle}");
        }
    }
}
