//! The ± of a point in base, as a quadratic form of its place in the camera: one form a frame, a few products a point.
//!
//! With p̃ = (p, 1), each cause of an error moves the point by an affine function of p. The time offset moves
//! it by p_E × ω − v, the hand-eye transform by −R_EC p × δ + δt, the robot's attitude by p_E × δ. All are
//! rotated into the tool, which changes no length. The trace of the covariance is p̃ᵀ Q p̃.

use crate::calibration::PlacerCalibration;
use crate::chain::Carried;
use crate::located::Located;
use nalgebra::{Matrix3x4, Matrix4, SMatrix, Vector3};
use trueline_geometry::so3;

/// The parts of the form that no frame changes.
#[derive(Clone, Debug)]
pub(crate) struct Spread {
    /// By rotation and translation of the hand-eye transform, and by the readings.
    constant: Matrix4<f64>,
    /// By a turn of the tool of 1 rad about each axis.
    by_turn: Matrix4<f64>,
    /// p_E by p̃.
    tool_by_point: Matrix3x4<f64>,
    /// How an error of the time offset goes together with one of the hand-eye transform, by p̃.
    with_time: Matrix3x4<f64>,
    time_variance_s2: f64,
}

impl Spread {
    pub(crate) fn of(by: &PlacerCalibration, reading_axes: f64) -> Self {
        let rotation = by.tool_from_camera.rotation.to_rotation_matrix().into_inner();
        let mut tool_by_point = Matrix3x4::zeros();
        tool_by_point.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
        tool_by_point.set_column(3, &by.tool_from_camera.translation.vector);
        let links = by.covariance.fixed_view::<6, 6>(1, 1).into_owned();
        let with_time = by.covariance.fixed_view::<6, 1>(1, 0).into_owned();
        // Columns by the rotation (−hat of the turned point), then by the translation, for each entry of p̃.
        let slopes: [SMatrix<f64, 3, 6>; 4] = std::array::from_fn(|k| {
            let mut slope = SMatrix::<f64, 3, 6>::zeros();
            if k < 3 {
                let column: Vector3<f64> = rotation.column(k).into_owned();
                slope.fixed_view_mut::<3, 3>(0, 0).copy_from(&-so3::hat(&column));
            } else {
                slope.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
            }
            slope
        });
        let mut constant = Matrix4::from_fn(|i, j| (slopes[i] * links * slopes[j].transpose()).trace());
        constant[(3, 3)] += reading_axes * by.reading_sigma_m * by.reading_sigma_m;
        let columns = slopes.map(|slope| slope * with_time);
        Self {
            constant,
            by_turn: tool_by_point.transpose() * tool_by_point * 2.0,
            tool_by_point,
            with_time: Matrix3x4::from_columns(&columns),
            time_variance_s2: by.covariance[(0, 0)],
        }
    }

    /// The form at a place of the robot; `stamp_sigma_s` is the uncertainty of the frame's time without that
    /// of the offset.
    pub(crate) fn at(&self, located: &Located, stamp_sigma_s: f64) -> Matrix4<f64> {
        let by_time = by_time(located, &self.tool_by_point);
        let times = self.time_variance_s2 + stamp_sigma_s.powi(2) + located.sigma_s.powi(2);
        let mixed = by_time.transpose() * self.with_time;
        let mut form = self.constant
            + by_time.transpose() * by_time * times
            + mixed
            + mixed.transpose()
            + self.by_turn * located.sigma_rad.powi(2);
        form[(3, 3)] += 3.0 * located.sigma_m.powi(2);
        form
    }

    /// The same with external axes, for a robot at a place of its own.
    pub(crate) fn among_axes(&self, robot: &Located, carried: &Carried, stamp_sigma_s: f64) -> Matrix4<f64> {
        // A frame's own time moves everything; that of the poses moves the robot alone.
        let whole = Located { sigma_s: 0.0, sigma_rad: 0.0, ..carried.located };
        let mut form = self.at(&whole, stamp_sigma_s);
        let behind = carried.tool_from_carrier.to_homogeneous();
        let mut point = Matrix4::zeros();
        point.fixed_view_mut::<3, 4>(0, 0).copy_from(&self.tool_by_point);
        point[(3, 3)] = 1.0;
        let tool_by_point: Matrix3x4<f64> = (behind * point).fixed_view::<3, 4>(0, 0).into_owned();
        let by_robot = by_time(robot, &tool_by_point);
        form += by_robot.transpose() * by_robot * robot.sigma_s.powi(2);
        form += tool_by_point.transpose() * tool_by_point * (2.0 * robot.sigma_rad.powi(2));
        form + point.transpose() * carried.by_axes * point
    }
}

/// How a point moves with the time of its exposure, in the frame of the tool, m/s by p̃.
fn by_time(located: &Located, tool_by_point: &Matrix3x4<f64>) -> Matrix3x4<f64> {
    let into_tool = located.base_from_tool.rotation.inverse();
    let (velocity, rate) = (into_tool * located.velocity, into_tool * located.angular_velocity);
    // An exposure that is earlier puts the point back: p_E × ω − v.
    let mut by_time = -so3::hat(&rate) * tool_by_point;
    let last = by_time.column(3) - velocity;
    by_time.set_column(3, &last);
    by_time
}
