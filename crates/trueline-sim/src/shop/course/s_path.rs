//! An S: sines of different frequencies on everything, at constant speed.

use super::swing::{Limits, Swing, Swings, Wave, even};
use crate::noise::Noise;

/// Frequencies of place and of tilt, Hz.
const PLACE_HZ: [f64; 2] = [0.15, 0.7];
const TILT_HZ: [f64; 2] = [0.08, 0.5];
/// Amplitudes as parts of the limits.
const OF_LIMIT: [f64; 2] = [0.6, 1.0];
/// No wave is longer than this part of the scan.
const LONGEST: f64 = 0.7;

/// The motion.
pub(super) fn drawn(noise: &mut Noise, limits: Limits) -> Swings {
    let mut wave = |limit: f64, [low, high]: [f64; 2]| {
        let hz = noise.uniform(low.ln(), high.ln()).exp().max(1.0 / (LONGEST * limits.duration_s));
        let amplitude = limit * noise.uniform(OF_LIMIT[0], OF_LIMIT[1]);
        Wave::drawn(noise, amplitude, hz)
    };
    let place = limits.in_sheet_m.map(|limit| wave(limit, PLACE_HZ));
    let tilt = [limits.tilt_rad; 3].map(|limit| wave(limit, TILT_HZ));
    Box::new(move |time_s| Swing {
        progress: even(time_s, &limits),
        in_sheet_m: place.map(|wave| wave.at(time_s)),
        tilt_rad: tilt.map(|wave| wave.at(time_s)),
    })
}
