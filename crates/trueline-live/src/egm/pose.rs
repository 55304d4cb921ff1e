//! Poses as EGM writes them: millimetres, and an attitude in one of two forms.

use super::messages::{EgmCartesian, EgmEuler, EgmPose, EgmQuaternion};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use trueline_geometry::Pose;

/// Why an `EgmPose` is not a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PoseError {
    /// No position, no attitude in either form, or a coordinate of one left out.
    #[error("position or attitude is missing, or not whole")]
    Missing,
    /// Not a number, or infinite.
    #[error("a coordinate is not finite")]
    NotFinite,
    /// A quaternion that is not a rotation.
    #[error("the quaternion does not have length 1")]
    NotUnit,
}

/// A quaternion may be this far from length 1: RobotWare sends at least six digits, others round more.
const NORM_TOLERANCE: f64 = 1e-3;

/// Largest difference of two forms of one attitude without a report, rad: printed digits explain no more.
pub(crate) const ATTITUDES_AGREE_RAD: f64 = 1e-4;

impl EgmPose {
    /// Both forms of the attitude, as RobotWare sends them.
    #[must_use]
    pub fn full(pose: &Pose) -> Self {
        let (roll, pitch, yaw) = pose.rotation.euler_angles();
        let [x, y, z] = [roll, pitch, yaw].map(|angle| Some(angle.to_degrees()));
        Self { euler: Some(EgmEuler { x, y, z }), ..Self::with_quaternion(pose) }
    }

    /// Position and quaternion: unlike Euler angles, these have one meaning for every receiver.
    #[must_use]
    pub fn with_quaternion(pose: &Pose) -> Self {
        let [x, y, z] = <[f64; 3]>::from(pose.translation.vector * 1e3).map(Some);
        let q = pose.rotation.quaternion();
        let [u0, u1, u2, u3] = [q.w, q.i, q.j, q.k].map(Some);
        Self {
            pos: Some(EgmCartesian { x, y, z }),
            orient: Some(EgmQuaternion { u0, u1, u2, u3 }),
            euler: None,
        }
    }

    /// The pose, m. If a message has both forms of the attitude, Euler angles count, as the protocol requires. Both
    /// must be valid.
    ///
    /// # Errors
    /// Missing or invalid fields.
    pub fn pose(&self) -> Result<Pose, PoseError> {
        let EgmCartesian { x, y, z } = self.pos.ok_or(PoseError::Missing)?;
        let position_mm = whole([x, y, z])?;
        let by_quaternion = self.orient.map(rotation_of).transpose()?;
        let by_euler = self.euler.map(rotation_of_euler).transpose()?;
        let rotation = by_euler.or(by_quaternion).ok_or(PoseError::Missing)?;
        Ok(Pose::from_parts((Vector3::from(position_mm) * 1e-3).into(), rotation))
    }

    /// Whether there are two attitudes and they differ by more than their digits.
    #[must_use]
    pub(crate) fn contradicts_itself(&self) -> bool {
        let (Some(Ok(q)), Some(Ok(e))) = (self.orient.map(rotation_of), self.euler.map(rotation_of_euler))
        else {
            return false;
        };
        q.angle_to(&e) > ATTITUDES_AGREE_RAD
    }
}

/// Coordinates that are all there, and numbers.
fn whole<const N: usize>(coordinates: [Option<f64>; N]) -> Result<[f64; N], PoseError> {
    if coordinates.contains(&None) {
        return Err(PoseError::Missing);
    }
    let whole = coordinates.map(|coordinate| coordinate.unwrap_or(f64::NAN));
    if whole.iter().all(|v| v.is_finite()) { Ok(whole) } else { Err(PoseError::NotFinite) }
}

fn rotation_of(EgmQuaternion { u0, u1, u2, u3 }: EgmQuaternion) -> Result<UnitQuaternion<f64>, PoseError> {
    let [w, x, y, z] = whole([u0, u1, u2, u3])?;
    let quaternion = Quaternion::new(w, x, y, z);
    if (quaternion.norm() - 1.0).abs() > NORM_TOLERANCE {
        return Err(PoseError::NotUnit);
    }
    Ok(UnitQuaternion::new_normalize(quaternion))
}

fn rotation_of_euler(EgmEuler { x, y, z }: EgmEuler) -> Result<UnitQuaternion<f64>, PoseError> {
    let [x, y, z] = whole([x, y, z])?.map(f64::to_radians);
    Ok(UnitQuaternion::from_euler_angles(x, y, z))
}
