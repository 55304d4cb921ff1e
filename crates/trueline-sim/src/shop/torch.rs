//! A torch on the same robot with a tip taught by pivoting: the place that the controller must command to touch a
//! point.

use super::robot::ShopRobot;
use nalgebra::{DMatrix, DVector, Point3, UnitQuaternion, Vector3};
use trueline_geometry::{Pose, se3, so3};

/// Turn of the attitudes from which the tip is taught, rad.
const PIVOT_RAD: f64 = 25.0 * std::f64::consts::PI / 180.0;
/// The turn is less where the arm cannot follow.
const LESS: [f64; 3] = [1.0, 0.5, 0.2];
/// Rounds of the search for a pose; each gains the arm's error over its lever, a factor of a thousand.
const ROUNDS: usize = 5;

/// A torch.
pub(crate) struct Torch<'a> {
    robot: &'a ShopRobot,
    middle_s: f64,
    attitude: UnitQuaternion<f64>,
    /// The true tip in the tool and the taught one, m.
    tip: Vector3<f64>,
    taught: Vector3<f64>,
}

impl<'a> Torch<'a> {
    /// A torch with its tip at `tip` (m, in the tool), taught at a place near the middle of the seam; it welds in
    /// `attitude`. `None` out of reach.
    pub(crate) fn taught(
        robot: &'a ShopRobot,
        middle_s: f64,
        attitude: UnitQuaternion<f64>,
        tip: Vector3<f64>,
        at: &Vector3<f64>,
    ) -> Option<Self> {
        let mut torch = Self { robot, middle_s, attitude, tip, taught: tip };
        torch.taught = LESS.iter().find_map(|less| torch.pivoted(at, PIVOT_RAD * less))?;
        Some(torch)
    }

    /// Place that the controller must command for the taught tip to bring the true one to a point, m; `None` out of
    /// reach.
    pub(crate) fn sent_to(&self, point: &Vector3<f64>) -> Option<Vector3<f64>> {
        let reported = self.touching(&self.attitude, point)?;
        Some((reported * Point3::from(self.taught)).coords)
    }

    /// The pose that the controller reports while the tip touches a point in an attitude.
    fn touching(&self, attitude: &UnitQuaternion<f64>, point: &Vector3<f64>) -> Option<Pose> {
        let mut reported = se3::from_parts(*attitude, point - attitude * self.tip);
        for _ in 0..ROUNDS {
            let tip = self.robot.standing(&reported, self.middle_s)? * Point3::from(self.tip);
            reported.translation.vector += point - tip.coords;
        }
        self.robot.standing(&reported, self.middle_s).map(|_| reported)
    }

    /// The tip that least squares give of poses in which it touches one point: R t + p = q.
    fn pivoted(&self, at: &Vector3<f64>, turn_rad: f64) -> Option<Vector3<f64>> {
        let turns =
            [[0.0; 3], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut matrix = DMatrix::zeros(3 * turns.len(), 6);
        let mut right = DVector::zeros(3 * turns.len());
        for (k, turn) in turns.iter().enumerate() {
            let attitude = self.attitude * so3::exp(&(Vector3::from(*turn) * turn_rad));
            let pose = self.touching(&attitude, at)?;
            matrix.view_mut((3 * k, 0), (3, 3)).copy_from(pose.rotation.to_rotation_matrix().matrix());
            matrix.view_mut((3 * k, 3), (3, 3)).fill_diagonal(-1.0);
            right.rows_mut(3 * k, 3).copy_from(&-pose.translation.vector);
        }
        let found = matrix.svd(true, true).solve(&right, 1e-12).ok()?;
        Some(Vector3::new(found[0], found[1], found[2]))
    }
}
