//! A sighting of a target in the joint estimate: its pose and covariance.

use crate::projection::CAMERA_SIZE;
use nalgebra::{Matrix6, SMatrix, Vector6};
use trueline_geometry::Pose;

/// The pose of a target as a camera, or a tracker, reports it.
pub trait Sighting {
    /// `camera_from_target`.
    fn camera_from_target(&self) -> &Pose;

    /// Covariance of (δ, δt) of it, perturbed on the left, in the camera's axes, rad² and m².
    fn covariance(&self) -> &Matrix6<f64>;

    /// Its derivative by the camera's parameters fx … k3; `None` if there is no camera with errors.
    fn d_camera(&self) -> Option<&SMatrix<f64, 6, CAMERA_SIZE>> {
        None
    }
}

/// A pose that somebody else's detector or tracker reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReportedPose {
    /// `camera_from_target`.
    pub camera_from_target: Pose,
    /// Standard deviation per axis of its rotation (rad) and of its translation (m), if stated.
    pub sigma: Option<[f64; 2]>,
}

/// A pose with its covariance, stated or estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseSighting {
    /// `camera_from_target`.
    pub camera_from_target: Pose,
    /// Covariance of (δ, δt) of it, perturbed on the left, in the camera's axes, rad² and m².
    pub covariance: Matrix6<f64>,
}

impl PoseSighting {
    /// A reported pose with its own standard deviations, or else those of `otherwise`: of the rotation about each axis of
    /// the camera (rad), then of the translation along each (m).
    #[must_use]
    pub fn of(reported: &ReportedPose, otherwise: &Vector6<f64>) -> Self {
        let [turn, shift] = reported.sigma.unwrap_or_default();
        let stated = Vector6::new(turn, turn, turn, shift, shift, shift);
        let sigma = if reported.sigma.is_some() { &stated } else { otherwise };
        Self {
            camera_from_target: reported.camera_from_target,
            covariance: Matrix6::from_diagonal(&sigma.component_mul(sigma)),
        }
    }
}

impl Sighting for PoseSighting {
    fn camera_from_target(&self) -> &Pose {
        &self.camera_from_target
    }

    fn covariance(&self) -> &Matrix6<f64> {
        &self.covariance
    }
}
