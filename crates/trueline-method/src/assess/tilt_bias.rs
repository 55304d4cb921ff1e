//! A detector whose point moves with the tilt: how far, in the sheet, for each pixel per 10° of tilt.
//!
//! It is a vector of the picture for each of the three axes of tilt: six numbers. Bias that grows with the tilt is nearly a
//! shift of the hand-eye transform; a scan shows it only as far as its tilts have another pattern than that.

use crate::input::observations::Observation;
use crate::problem::parameters::Parameters;
use nalgebra::{SMatrix, UnitQuaternion, Vector3};
use trueline_geometry::{Pose, so3};
use trueline_model::Placement;

/// Numbers of a bias: along and across the picture's rows for each axis of tilt.
pub const BIAS: usize = 6;
/// The tilt that a bias is stated for, rad.
pub const BIAS_TILT_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Noise of a feature that a bias in pixels is compared with where features are lengths, px.
const USUAL_SIGMA_PX: f64 = 0.3;

/// Tilts are counted from the mean attitude of a scan.
#[derive(Clone, Copy, Debug)]
pub struct TiltBias {
    mean: UnitQuaternion<f64>,
}

impl TiltBias {
    /// About the mean of these poses, `base_from_tool`.
    #[must_use]
    pub fn about(poses: &[Pose]) -> Self {
        let Some(first) = poses.first() else { return Self { mean: UnitQuaternion::identity() } };
        let turns = poses.iter().map(|pose| so3::log(&(first.rotation.inverse() * pose.rotation)));
        Self { mean: first.rotation * so3::exp(&(turns.sum::<Vector3<f64>>() / poses.len() as f64)) }
    }

    /// How far the feature moves in the sheet, m, for each number of the bias, px per 10°: two for the tilt about the
    /// camera's x, two about its y, two about its z.
    #[must_use]
    pub fn slopes(&self, o: &Observation, at: &Parameters, placement: &Placement) -> SMatrix<f64, 2, BIAS> {
        let in_sensor = self.in_sensor(&at.tool_from_camera, placement);
        let by_px = sheet_per_px(o);
        let mut slopes = SMatrix::<f64, 2, BIAS>::zeros();
        for axis in 0..3 {
            slopes.fixed_columns_mut::<2>(2 * axis).copy_from(&(by_px * in_sensor[axis]));
        }
        slopes
    }

    /// The tilt about the camera's axes, in units of that for which a bias is stated.
    #[must_use]
    pub fn in_sensor(&self, tool_from_camera: &Pose, placement: &Placement) -> Vector3<f64> {
        let tilt = so3::log(&(self.mean.inverse() * placement.base_from_tool.rotation));
        tool_from_camera.rotation.inverse() * tilt / BIAS_TILT_RAD
    }
}

/// How far a pixel is in the sheet, m, along the picture's rows and across them: the root of the feature's covariance over
/// its noise in pixels. The sheet's first axis is the camera's x in it, so a step along a row moves along that axis alone,
/// and the root is the upper triangular one; where the sheet is turned about the view, it is off by that small turn. Of
/// sensors that report lengths, what their noise would be.
#[must_use]
pub fn sheet_per_px(o: &Observation) -> SMatrix<f64, 2, 2> {
    let sigma_px = if o.sigma_px > 0.0 { f64::from(o.sigma_px) } else { USUAL_SIGMA_PX };
    let [xx, xy, yy] = o.covariance;
    let depth = yy.sqrt();
    let beside = if depth > 0.0 { xy / depth } else { 0.0 };
    SMatrix::<f64, 2, 2>::new((xx - beside * beside).max(0.0).sqrt(), beside, 0.0, depth) / sigma_px
}
