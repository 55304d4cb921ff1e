//! How a sensor is mounted on the tool: ahead of the torch, its sheet across the way.

use crate::capture::SheetAxes;
use crate::noise::Noise;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;
use trueline_geometry::{Pose, se3};

/// Distance from the tool's axis, and height above the flange, m.
const AHEAD_M: [f64; 2] = [0.06, 0.14];
const HEIGHT_M: [f64; 2] = [0.045, 0.130];
/// How far the sheet leans back towards the torch, rad.
const LEAN_RAD: [f64; 2] = [0.0, 0.35];
/// A bracket is bent by this about each axis, rad.
const BENT_RAD: f64 = 0.05;
/// It is ahead along one of the flange's axes but for this, rad.
const OFF_AXIS_RAD: f64 = 0.08;

/// Draws `tool_from_camera`.
pub(crate) fn drawn(noise: &mut Noise, sheet: &SheetAxes) -> Pose {
    let azimuth = (noise.uniform(0.0, 4.0).floor()) * FRAC_PI_2 + noise.normal(OFF_AXIS_RAD);
    let ahead = Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
    let range = Vector3::z();
    // Columns: along the stripe, ahead, range.
    let square =
        Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[ahead.cross(&range), ahead, range]));
    let lean = Rotation3::from_axis_angle(&Vector3::x_axis(), noise.uniform(LEAN_RAD[0], LEAN_RAD[1]));
    let bent = Rotation3::from_scaled_axis(Vector3::from_fn(|_, _| noise.normal(BENT_RAD)));
    let rotation = square * lean * bent * sheet.camera_from_sheet.inverse();
    let place =
        ahead * noise.uniform(AHEAD_M[0], AHEAD_M[1]) + range * noise.uniform(HEIGHT_M[0], HEIGHT_M[1]);
    se3::from_parts(UnitQuaternion::from_rotation_matrix(&rotation), place)
}
