//! Rotations as three angles: successive rotations about named axes, as robots write them.
//!
//! | robot | angles | sequence |
//! |---|---|---|
//! | KUKA, Nachi, Epson; ABB's EulerZYX | A B C | z, y', x'' (intrinsic) |
//! | FANUC, Yaskawa, Denso, Omron; URDF's rpy | W P R; Rx Ry Rz; roll pitch yaw | x, y, z (fixed) |
//! | Stäubli | Rx Ry Rz | x, y', z'' (intrinsic) |
//! | Kawasaki, Comau, Doosan | O A T; A B C | z, y', z'' (intrinsic) |
//!
//! Rotations about fixed axes equal the rotations in reverse order about the moving axes.

use nalgebra::{Matrix3, UnitQuaternion, UnitVector3, Vector3};
use std::fmt;
use std::str::FromStr;

/// Below this cosine (or sine, if first and last axis agree) of the middle angle only the sum or the
/// difference of the other two is defined. The last one is then zero. Rounding in a rotation matrix, 1e-16,
/// moves the others by 1e-7 rad at most there.
const SINGULAR: f64 = 1e-9;

/// Three axes, and whether they move with the rotations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EulerSequence {
    /// Index of each rotation's axis: 0 = x, 1 = y, 2 = z. Neighbours differ.
    axes: [usize; 3],
    intrinsic: bool,
}

/// z, then the new y, then the new x: KUKA's A B C.
pub const ZYX_INTRINSIC: EulerSequence = EulerSequence { axes: [2, 1, 0], intrinsic: true };
/// Fixed x, then fixed y, then fixed z: FANUC's W P R, Yaskawa's Rx Ry Rz, URDF's roll, pitch, yaw.
pub const XYZ_FIXED: EulerSequence = EulerSequence { axes: [0, 1, 2], intrinsic: false };
/// x, then the new y, then the new z: Stäubli's Rx Ry Rz.
pub const XYZ_INTRINSIC: EulerSequence = EulerSequence { axes: [0, 1, 2], intrinsic: true };
/// z, then the new y, then the new z: Kawasaki's O A T.
pub const ZYZ_INTRINSIC: EulerSequence = EulerSequence { axes: [2, 1, 2], intrinsic: true };

impl EulerSequence {
    /// The rotation from three angles, rad, in the order of the sequence's name.
    #[must_use]
    pub fn rotation(&self, angles_rad: [f64; 3]) -> UnitQuaternion<f64> {
        let turns: [UnitQuaternion<f64>; 3] =
            std::array::from_fn(|k| UnitQuaternion::from_axis_angle(&axis(self.axes[k]), angles_rad[k]));
        if self.intrinsic { turns[0] * turns[1] * turns[2] } else { turns[2] * turns[1] * turns[0] }
    }

    /// The three angles of a rotation, rad, in the order of the sequence's name. The middle one is in \[−π/2, π/2\], or in \[0, π\] if the first and
    /// the last axis are equal.
    #[must_use]
    pub fn angles(&self, rotation: &UnitQuaternion<f64>) -> [f64; 3] {
        let matrix = rotation.to_rotation_matrix().into_inner();
        if self.intrinsic {
            return intrinsic_angles(self.axes, &matrix);
        }
        let [a, b, c] = self.axes;
        let [last, middle, first] = intrinsic_angles([c, b, a], &matrix);
        [first, middle, last]
    }
}

/// Angles of R = R_i(a) R_j(b) R_k(c), from the elements of the product written out.
fn intrinsic_angles([i, j, last]: [usize; 3], r: &Matrix3<f64>) -> [f64; 3] {
    let k = 3 - i - j;
    // +1 if i, j, k is x, y, z or a cyclic permutation of it, else −1.
    let sign = if (i + 1) % 3 == j { 1.0 } else { -1.0 };
    let level = r[(i, j)].hypot(if last == i { r[(i, k)] } else { r[(i, i)] });
    let middle = if last == i { level.atan2(r[(i, i)]) } else { (sign * r[(i, k)]).atan2(level) };
    if level < SINGULAR {
        return [(sign * r[(k, j)]).atan2(r[(j, j)]), middle, 0.0];
    }
    if last == i {
        let first = r[(j, i)].atan2(-sign * r[(k, i)]);
        return [first, middle, r[(i, j)].atan2(sign * r[(i, k)])];
    }
    let first = (-sign * r[(j, k)]).atan2(r[(k, k)]);
    [first, middle, (-sign * r[(i, j)]).atan2(r[(i, i)])]
}

fn axis(index: usize) -> UnitVector3<f64> {
    match index {
        0 => Vector3::x_axis(),
        1 => Vector3::y_axis(),
        _ => Vector3::z_axis(),
    }
}

/// `zyx-intrinsic`, `xyz-fixed`, …
impl fmt::Display for EulerSequence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let letters: String = self.axes.iter().map(|&k| ['x', 'y', 'z'][k]).collect();
        write!(f, "{letters}-{}", if self.intrinsic { "intrinsic" } else { "fixed" })
    }
}

/// The error of a text that is no sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoSequence;

impl fmt::Display for NoSequence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("expected three of x, y, z and -intrinsic or -fixed, for example zyx-intrinsic")
    }
}

impl std::error::Error for NoSequence {}

impl FromStr for EulerSequence {
    type Err = NoSequence;

    /// Reads `zyx-intrinsic`, `xyz-fixed` or `xyz-extrinsic`; there is no default for the motion of the axes.
    fn from_str(text: &str) -> Result<Self, NoSequence> {
        let (letters, kind) = text.split_once(['-', '_']).ok_or(NoSequence)?;
        let intrinsic = match kind {
            "intrinsic" => true,
            "fixed" | "extrinsic" => false,
            _ => return Err(NoSequence),
        };
        let found: Vec<usize> = letters.chars().filter_map(|letter| "xyz".find(letter)).collect();
        let axes: [usize; 3] = found.try_into().map_err(|_| NoSequence)?;
        if letters.len() != 3 || axes[0] == axes[1] || axes[1] == axes[2] {
            return Err(NoSequence);
        }
        Ok(Self { axes, intrinsic })
    }
}
