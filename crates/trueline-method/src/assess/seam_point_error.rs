//! Seam error in use: the error of a point measured during motion.
//!
//! Position in base of a point seen at p_C while the tool moves at v: p_B = R (R_EC p_C + p_EC) + p, so
//! δp_B = R (−\[R_EC p_C\]× δ + δt) − v δt_d with the covariance of (δt_d, δ, δt).

use crate::config::Use;
use crate::input::observations::{Observation, Observations};
use crate::order_statistics::median;
use crate::problem::parameters::{LINES, Parameters, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::problem::placement::placement;
use nalgebra::{Matrix3, SMatrix, Vector3};
use trueline_geometry::so3;

/// Standard deviations of a seam point's position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamPointError {
    /// Speed along the seam, m/s.
    pub speed_m_s: f64,
    /// Distance from the sensor, m.
    pub stand_off_m: f64,
    /// Along the seam, across it and in height (towards the sensor), m.
    pub sigma_m: [f64; 3],
    /// Semi-axes of the ellipsoid of one standard deviation, longest first, m.
    pub semi_axes_m: [f64; 3],
    /// Their unit directions in base, one each.
    pub directions_in_base: [[f64; 3]; 3],
}

/// Predicts it at the attitude of the middle of the scan. `None` if the sheet has no such point.
#[must_use]
pub fn predict(
    observations: &Observations,
    list: &[Observation],
    at: &Parameters,
    covariance: &nalgebra::DMatrix<f64>,
    used_at: &Use,
) -> Option<SeamPointError> {
    let point_in_camera = point_at(observations, list, used_at.stand_off_m)?;
    let middle = list.get(list.len() / 2)?;
    let base_from_tool = placement(observations, middle, at)?.base_from_tool;
    let along = at.lines.first()?.direction();
    let lever = at.tool_from_camera.rotation * point_in_camera;
    let attitude = base_from_tool.rotation.to_rotation_matrix().into_inner();
    let mut jacobian = SMatrix::<f64, 3, LINES>::zeros();
    jacobian.fixed_columns_mut::<1>(TIME_OFFSET).copy_from(&(-along * used_at.speed_m_s));
    jacobian.fixed_columns_mut::<3>(ROTATION).copy_from(&(-attitude * so3::hat(&lever)));
    jacobian.fixed_columns_mut::<3>(TRANSLATION).copy_from(&attitude);
    let sensor: SMatrix<f64, LINES, LINES> = covariance.fixed_view::<LINES, LINES>(0, 0).into();
    let position: Matrix3<f64> = jacobian * sensor * jacobian.transpose();

    let towards = -(attitude * lever);
    let height = (towards - along * along.dot(&towards)).try_normalize(1e-9)?;
    let across = height.cross(&along);
    let sigma = |axis: &Vector3<f64>| axis.dot(&(position * axis)).max(0.0).sqrt();
    let eigen = position.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    Some(SeamPointError {
        speed_m_s: used_at.speed_m_s,
        stand_off_m: point_in_camera.norm(),
        sigma_m: [sigma(&along), sigma(&across), sigma(&height)],
        semi_axes_m: order.map(|k| eigen.eigenvalues[k].max(0.0).sqrt()),
        directions_in_base: order.map(|k| eigen.eigenvectors.column(k).into_owned().into()),
    })
}

/// The middle of the visible points, moved along the sheet to the required distance.
fn point_at(
    observations: &Observations,
    list: &[Observation],
    stand_off_m: Option<f64>,
) -> Option<Vector3<f64>> {
    let median = |axis: usize| median(list.iter().map(|o| o.point_in_camera[axis]));
    let seen = Vector3::new(median(0)?, median(1)?, median(2)?);
    let Some(stand_off_m) = stand_off_m else { return Some(seen) };
    let normal = observations.sheet.plane().normal();
    let outward = (seen - normal.into_inner() * normal.dot(&seen)).try_normalize(1e-9)?;
    // |seen + a·outward| = stand-off.
    let along = seen.dot(&outward);
    let root = along * along - seen.norm_squared() + stand_off_m * stand_off_m;
    (root >= 0.0).then(|| seen + outward * (root.sqrt() - along))
}
