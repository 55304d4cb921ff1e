//! A C: one arc across the seam with one swing of the tool, which shows little.

use super::swing::{Limits, Swing, Swings, even};
use crate::noise::Noise;
use std::f64::consts::PI;

/// Height of the arc in range over that along the stripe.
const IN_RANGE: f64 = 0.4;

/// The motion.
pub(super) fn drawn(noise: &mut Noise, limits: Limits) -> Swings {
    let parts = [noise.uniform(0.6, 1.0), noise.uniform(0.2, 0.6), noise.uniform(0.2, 0.6)];
    Box::new(move |time_s| {
        let progress = even(time_s, &limits);
        let arc = (PI * progress).cos();
        let turn = (PI * progress).sin();
        Swing {
            progress,
            in_sheet_m: [limits.in_sheet_m[0] * (2.0 * arc - 1.0), limits.in_sheet_m[1] * IN_RANGE * arc],
            tilt_rad: [turn * parts[0], arc * parts[1], turn * parts[2]].map(|part| part * limits.tilt_rad),
        }
    })
}
