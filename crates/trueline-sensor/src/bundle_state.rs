//! The unknowns of the joint fit: what all pictures share, and what is each picture's own.

use crate::projection::CAMERA_SIZE;
use nalgebra::SVector;
use trueline_geometry::{Plane, Pose};
use trueline_model::Camera;

/// Unknowns that all pictures share: nine of the camera, three of the plane.
pub const SHARED_SIZE: usize = CAMERA_SIZE + 3;

/// Unknowns of one picture: six of the pose, two of the flatness.
pub(crate) const PICTURE_SIZE: usize = 8;

/// Camera, plane, and each picture's own unknowns.
#[derive(Clone, Debug)]
pub struct BundleState {
    /// The camera.
    pub camera: Camera,
    /// The laser plane in the camera frame; `None` where there is no stripe to measure it.
    pub laser_plane_in_camera: Option<Plane>,
    /// For each picture, pose and flatness of its board.
    pub boards: Vec<BoardState>,
}

/// What one picture's board is like.
#[derive(Clone, Copy, Debug)]
pub struct BoardState {
    /// `camera_from_board`.
    pub camera_from_board: Pose,
    /// Offset of the board's surface at the stripe from its plane, m.
    pub bulge_m: f64,
    /// Change of that offset along the stripe, per metre.
    pub twist: f64,
}

impl BoardState {
    /// A board as flat as can be.
    #[must_use]
    pub fn flat(camera_from_board: Pose) -> Self {
        Self { camera_from_board, bulge_m: 0.0, twist: 0.0 }
    }

    /// The state after a step of the picture's own unknowns.
    pub(crate) fn moved(&self, step: &SVector<f64, PICTURE_SIZE>) -> Self {
        let (rotation, translation) = (step.fixed_rows::<3>(0).into(), step.fixed_rows::<3>(3).into());
        Self {
            camera_from_board: trueline_geometry::se3::retract_decoupled(
                &self.camera_from_board,
                &rotation,
                &translation,
            ),
            bulge_m: self.bulge_m + step[6],
            twist: self.twist + step[7],
        }
    }
}
