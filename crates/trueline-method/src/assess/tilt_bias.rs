//! A detector bias that moves the point with the tilt: its effect in the sheet, for each pixel per 10° of tilt.
//!
//! The bias is an image vector for each of the three axes of tilt: six numbers. A bias proportional to the tilt is nearly a shift of the hand-eye
//! transform. A scan determines it only if its tilts have another pattern.

use crate::input::observations::Observation;
use crate::problem::parameters::Parameters;
use nalgebra::{SMatrix, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use trueline_geometry::{Pose, so3};
use trueline_model::Placement;

/// Numbers of a bias: along and across the image's rows for each axis of tilt.
pub const BIAS: usize = 6;
/// The tilt to which a bias refers, rad.
pub(crate) const BIAS_TILT_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// Tilts are measured from the mean attitude of a scan. If the sensor is spun by about half a turn about its view, it is tilted the other way. The
/// spin itself is no tilt.
#[derive(Clone, Copy, Debug)]
pub struct TiltBias {
    mean: UnitQuaternion<f64>,
    /// The spin axis of a later pass, in the tool.
    spun_about: Option<Vector3<f64>>,
}

/// Attitudes within this angle of the first belong to its pass, rad …
const SAME_PASS_RAD: f64 = 1.2;
/// … and those beyond this angle are spun.
const SPUN_RAD: f64 = 2.0;
/// Least fraction of the poses in a spun pass.
const LEAST_SPUN: f64 = 0.1;

impl TiltBias {
    /// About the mean of these poses, `base_from_tool`.
    #[must_use]
    pub fn about(poses: &[Pose]) -> Self {
        let Some(first) = poses.first() else {
            return Self { mean: UnitQuaternion::identity(), spun_about: None };
        };
        let turned = |pose: &Pose| so3::log(&(first.rotation.inverse() * pose.rotation)).norm();
        let mean = mean_of(poses.iter().filter(|pose| turned(pose) < SAME_PASS_RAD), &first.rotation);
        let spun: Vec<&Pose> = poses.iter().filter(|pose| turned(pose) > SPUN_RAD).collect();
        let is_pass = spun.len() as f64 > LEAST_SPUN * poses.len() as f64;
        let spun_about = spun.first().filter(|_| is_pass).and_then(|first| {
            let of_pass = mean_of(spun.iter().copied(), &first.rotation);
            so3::log(&(mean.inverse() * of_pass)).try_normalize(1e-9)
        });
        Self { mean, spun_about }
    }

    /// Shift of the feature in the sheet, m, for each number of the bias, px per 10°: two for the tilt about the camera's x, two about its y, two
    /// about its z.
    #[must_use]
    pub fn slopes(&self, o: &Observation, at: &Parameters, placement: &Placement) -> SMatrix<f64, 2, BIAS> {
        let in_sensor = self.in_sensor(&at.tool_from_camera, placement);
        let by_px = o.sheet_per_px();
        let mut slopes = SMatrix::<f64, 2, BIAS>::zeros();
        for axis in 0..3 {
            slopes.fixed_columns_mut::<2>(2 * axis).copy_from(&(by_px * in_sensor[axis]));
        }
        slopes
    }

    /// The tilt about the camera's axes, in units of the reference tilt of a bias.
    #[must_use]
    pub fn in_sensor(&self, tool_from_camera: &Pose, placement: &Placement) -> Vector3<f64> {
        let turn = self.mean.inverse() * placement.base_from_tool.rotation;
        let tilt = self.spun_about.map_or_else(|| so3::log(&turn), |axis| without_spin(&turn, &axis));
        tool_from_camera.rotation.inverse() * tilt / BIAS_TILT_RAD
    }
}

/// The mean of the attitudes near a given one.
fn mean_of<'a>(poses: impl Iterator<Item = &'a Pose>, near: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let (mut sum, mut count) = (Vector3::zeros(), 0.0);
    for pose in poses {
        sum += so3::log(&(near.inverse() * pose.rotation));
        count += 1.0;
    }
    near * so3::exp(&(sum / f64::max(count, 1.0)))
}

/// Splits a rotation into a spin about an axis and a tilt in the spun frame, without half turns of the spin.
fn without_spin(turn: &UnitQuaternion<f64>, axis: &Vector3<f64>) -> Vector3<f64> {
    let spin_rad = 2.0 * turn.imag().dot(axis).atan2(turn.w);
    let tilt = so3::log(&(so3::exp(&(axis * -spin_rad)) * turn));
    tilt + axis * (spin_rad - PI * (spin_rad / PI).round())
}

#[cfg(test)]
mod tests {
    use super::{TiltBias, without_spin};
    use nalgebra::{UnitQuaternion, Vector3};
    use std::f64::consts::PI;
    use trueline_geometry::{Pose, se3, so3};

    #[test]
    fn spun_by_half_a_turn_a_sensor_is_tilted_as_it_sees_itself() {
        let axis = Vector3::new(0.0, 0.6, 0.8);
        for spin_rad in [0.0, PI, -PI, 1.3] {
            let tilt = Vector3::new(0.2, 0.08, -0.06);
            let turn: UnitQuaternion<f64> = so3::exp(&(axis * spin_rad)) * so3::exp(&tilt);
            // The tilt is orthogonal to the axis, except for rounding.
            assert!(tilt.dot(&axis).abs() < 1e-15);
            let wanted = tilt + axis * (spin_rad - PI * (spin_rad / PI).round());
            assert!((without_spin(&turn, &axis) - wanted).norm() < 1e-12, "{spin_rad}");
        }
    }

    #[test]
    fn a_spun_pass_is_recognised_and_an_ordinary_scan_has_none() {
        let pose = |k: usize, spin_rad: f64| -> Pose {
            let tilt = so3::exp(&Vector3::new((k as f64).sin() * 0.4, (k as f64 * 0.7).cos() * 0.4, 0.0));
            se3::from_parts(so3::exp(&(Vector3::z() * spin_rad)) * tilt, Vector3::zeros())
        };
        let one: Vec<Pose> = (0..100).map(|k| pose(k, 0.0)).collect();
        assert!(TiltBias::about(&one).spun_about.is_none());
        let two: Vec<Pose> = (0..200).map(|k| pose(k, if k < 100 { 0.0 } else { PI })).collect();
        let axis = TiltBias::about(&two).spun_about.unwrap_or_default();
        // The means are those of a hundred tilts of 0.3 rad: some 0.04 rad.
        assert!(axis.z.abs() > 0.99, "{axis}");
    }
}
