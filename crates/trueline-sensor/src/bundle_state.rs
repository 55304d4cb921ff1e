//! The unknowns of the joint fit: those that all pictures share, and each picture's own.

use crate::board::{Board, FoundCorner};
use crate::projection::{CAMERA_SIZE, project_from_board};
use crate::sheet::{SHEET_SIZE, SheetShape};
use nalgebra::{SVector, Vector2};
use trueline_geometry::{Plane, Pose};
use trueline_model::Camera;

/// Unknowns of the sensor: nine of the camera, three of the plane.
pub const SENSOR_SIZE: usize = CAMERA_SIZE + 3;

/// Unknowns that all pictures share: the sensor's, then those of the board's sheet.
pub const SHARED_SIZE: usize = SENSOR_SIZE + SHEET_SIZE;

/// Unknowns of one picture: six of the pose, two of the flatness.
pub(crate) const PICTURE_SIZE: usize = 8;

/// Camera, plane, and each picture's own unknowns.
#[derive(Clone, Debug)]
pub struct BundleState {
    /// The camera.
    pub camera: Camera,
    /// The laser plane in the camera frame; `None` without a stripe to measure it.
    pub laser_plane_in_camera: Option<Plane>,
    /// The shape of the board's sheet, the same in all pictures.
    pub sheet: SheetShape,
    /// For each picture, pose and flatness of its board.
    pub boards: Vec<BoardState>,
}

impl BundleState {
    /// Predicted pixel of a board's corner; `None` behind the camera.
    pub(crate) fn pixel_of(
        &self,
        board: &Board,
        camera_from_board: &Pose,
        corner: &FoundCorner,
    ) -> Option<Vector2<f64>> {
        let (point, _) = self.sheet.corner(board, corner.column, corner.row);
        Some(project_from_board(&self.camera, camera_from_board, &point)?.pixel)
    }
}

/// Unknowns of one picture's board.
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
