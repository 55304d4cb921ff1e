//! Rigid transforms: se(3) exponential and logarithm, and the solver's perturbation.

use crate::{Pose, so3};
use nalgebra::{Translation3, UnitQuaternion, Vector3};

/// Builds `a_from_b` from the rotation and the origin of b in a (m).
#[must_use]
pub fn from_parts(rotation: UnitQuaternion<f64>, translation: Vector3<f64>) -> Pose {
    Pose::from_parts(Translation3::from(translation), rotation)
}

/// Exponential of se(3): rotation Exp(ω), translation V(ω) ρ \[Sola2018, Eq. 172\].
///
/// `rho` is not the translation. Reading it as one is a common mistake. Both agree only for zero rotation.
#[must_use]
pub fn exp(rotation_vector: &Vector3<f64>, rho: &Vector3<f64>) -> Pose {
    from_parts(so3::exp(rotation_vector), so3::left_jacobian(rotation_vector) * rho)
}

/// Logarithm of SE(3): (ω, ρ) with `exp(ω, ρ) = pose`.
#[must_use]
pub fn log(pose: &Pose) -> (Vector3<f64>, Vector3<f64>) {
    let rotation_vector = so3::log(&pose.rotation);
    let rho = so3::left_jacobian_inverse(&rotation_vector) * pose.translation.vector;
    (rotation_vector, rho)
}

/// Perturbs rotation and translation separately, R ← Exp(δ) R and t ← t + δt \[Yang2025, Eq. 18\].
///
/// This is not the exponential of SE(3). The two parts do not mix, so covariances are those of rotation and
/// translation in the usual sense.
#[must_use]
pub fn retract_decoupled(pose: &Pose, rotation: &Vector3<f64>, translation: &Vector3<f64>) -> Pose {
    from_parts(so3::exp(rotation) * pose.rotation, pose.translation.vector + translation)
}

/// The inverse of [`retract_decoupled`]: (δ, δt) from `from` to `to`.
#[must_use]
pub fn difference_decoupled(to: &Pose, from: &Pose) -> (Vector3<f64>, Vector3<f64>) {
    (so3::log(&(to.rotation * from.rotation.inverse())), to.translation.vector - from.translation.vector)
}
