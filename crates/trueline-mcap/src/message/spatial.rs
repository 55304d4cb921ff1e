//! Poses and names of frames as other programs write them.

use crate::message::content_error::ContentError;
use nalgebra::Vector3;
use trueline_dataset::Problem;
use trueline_dataset::robot_csv::unit_quaternion;
use trueline_geometry::{Pose, se3};

/// A pose from a position (m) and a quaternion in the order x, y, z, w.
///
/// # Errors
/// Numbers that are not finite, or a quaternion that is not a rotation.
pub(crate) fn pose_of(position: [f64; 3], xyzw: [f64; 4]) -> Result<Pose, ContentError> {
    if !position.iter().all(|v| v.is_finite()) {
        return Err(ContentError::NotFinite { field: "the position" });
    }
    let [x, y, z, w] = xyzw;
    let rotation = unit_quaternion([w, x, y, z]).map_err(|problem| match problem {
        Problem::QuaternionNotUnit { norm } => ContentError::QuaternionNotUnit { norm },
        _ => ContentError::NotFinite { field: "the rotation" },
    })?;
    Ok(se3::from_parts(rotation, Vector3::from(position)))
}

/// The name of a frame. Old ROS wrote `/base` where new ROS writes `base`.
#[must_use]
pub(crate) fn frame_name(name: &str) -> String {
    name.strip_prefix('/').unwrap_or(name).to_owned()
}
