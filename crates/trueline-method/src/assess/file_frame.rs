//! The hand-eye transform of a sensor file.
//!
//! The estimate corrects the sensor's sheet by a shape, so its transform belongs to the corrected sensor. A user of the sensor file needs the
//! transform of the frame in which that file places points:
//!
//! ```text
//! tool_from_file = tool_from_camera · P(h),  δω′ = δω + R D_ω δh,  δt′ = δt + δω × (R p) + R D_t δh
//! ```
//!
//! with P = camera_from_file, p its translation, D its derivative by the shape h. For the stated file P is the rigid motion nearest to the
//! correction over the visited field. For a corrected camera P is the rigid motion that its seven numbers do not represent.

use crate::assess::seam_error::visited_field;
use crate::input::observations::Observations;
use crate::problem::parameters::{Parameters, ROTATION, TRANSLATION};
use nalgebra::{DMatrix, SMatrix};
use trueline_geometry::{Pose, so3};
use trueline_model::{LaserSheet, RigidPart, SheetField};

/// The frame in which a sensor file places points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileFrame {
    /// Maps its coordinates to those of the estimate's frame.
    pub camera_from_file: Pose,
    /// Derivative of its left rotation and translation by h.
    pub d_shape: SMatrix<f64, 6, 5>,
}

/// The sensor as its file states it, without a correction.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedSensor {
    /// Its frame.
    pub frame: FileFrame,
    /// The sheet that defines the coordinates of field and motion.
    pub sheet: LaserSheet,
    /// The field that the scan visited.
    pub field: SheetField,
    /// The rigid part of the correction over that field, which the frame contains.
    pub rigid: RigidPart,
    /// The remaining part: RMS over the field, m.
    pub remains_m: f64,
}

impl FileFrame {
    /// The frame of the estimate itself: for a file that stores the shape, or without a correction.
    #[must_use]
    pub fn of_estimate() -> Self {
        Self { camera_from_file: Pose::identity(), d_shape: SMatrix::zeros() }
    }
}

impl StatedSensor {
    /// From a solution with a shape. `None` without one, or if nothing was visible.
    #[must_use]
    pub fn of(observations: &Observations, at: &Parameters) -> Option<Self> {
        let field = visited_field(observations, &observations.list)?;
        let (sheet, found) = (observations.sheet, field.rigid_part(&at.shape?)?);
        let frame =
            FileFrame { camera_from_file: found.part.in_camera(&sheet), d_shape: found.d_in_camera(&sheet) };
        Some(Self { frame, sheet, field, rigid: found.part, remains_m: found.remains_m })
    }

    /// The frame of the stated file for another answer to the same scan, with another shape.
    #[must_use]
    pub fn frame_by(&self, other: &Parameters) -> FileFrame {
        let rigid = other.shape.and_then(|shape| self.field.rigid_part(&shape));
        rigid.map_or_else(FileFrame::of_estimate, |found| FileFrame {
            camera_from_file: found.part.in_camera(&self.sheet),
            d_shape: found.d_in_camera(&self.sheet),
        })
    }
}

/// A hand-eye transform, and covariances of all unknowns with this transform.
#[derive(Clone, Debug)]
pub struct HandEyeOfFile {
    /// The frame from which it maps.
    pub frame: FileFrame,
    /// Maps the file's camera coordinates to tool coordinates, m.
    pub tool_from_camera: Pose,
    /// Total covariance, SI.
    pub covariance: DMatrix<f64>,
    /// Its random part.
    pub noise_covariance: DMatrix<f64>,
    /// How its numbers follow those of the answer.
    pub slope: DMatrix<f64>,
}

impl HandEyeOfFile {
    /// From an answer and its covariances, in a frame.
    #[must_use]
    pub fn of(
        frame: FileFrame,
        at: &Parameters,
        covariance: &DMatrix<f64>,
        noise_covariance: &DMatrix<f64>,
    ) -> Self {
        let turn = at.tool_from_camera.rotation.to_rotation_matrix().into_inner();
        let mut slope = DMatrix::identity(covariance.nrows(), covariance.ncols());
        let lever = so3::hat(&(turn * frame.camera_from_file.translation.vector));
        slope.view_mut((TRANSLATION, ROTATION), (3, 3)).copy_from(&-lever);
        if at.shape.is_some() {
            let first = at.unknowns().shape().start;
            let [d_turn, d_shift] = [0, 3].map(|row| turn * frame.d_shape.fixed_rows::<3>(row));
            slope.view_mut((ROTATION, first), (3, 5)).copy_from(&d_turn);
            slope.view_mut((TRANSLATION, first), (3, 5)).copy_from(&d_shift);
        }
        let carried = |covariance: &DMatrix<f64>| &slope * covariance * slope.transpose();
        Self {
            frame,
            tool_from_camera: at.tool_from_camera * frame.camera_from_file,
            covariance: carried(covariance),
            noise_covariance: carried(noise_covariance),
            slope,
        }
    }
}
