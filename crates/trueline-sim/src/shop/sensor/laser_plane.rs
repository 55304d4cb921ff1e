//! A laser plane that a calibration has placed a little beside the true one.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use crate::capture::SheetAxes;
use nalgebra::{Rotation3, Vector3};
use trueline_geometry::Plane;

/// Turn about each axis for each metre of offset, rad/m: 0.05° with 0.05 mm.
const RAD_PER_M: f64 = 1000.0 * std::f64::consts::PI / 180.0;

/// The plane as the file has it, in the camera frame.
pub(crate) fn stated(plane: &Plane, axes: &SheetAxes, errors: &DrawnErrors) -> Option<Plane> {
    let Some(size_m) = errors.size(ShopError::LaserPlane) else { return Some(*plane) };
    let mut noise = errors.noise(ShopError::LaserPlane, 1);
    let turn = Vector3::new(noise.normal(size_m * RAD_PER_M), 0.0, noise.normal(size_m * RAD_PER_M));
    let turn = Rotation3::from_scaled_axis(axes.camera_from_sheet * turn);
    let normal = turn * plane.normal().into_inner();
    Plane::new(normal, normal.dot(&axes.middle) + noise.normal(size_m))
}
