//! Where a robot is not where it says: an error that depends on the pose and changes slowly with it.
//!
//! It cannot be estimated from a scan (its constant part is the hand-eye's), and it does not average out. So it is a
//! Gaussian process over the poses, with the accuracy of the robot's data sheet as its size, and all that the estimate
//! owes to it goes into the covariance.

use nalgebra::{DMatrix, DVector, SymmetricEigen, Vector3};
use trueline_geometry::{Pose, so3};

/// The standard deviation within a scan, per axis, as part of the absolute accuracy over the workspace.
const SHARE_OF_ACCURACY: f64 = 1.0 / 6.0;
/// A position error at the end of an arm of this length is an attitude error, m.
const ARM_M: f64 = 1.5;
/// Distance over which the error changes, m.
const REACH_M: f64 = 0.6;
/// Turn over which it changes, rad.
const REACH_RAD: f64 = 0.6;
/// Poses from which the modes are made.
const POSES: usize = 120;
/// Modes of less than this part of the largest are left out.
const LEAST_MODE: f64 = 1e-4;

/// The process over the poses of a scan, as independent modes of unit variance.
pub struct RobotField {
    poses: Vec<Pose>,
    /// Kernel to modes: Λ^(−1/2) Vᵀ.
    modes: DMatrix<f64>,
    /// Standard deviation of the position along each axis, m.
    pub position_sigma_m: f64,
    /// Standard deviation of the attitude about each axis, rad.
    pub attitude_sigma_rad: f64,
}

impl RobotField {
    /// Of a robot of this absolute accuracy (m) on a path; `None` for an ideal robot.
    #[must_use]
    pub fn new(accuracy_m: f64, path: &[Pose]) -> Option<Self> {
        if accuracy_m <= 0.0 || path.is_empty() {
            return None;
        }
        let poses: Vec<Pose> = path.iter().step_by(path.len().div_ceil(POSES)).copied().collect();
        let kernel = DMatrix::from_fn(poses.len(), poses.len(), |i, j| alike(&poses[i], &poses[j]));
        let eigen = SymmetricEigen::new(kernel);
        let least = LEAST_MODE * eigen.eigenvalues.max();
        let kept: Vec<usize> = (0..poses.len()).filter(|&k| eigen.eigenvalues[k] > least).collect();
        let modes = DMatrix::from_fn(kept.len(), poses.len(), |row, column| {
            eigen.eigenvectors[(column, kept[row])] / eigen.eigenvalues[kept[row]].sqrt()
        });
        let position_sigma_m = accuracy_m * SHARE_OF_ACCURACY;
        Some(Self { poses, modes, position_sigma_m, attitude_sigma_rad: position_sigma_m / ARM_M })
    }

    /// Number of modes of each of the six errors.
    #[must_use]
    pub fn modes(&self) -> usize {
        self.modes.nrows()
    }

    /// The modes at a pose.
    #[must_use]
    pub fn at(&self, pose: &Pose) -> DVector<f64> {
        let kernel = DVector::from_iterator(self.poses.len(), self.poses.iter().map(|p| alike(p, pose)));
        &self.modes * kernel
    }
}

fn alike(one: &Pose, other: &Pose) -> f64 {
    let shift: Vector3<f64> = one.translation.vector - other.translation.vector;
    let turn = so3::log(&(one.rotation.inverse() * other.rotation));
    (-0.5 * (shift.norm_squared() / REACH_M.powi(2) + turn.norm_squared() / REACH_RAD.powi(2))).exp()
}
