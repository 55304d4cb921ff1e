//! A frame with its weight: the most likely pose of the sensor, and the whitener of its residuals.

use crate::input::observations::Observations;
use crate::stripe::frame_residual::{FrameGradients, FrameResidual, ROWS, placement};
use crate::stripe::frames::StripeFrame;
use crate::stripe::state::StripeState;
use nalgebra::{SMatrix, SVector, Vector3};
use trueline_geometry::so3;
use trueline_model::Placement;

/// Common errors estimated from the residuals of a frame.
///
/// A derivative that shares an error with the residual is biased if little else varies it, as in every errors-in-variables problem. The foot of a
/// stripe is free of the stripe's own error. At the reported pose it contains the robot's error. Derivatives are therefore taken at the robot's most
/// likely pose, and the residual at the reported pose.
#[derive(Clone, Copy, Debug)]
pub struct PoseError {
    /// Reported minus most likely true position, base frame, m.
    pub shift_m: Vector3<f64>,
    /// Reported minus most likely true attitude, a rotation vector about the axes of base, rad.
    pub turn_rad: Vector3<f64>,
    /// Added to the frame's stamp before the robot's pose is interpolated, s.
    pub late_s: f64,
    /// Their effect on the residuals, m.
    pub in_residual: SVector<f64, ROWS>,
}

impl PoseError {
    /// No error.
    pub const NONE: Self = Self {
        shift_m: Vector3::new(0.0, 0.0, 0.0),
        turn_rad: Vector3::new(0.0, 0.0, 0.0),
        late_s: 0.0,
        in_residual: SVector::<f64, ROWS>::new(0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// The sensor's pose with these errors removed. `None` as for [`placement`].
    #[must_use]
    pub(crate) fn placement(
        &self,
        observations: &Observations,
        stamp_s: f64,
        at: &StripeState,
    ) -> Option<Placement> {
        let mut placement = placement(observations, stamp_s + self.late_s, at)?;
        let robot = &mut placement.base_from_tool;
        robot.translation.vector -= self.shift_m;
        robot.rotation = so3::exp(&-self.turn_rad) * robot.rotation;
        Some(placement)
    }
}

/// A frame with its whitener. Rows of weight 0 are zero.
#[derive(Clone, Copy, Debug)]
pub struct WeighedFrame {
    /// The frame.
    pub frame: StripeFrame,
    /// W with W Σ Wᵀ = 1 over the rows used.
    pub whitener: SMatrix<f64, ROWS, ROWS>,
    /// Number of rows used.
    pub rows: usize,
    /// Estimated error of the reported pose.
    pub pose_error: PoseError,
}

impl WeighedFrame {
    /// The most likely pose of the sensor. `None` as for [`placement`].
    #[must_use]
    pub fn placement(&self, observations: &Observations, at: &StripeState) -> Option<Placement> {
        self.pose_error.placement(observations, self.frame.stamp_s, at)
    }

    /// Whitened residuals and their gradients at the most likely pose.
    pub(crate) fn whitened(
        &self,
        (parts, gradients): &(FrameResidual, FrameGradients),
    ) -> (SVector<f64, ROWS>, FrameGradients) {
        (self.whitener * self.residual(parts), gradients * self.whitener.transpose())
    }

    /// The residuals of the reported pose.
    pub(crate) fn residual(&self, parts: &FrameResidual) -> SVector<f64, ROWS> {
        parts.residual + self.pose_error.in_residual
    }
}
