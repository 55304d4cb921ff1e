//! Position and attitude errors of a robot that depend on the pose and change slowly with it.
//!
//! It cannot be estimated from a scan (its constant part is the hand-eye's), and it does not average out. So it is a
//! Gaussian process over the poses, with the accuracy of the robot's data sheet as its size, and all that the estimate
//! owes to it goes into the covariance.

use crate::thinning::stride;
use nalgebra::{DMatrix, DVector, SymmetricEigen, Vector3};
use trueline_geometry::Pose;

/// The standard deviation within a scan, per axis, as part of the absolute accuracy over the workspace, for a torch that the same robot carries: it errs there
/// as it did while it scanned …
const SHARE_OF_ACCURACY: f64 = 1.0 / 6.0;
/// … and for the true transform, as another robot needs it.
const SHARE_FOR_ANOTHER: f64 = 1.0 / 4.0;
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

/// How far a robot is off within a scan: one standard deviation per axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RobotSigmas {
    /// Of its position, m.
    pub position_m: f64,
    /// Of its attitude, rad.
    pub attitude_rad: f64,
}

impl RobotSigmas {
    /// Of a robot of an absolute accuracy, m.
    #[must_use]
    pub fn of_accuracy(accuracy_m: f64) -> Self {
        Self::of_position(accuracy_m * SHARE_OF_ACCURACY)
    }

    /// The same where another robot uses the transform.
    #[must_use]
    pub fn for_another(accuracy_m: f64) -> Self {
        Self::of_position(accuracy_m * SHARE_FOR_ANOTHER)
    }

    fn of_position(position_m: f64) -> Self {
        Self { position_m, attitude_rad: position_m / ARM_M }
    }
}

/// The process over the poses of a scan, as independent modes of unit variance.
#[derive(Clone)]
pub struct RobotField {
    poses: Vec<Pose>,
    /// Kernel to modes: Λ^(−1/2) Vᵀ.
    modes: DMatrix<f64>,
    /// How large it is.
    pub sigmas: RobotSigmas,
}

impl RobotField {
    /// Of a robot on a path; `None` for an ideal robot.
    #[must_use]
    pub fn new(sigmas: RobotSigmas, path: &[Pose]) -> Option<Self> {
        if sigmas == RobotSigmas::default() || path.is_empty() {
            return None;
        }
        let poses: Vec<Pose> = path.iter().step_by(stride(path.len(), POSES)).copied().collect();
        let kernel = DMatrix::from_fn(poses.len(), poses.len(), |i, j| alike(&poses[i], &poses[j]));
        let eigen = SymmetricEigen::new(kernel);
        let least = LEAST_MODE * eigen.eigenvalues.max();
        let kept: Vec<usize> = (0..poses.len()).filter(|&k| eigen.eigenvalues[k] > least).collect();
        let modes = DMatrix::from_fn(kept.len(), poses.len(), |row, column| {
            eigen.eigenvectors[(column, kept[row])] / eigen.eigenvalues[kept[row]].sqrt()
        });
        Some(Self { poses, modes, sigmas })
    }

    /// The same by its strongest modes alone.
    #[must_use]
    pub fn strongest(mut self, count: usize) -> Self {
        // A mode of eigenvalue λ is weighed by λ^(−1/2): the rows of the strongest are the shortest.
        let mut order: Vec<usize> = (0..self.modes.nrows()).collect();
        order.sort_by(|a, b| self.modes.row(*a).norm().total_cmp(&self.modes.row(*b).norm()));
        order.truncate(count);
        self.modes = self.modes.select_rows(&order);
        self
    }

    /// Number of modes of each of the six errors.
    #[must_use]
    pub(crate) fn modes(&self) -> usize {
        self.modes.nrows()
    }

    /// The modes at a pose.
    #[must_use]
    pub fn at(&self, pose: &Pose) -> DVector<f64> {
        let kernel = DVector::from_iterator(self.poses.len(), self.poses.iter().map(|p| alike(p, pose)));
        &self.modes * kernel
    }
}

/// How alike the errors at two poses are: the correlation of the process.
#[must_use]
pub fn alike(one: &Pose, other: &Pose) -> f64 {
    let shift: Vector3<f64> = one.translation.vector - other.translation.vector;
    // q and −q are the same attitude, and the product of two is the cosine of half the turn between them. Near one its arc is known to
    // the root of rounding, and the square of the turn, which is what counts, to rounding.
    let half_turn_rad = one.rotation.coords.dot(&other.rotation.coords).abs().min(1.0).acos();
    let turn_rad = 2.0 * half_turn_rad;
    (-0.5 * (shift.norm_squared() / REACH_M.powi(2) + turn_rad.powi(2) / REACH_RAD.powi(2))).exp()
}

#[cfg(test)]
mod tests {
    use super::{REACH_M, REACH_RAD, alike};
    use nalgebra::Vector3;
    use trueline_geometry::{se3, so3};

    /// Against the logarithm of the turn, of turns from nothing to a whole one.
    #[test]
    fn errors_are_alike_by_shift_and_turn() {
        let one = se3::from_parts(so3::exp(&Vector3::new(0.3, -1.2, 0.5)), Vector3::new(0.1, 0.2, 0.3));
        for angle_rad in [0.0, 1e-9, 1e-4, 0.3, 2.0, 3.1, 4.0, 6.2] {
            let turn = so3::exp(&(Vector3::new(0.48, 0.6, 0.64) * angle_rad));
            let shift = Vector3::new(0.1, -0.05, 0.2);
            let other = se3::from_parts(one.rotation * turn, one.translation.vector + shift);
            let exponent =
                shift.norm_squared() / REACH_M.powi(2) + so3::log(&turn).norm_squared() / REACH_RAD.powi(2);
            // The square of a turn is off by 8 (1 − cos), a few roundings of one, over 0.36.
            assert!((alike(&one, &other) - (-0.5 * exponent).exp()).abs() < 1e-14, "{angle_rad}");
        }
    }
}
