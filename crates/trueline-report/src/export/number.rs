//! Numbers as controllers read them: fixed digits, no negative zero.
//!
//! A length has six decimals of a millimetre, an angle nine of a degree, a quaternion twelve: rounding moves a point at 1 m
//! by less than 1e-9 m.

use nalgebra::UnitQuaternion;

/// A number with `decimals` decimals; zero has no sign.
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.bytes().all(|byte| matches!(byte, b'-' | b'.' | b'0'));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// Millimetres.
pub(crate) fn mm(value_mm: f64) -> String {
    fixed(value_mm, 6)
}

/// Metres.
pub(crate) fn m(value_m: f64) -> String {
    fixed(value_m, 9)
}

/// Degrees from radians.
pub(crate) fn deg(angle_rad: f64) -> String {
    fixed(angle_rad.to_degrees(), 9)
}

/// A number without a unit, or an angle in radians.
pub(crate) fn unit(value: f64) -> String {
    fixed(value, 12)
}

/// w, x, y, z with w ≥ 0: of the two quaternions that mean a rotation always the same one.
pub(crate) fn wxyz(rotation: &UnitQuaternion<f64>) -> [f64; 4] {
    let q = rotation.quaternion();
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    [q.w, q.i, q.j, q.k].map(|x| x * sign)
}
