//! The weave of a robot's own software: one frequency for everything. The scan looks the same one period later.

use super::swing::{Limits, Swing, Swings, Wave, even};
use crate::noise::Noise;

/// Frequencies, Hz.
const HZ: [f64; 2] = [0.4, 1.5];
/// Amplitudes as parts of the limits.
const OF_LIMIT: [f64; 2] = [0.6, 1.0];

/// The motion.
pub(super) fn drawn(noise: &mut Noise, limits: Limits) -> Swings {
    let hz = noise.uniform(HZ[0].ln(), HZ[1].ln()).exp();
    let mut wave = |limit: f64| {
        let amplitude = limit * noise.uniform(OF_LIMIT[0], OF_LIMIT[1]);
        Wave::drawn(noise, amplitude, hz)
    };
    let place = limits.in_sheet_m.map(&mut wave);
    let tilt = [limits.tilt_rad; 3].map(&mut wave);
    Box::new(move |time_s| Swing {
        progress: even(time_s, &limits),
        in_sheet_m: place.map(|wave| wave.at(time_s)),
        tilt_rad: tilt.map(|wave| wave.at(time_s)),
    })
}
