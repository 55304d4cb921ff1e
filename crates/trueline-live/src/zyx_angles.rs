//! FANUC's W, P, R and KUKA's A, B, C: both rotate about z, then y, then x of the rotated frame; their letters are in
//! opposite order.

use nalgebra::{UnitQuaternion, Vector3};
use trueline_geometry::Pose;

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const MM: f64 = 1e-3;

/// `Rz(r)·Ry(p)·Rx(w)`: FANUC's W, P, R, deg.
#[must_use]
pub(crate) fn from_wpr_deg([w, p, r]: [f64; 3]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(w * DEGREE, p * DEGREE, r * DEGREE)
}

/// `Rz(a)·Ry(b)·Rx(c)`: KUKA's A, B, C, deg.
#[must_use]
pub(crate) fn from_abc_deg([a, b, c]: [f64; 3]) -> UnitQuaternion<f64> {
    from_wpr_deg([c, b, a])
}

/// FANUC's W, P, R of an attitude, deg.
#[must_use]
pub(crate) fn to_wpr_deg(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let (w, p, r) = rotation.euler_angles();
    [w, p, r].map(f64::to_degrees)
}

/// KUKA's A, B, C of an attitude, deg.
#[must_use]
pub(crate) fn to_abc_deg(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let [w, p, r] = to_wpr_deg(rotation);
    [r, p, w]
}

/// A pose from mm and an attitude; `None` if a figure is not finite.
pub(crate) fn pose_from_mm(position_mm: [f64; 3], rotation: UnitQuaternion<f64>) -> Option<Pose> {
    let finite = position_mm.iter().chain(rotation.coords.iter()).all(|figure| figure.is_finite());
    finite.then(|| Pose::from_parts((Vector3::from(position_mm) * MM).into(), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: A = 90° turns x to y; then B = 90° about the new y, which is base −x, takes the new x (base y) to base −z.
    #[test]
    fn the_letters_turn_about_the_axes_that_the_makers_say() {
        let near = |a: Vector3<f64>, b: [f64; 3]| (a - Vector3::from(b)).norm() < 1e-12;
        let a = from_abc_deg([90.0, 0.0, 0.0]);
        assert!(near(a * Vector3::x(), [0.0, 1.0, 0.0]));
        let ab = from_abc_deg([90.0, 90.0, 0.0]);
        assert!(near(ab * Vector3::x(), [0.0, 0.0, -1.0]) && near(ab * Vector3::y(), [-1.0, 0.0, 0.0]));
        let c = from_abc_deg([0.0, 0.0, 90.0]);
        assert!(near(c * Vector3::y(), [0.0, 0.0, 1.0]));
        assert!(from_wpr_deg([10.0, -20.0, 30.0]).angle_to(&from_abc_deg([30.0, -20.0, 10.0])) < 1e-12);
    }

    #[test]
    fn angles_come_back() {
        for angles in [[10.0, -20.0, 170.0], [-179.0, 45.0, 3.0], [180.0, 0.0, 0.0]] {
            let rotation = from_wpr_deg(angles);
            assert!(from_wpr_deg(to_wpr_deg(&rotation)).angle_to(&rotation) < 1e-9);
            assert!(from_abc_deg(to_abc_deg(&rotation)).angle_to(&rotation) < 1e-9);
        }
    }
}
