//! Joints that yield to the weight of their load, and to its acceleration.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use nalgebra::Vector3;
use trueline_geometry::arm::six_axes::{AXES, Arm};

/// Acceleration of free fall, m/s².
const GRAVITY: f64 = 9.81;
/// A joint yields by the drawn size at this distance from the load, m.
const STATED_AT_M: f64 = 1.0;

/// Deflection of each joint, rad: the moment of the flange's load about its axis, in weights times metres.
pub(crate) fn yielding(
    errors: &DrawnErrors,
    arm: &Arm,
    angles: &[f64; AXES],
    acceleration: &Vector3<f64>,
) -> [f64; AXES] {
    let Some(size_m) = errors.size(ShopError::Sag) else { return [0.0; AXES] };
    let state = arm.state(angles);
    let load = (Vector3::new(0.0, 0.0, -GRAVITY) - acceleration) / GRAVITY;
    let tip = state.base_from_flange.translation.vector;
    std::array::from_fn(|k| {
        let lever = tip - state.base_from_joint[k].translation.vector;
        size_m / (STATED_AT_M * STATED_AT_M) * state.axes[k].dot(&lever.cross(&load))
    })
}
