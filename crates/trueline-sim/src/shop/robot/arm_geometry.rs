//! An arm with links that differ from the controller's model.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use crate::noise::Noise;
use nalgebra::Vector3;
use trueline_geometry::arm::six_axes::{AXES, Arm};
use trueline_geometry::{se3, so3};

/// Turn of a link for each metre that it is off, rad/m: 0.005° beside 0.075 mm.
const TURN_PER_M: f64 = 1.16;
/// Configurations over which the error is measured.
const CONFIGURATIONS: usize = 80;
/// They lie within this of the one of the scan, rad: the part of the workspace that a cell uses.
const WORKSPACE_RAD: f64 = 0.8;

/// The arm as built: every joint is shifted and turned to put the flange off by the drawn RMS over the workspace about
/// `angles`, mean removed.
pub(crate) fn built(nominal: &Arm, angles: &[f64; AXES], errors: &DrawnErrors) -> Arm {
    let Some(rms_m) = errors.size(ShopError::ArmGeometry) else { return nominal.clone() };
    let mut noise = errors.noise(ShopError::ArmGeometry, 1);
    let unit: Vec<[Vector3<f64>; 2]> = (0..=AXES)
        .map(|_| [1.0, TURN_PER_M].map(|sigma| Vector3::from_fn(|_, _| noise.normal(sigma))))
        .collect();
    // The error is linear in such small changes: measured at a tenth of a millimetre, then scaled.
    let trial_m = 1e-4;
    let scale = rms_m * trial_m / rms_of(nominal, &off(nominal, &unit, trial_m), angles, &mut noise);
    off(nominal, &unit, scale)
}

fn off(nominal: &Arm, unit: &[[Vector3<f64>; 2]], scale_m: f64) -> Arm {
    let mut arm = nominal.clone();
    let ends = arm.joints.iter_mut().map(|joint| &mut joint.before).chain([&mut arm.last_from_flange]);
    for (pose, [shift, turn]) in ends.zip(unit) {
        let rotation = so3::exp(&(turn * scale_m)) * pose.rotation;
        *pose = se3::from_parts(rotation, pose.translation.vector + shift * scale_m);
    }
    arm
}

/// RMS distance of two arms' flanges, m, mean removed.
fn rms_of(one: &Arm, other: &Arm, about: &[f64; AXES], noise: &mut Noise) -> f64 {
    let gaps: Vec<Vector3<f64>> = (0..CONFIGURATIONS)
        .map(|_| {
            let angles = about.map(|angle| angle + noise.uniform(-WORKSPACE_RAD, WORKSPACE_RAD));
            let at = |arm: &Arm| arm.base_from_flange(&angles).translation.vector;
            at(other) - at(one)
        })
        .collect();
    let count = gaps.len() as f64;
    let mean: Vector3<f64> = gaps.iter().sum::<Vector3<f64>>() / count;
    (gaps.iter().map(|gap| (gap - mean).norm_squared()).sum::<f64>() / count).sqrt()
}
