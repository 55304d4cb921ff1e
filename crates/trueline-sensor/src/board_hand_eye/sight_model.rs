//! Prediction of a sighting, its derivatives by the unknowns and the robot, and the whitening of its residual.

use super::pose_sighting::Sighting;
use super::robot_path::ToolState;
use super::unknowns::{Carried, ErrorModel, HAND_EYE, SIZE, TARGET, TIME_OFFSET, Unknowns};
use nalgebra::{Matrix6, SMatrix, Vector6};
use trueline_geometry::{Pose, se3, so3};

/// The target as the camera should see it: P = X⁻¹ T⁻¹ B.
pub(crate) fn predicted(tool: &ToolState, at: &Unknowns) -> Pose {
    at.tool_from_camera.inverse() * tool.base_from_tool.inverse() * at.base_from_target
}

/// d (Log(R_C R_Pᵀ), t_C − t_P) / d unknowns.
///
/// A rotation of the prediction, R_P ← Exp(ε) R_P, changes Log(R_C R_Pᵀ) = δ by −V⁻¹(−δ) ε.
pub(crate) fn derivative(seen: &Pose, tool: &ToolState, at: &Unknowns) -> SMatrix<f64, 6, SIZE> {
    let camera_from_tool = at.tool_from_camera.rotation.inverse().to_rotation_matrix().into_inner();
    let tool_from_base = tool.base_from_tool.rotation.inverse().to_rotation_matrix().into_inner();
    let camera_from_base = camera_from_tool * tool_from_base;
    // The target's origin from the tool's, and from the camera's, along the tool's axes.
    let from_tool =
        tool_from_base * (at.base_from_target.translation.vector - tool.base_from_tool.translation.vector);
    let from_camera = from_tool - at.tool_from_camera.translation.vector;
    let (delta, _) = se3::difference_decoupled(seen, &predicted(tool, at));
    let turned = -so3::left_jacobian_inverse(&-delta);
    let mut jacobian = SMatrix::<f64, 6, SIZE>::zeros();
    // An offset that is larger by dt shows the tool earlier by dt.
    let rate = camera_from_tool * tool.body_rate;
    let velocity = camera_from_tool * (tool.body_rate.cross(&from_tool) + tool_from_base * tool.velocity);
    jacobian.fixed_view_mut::<3, 1>(0, TIME_OFFSET).copy_from(&(turned * rate));
    jacobian.fixed_view_mut::<3, 1>(3, TIME_OFFSET).copy_from(&-velocity);
    jacobian.fixed_view_mut::<3, 3>(0, HAND_EYE).copy_from(&(-turned * camera_from_tool));
    jacobian.fixed_view_mut::<3, 3>(3, HAND_EYE).copy_from(&(-camera_from_tool * so3::hat(&from_camera)));
    jacobian.fixed_view_mut::<3, 3>(3, HAND_EYE + 3).copy_from(&camera_from_tool);
    jacobian.fixed_view_mut::<3, 3>(0, TARGET).copy_from(&(turned * camera_from_base));
    jacobian.fixed_view_mut::<3, 3>(3, TARGET + 3).copy_from(&-camera_from_base);
    jacobian
}

/// W with WᵀW the inverse covariance of a residual: sighting, robot and stamp err together.
pub(crate) fn whitening(
    seen: &impl Sighting,
    tool: &ToolState,
    noise: &ErrorModel,
    at: &Unknowns,
) -> Option<Matrix6<f64>> {
    let predicted = predicted(tool, at);
    let d_robot = robot_derivative(tool, noise.carries, at);
    let (turn, shift) = (noise.rotation_rad.powi(2), noise.position_m.powi(2));
    let robot = d_robot
        * Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift))
        * d_robot.transpose();
    let by_time = derivative(&predicted, tool, at).column(TIME_OFFSET) * noise.stamp_s;
    let covariance = seen.covariance() + robot + by_time * by_time.transpose();
    // L Lᵀ = covariance: W = L⁻¹. Radians and metres differ by orders: scaled to a unit diagonal first.
    let scale = covariance.diagonal().map(|v| 1.0 / v.sqrt());
    let scaled = Matrix6::from_fn(|i, j| covariance[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.cholesky()?.l().try_inverse()?;
    Some(inverse * Matrix6::from_diagonal(&scale))
}

/// −d (turn, shift of the target as the camera sees it) / d (turn of the tool about its origin, its shift), in the carrier's axes. Its sign does
/// not matter to a covariance.
pub(crate) fn robot_derivative(tool: &ToolState, carries: Carried, at: &Unknowns) -> Matrix6<f64> {
    let predicted = predicted(tool, at);
    let camera_from_tool = at.tool_from_camera.rotation.inverse().to_rotation_matrix().into_inner();
    // The tool turned about its origin and shifted, in axes of its own, moves the target as the camera sees it.
    let camera_from_carrier = at.tool_from_camera.inverse();
    let centre = match carries {
        Carried::Camera => camera_from_carrier.translation.vector,
        // The carrier is the base, and the path leads from it to the tool.
        Carried::Target => (camera_from_carrier * tool.base_from_tool.inverse()).translation.vector,
    };
    let lever = predicted.translation.vector - centre;
    let mut d_robot = Matrix6::zeros();
    d_robot.fixed_view_mut::<3, 3>(0, 0).copy_from(&camera_from_tool);
    d_robot.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-so3::hat(&lever) * camera_from_tool));
    d_robot.fixed_view_mut::<3, 3>(3, 3).copy_from(&camera_from_tool);
    d_robot
}
