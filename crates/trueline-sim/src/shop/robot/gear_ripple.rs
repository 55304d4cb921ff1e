//! Transmission error of strain-wave gears: the link swings about its encoder, twice and four times a turn of the wave generator.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use std::f64::consts::TAU;
use trueline_geometry::arm::six_axes::AXES;

/// Ratios of such gears.
const RATIOS: [f64; 2] = [80.0, 160.0];
/// Amplitude of four cycles a turn over that of two.
const SECOND: f64 = 0.5;
/// Joints are alike but for this, as a part.
const BETWEEN_JOINTS: f64 = 0.2;

/// The ripple of all joints.
pub(crate) struct GearRipple {
    /// Amplitude (rad), cycles in a radian of the joint, and both phases (rad).
    joints: [(f64, f64, [f64; 2]); AXES],
}

impl GearRipple {
    pub(crate) fn of(errors: &DrawnErrors) -> Option<Self> {
        let size_rad = errors.size(ShopError::GearRipple)?;
        let mut noise = errors.noise(ShopError::GearRipple, 1);
        let joints = std::array::from_fn(|_| {
            let amplitude = size_rad * noise.normal(BETWEEN_JOINTS).exp();
            let ratio = noise.uniform(RATIOS[0], RATIOS[1]);
            (amplitude, ratio, [noise.uniform(0.0, TAU), noise.uniform(0.0, TAU)])
        });
        Some(Self { joints })
    }

    /// How far each link is off its encoder, rad.
    pub(crate) fn at(&self, angles: &[f64; AXES]) -> [f64; AXES] {
        std::array::from_fn(|k| {
            let (amplitude, ratio, [first, second]) = self.joints[k];
            let turn = ratio * angles[k];
            amplitude * ((2.0 * turn + first).sin() + SECOND * (4.0 * turn + second).sin())
        })
    }
}
