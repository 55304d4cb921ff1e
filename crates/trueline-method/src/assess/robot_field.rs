//! Position and attitude errors of a robot that depend on the pose and change slowly with it.
//!
//! They cannot be estimated from a scan, because the hand-eye transform absorbs their constant part, and they do not average out. They are modelled
//! as a Gaussian process over the poses, with the accuracy of the robot's data sheet as its size. Their effect on the estimate is included in the
//! covariance.

use crate::thinning::stride;
use nalgebra::{DMatrix, DVector, SymmetricEigen, Vector3};
use trueline_geometry::Pose;

/// Standard deviation within a scan, per axis, as a fraction of the absolute accuracy over the workspace, for a torch on the same robot. Its errors
/// there are those of the scan …
const SHARE_OF_ACCURACY: f64 = 1.0 / 6.0;
/// … and for the true transform, which another robot needs.
const SHARE_FOR_ANOTHER: f64 = 1.0 / 4.0;
/// Length of the arm that converts a position error to an attitude error, m.
const ARM_M: f64 = 1.5;
/// Distance over which the error changes, m.
const REACH_M: f64 = 0.6;
/// Rotation over which it changes, rad.
const REACH_RAD: f64 = 0.6;
/// Number of poses that define the modes.
const POSES: usize = 120;
/// Modes below this fraction of the largest are left out.
const LEAST_MODE: f64 = 1e-4;

/// Robot errors within a scan: one standard deviation per axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RobotSigmas {
    /// Position, m.
    pub position_m: f64,
    /// Attitude, rad.
    pub attitude_rad: f64,
}

impl RobotSigmas {
    /// For an absolute accuracy, m.
    #[must_use]
    pub fn of_accuracy(accuracy_m: f64) -> Self {
        Self::of_position(accuracy_m * SHARE_OF_ACCURACY)
    }

    /// The same for use of the transform on another robot.
    #[must_use]
    pub fn for_another(accuracy_m: f64) -> Self {
        Self::of_position(accuracy_m * SHARE_FOR_ANOTHER)
    }

    /// Errors that change slowly, of these in all, where the errors that differ from pose to pose have a position part of this size, m: the squares
    /// add up. So an error that the residuals show does not count twice.
    #[must_use]
    pub fn beside(self, noise_m: f64) -> Self {
        if self.position_m <= 0.0 {
            return self;
        }
        let part = (1.0 - (noise_m / self.position_m).powi(2)).max(0.0).sqrt();
        Self { position_m: self.position_m * part, attitude_rad: self.attitude_rad * part }
    }

    fn of_position(position_m: f64) -> Self {
        Self { position_m, attitude_rad: position_m / ARM_M }
    }
}

/// The process over the poses of a scan, as independent modes of unit variance.
#[derive(Clone, Debug)]
pub struct RobotField {
    poses: Vec<Pose>,
    /// Kernel to modes: Λ^(−1/2) Vᵀ.
    modes: DMatrix<f64>,
    /// Its size.
    pub sigmas: RobotSigmas,
}

impl RobotField {
    /// The same over the same poses for errors of another size.
    #[must_use]
    pub(crate) fn of_size(self, sigmas: RobotSigmas) -> Self {
        Self { sigmas, ..self }
    }

    /// For a robot on a path. `None` for an ideal robot.
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

    /// The same with its strongest modes only.
    #[must_use]
    pub fn strongest(mut self, count: usize) -> Self {
        // A mode of eigenvalue λ has the weight λ^(−1/2), so the strongest have the shortest rows.
        let mut order: Vec<usize> = (0..self.modes.nrows()).collect();
        order.sort_by(|a, b| self.modes.row(*a).norm().total_cmp(&self.modes.row(*b).norm()));
        order.truncate(count);
        self.modes = self.modes.select_rows(&order);
        self
    }

    /// Correlation of its modes with those of another field over the same robot's workspace.
    #[must_use]
    pub(crate) fn correlation(&self, other: &Self) -> DMatrix<f64> {
        let kernel = DMatrix::from_fn(self.poses.len(), other.poses.len(), |i, j| {
            alike(&self.poses[i], &other.poses[j])
        });
        &self.modes * kernel * other.modes.transpose()
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

/// How an answer follows the robot's errors.
#[derive(Clone, Debug)]
pub struct OfRobot {
    /// The errors.
    pub field: RobotField,
    /// Columns of the tangent, each of unit variance: six for each mode.
    pub columns: DMatrix<f64>,
}

impl OfRobot {
    /// The covariance that it shares with another answer for the same robot.
    #[must_use]
    pub(crate) fn shared_with(&self, other: &Self) -> DMatrix<f64> {
        let alike = self.field.correlation(&other.field);
        let mut shared = DMatrix::zeros(self.columns.nrows(), other.columns.nrows());
        for component in 0..6 {
            let of = |answer: &Self| {
                let modes: Vec<usize> = (0..answer.field.modes()).map(|mode| 6 * mode + component).collect();
                answer.columns.select_columns(&modes)
            };
            shared += of(self) * &alike * of(other).transpose();
        }
        shared
    }
}

/// Correlation of the errors at two poses.
#[must_use]
pub fn alike(one: &Pose, other: &Pose) -> f64 {
    let shift: Vector3<f64> = one.translation.vector - other.translation.vector;
    // q and −q are the same attitude. The product of two quaternions is the cosine of half the angle between them. Near one, its arc is accurate to
    // the root of rounding. The square of the angle, which is used, is accurate to rounding.
    let half_turn_rad = one.rotation.coords.dot(&other.rotation.coords).abs().min(1.0).acos();
    let turn_rad = 2.0 * half_turn_rad;
    (-0.5 * (shift.norm_squared() / REACH_M.powi(2) + turn_rad.powi(2) / REACH_RAD.powi(2))).exp()
}

#[cfg(test)]
mod tests {
    use super::{OfRobot, REACH_M, REACH_RAD, RobotField, RobotSigmas, alike};
    use nalgebra::{DMatrix, Vector3};
    use trueline_geometry::{Pose, se3, so3};

    fn of_robot(path: &[Pose], columns: impl Fn(usize, usize) -> f64) -> Option<OfRobot> {
        let field = RobotField::new(RobotSigmas::of_accuracy(0.3e-3), path)?;
        let columns = DMatrix::from_fn(7, 6 * field.modes(), columns);
        Some(OfRobot { field, columns })
    }

    fn path(from_m: f64) -> Vec<Pose> {
        let pose = |k: i32| {
            let part = f64::from(k) / 40.0;
            se3::from_parts(
                so3::exp(&Vector3::new(0.4 * part, 0.3 * (5.0 * part).sin(), 0.0)),
                Vector3::new(from_m + 0.4 * part, 0.1 * (9.0 * part).cos(), 0.2),
            )
        };
        (0..40).map(pose).collect()
    }

    /// Answers that follow the same errors in the same way share all of them; those of robots far apart share none.
    #[test]
    fn answers_share_what_their_robot_errs_by_in_both() {
        let columns = |i: usize, j: usize| ((3 * i + 5 * j) as f64).sin();
        let (Some(one), Some(far)) = (of_robot(&path(0.0), columns), of_robot(&path(9.0), columns)) else {
            unreachable!("the robot has errors")
        };
        let own = &one.columns * one.columns.transpose();
        // Modes of less than 1e-4 of the largest are left out.
        assert!((one.shared_with(&one) - &own).amax() < 1e-9 * own.amax());
        assert!(one.shared_with(&far).amax() < 1e-12 * own.amax());
        // Of a path nearby they share a part, in either direction.
        let Some(near) = of_robot(&path(0.1), columns) else { unreachable!("the robot has errors") };
        let shared = one.shared_with(&near);
        assert!((&shared - near.shared_with(&one).transpose()).amax() < 1e-9 * own.amax());
        assert!(shared.amax() > 0.1 * own.amax());
    }

    #[test]
    fn what_differs_from_pose_to_pose_and_what_changes_slowly_add_up() {
        let all = RobotSigmas::of_accuracy(0.3e-3);
        let slow = all.beside(0.03e-3);
        // 0.05² = 0.03² + 0.04².
        assert!(
            (slow.position_m - 0.04e-3).abs() < 1e-12 && (slow.attitude_rad - 0.04e-3 / 1.5).abs() < 1e-12
        );
        assert_eq!(all.beside(0.06e-3), RobotSigmas::default());
        assert_eq!(RobotSigmas::default().beside(0.06e-3), RobotSigmas::default());
    }

    /// Against the logarithm of the rotation, for angles from zero to a full turn.
    #[test]
    fn errors_are_alike_by_shift_and_turn() {
        let one = se3::from_parts(so3::exp(&Vector3::new(0.3, -1.2, 0.5)), Vector3::new(0.1, 0.2, 0.3));
        for angle_rad in [0.0, 1e-9, 1e-4, 0.3, 2.0, 3.1, 4.0, 6.2] {
            let turn = so3::exp(&(Vector3::new(0.48, 0.6, 0.64) * angle_rad));
            let shift = Vector3::new(0.1, -0.05, 0.2);
            let other = se3::from_parts(one.rotation * turn, one.translation.vector + shift);
            let exponent =
                shift.norm_squared() / REACH_M.powi(2) + so3::log(&turn).norm_squared() / REACH_RAD.powi(2);
            // The square of an angle is off by 8 (1 − cos), a few roundings of one, over 0.36.
            assert!((alike(&one, &other) - (-0.5 * exponent).exp()).abs() < 1e-14, "{angle_rad}");
        }
    }
}
