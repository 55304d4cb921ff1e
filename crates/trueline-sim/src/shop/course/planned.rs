//! A designed scan: passes there and back, at rest at their ends, with the sensor spun further each time and all else swinging.

use super::swing::{Limits, Swing, Swings, Wave};
use crate::noise::Noise;
use std::f64::consts::TAU;

/// Passes over the seam.
const PASSES: f64 = 3.0;
/// Spin of the first and the last pass over the limit of tilts.
const SPIN: f64 = 1.6;
/// Frequencies of the swings in a pass: no two are alike, and none is a multiple of another.
const CYCLES: [f64; 4] = [1.31, 1.87, 0.83, 1.13];

/// The motion.
pub(super) fn drawn(noise: &mut Noise, limits: Limits) -> Swings {
    let pass_s = limits.duration_s / PASSES;
    let mut wave = |limit: f64, cycles: f64| Wave::drawn(noise, limit, cycles / pass_s);
    let place = [wave(limits.in_sheet_m[0], CYCLES[0]), wave(limits.in_sheet_m[1], CYCLES[1])];
    let tilt = [wave(0.7 * limits.tilt_rad, CYCLES[2]), wave(0.7 * limits.tilt_rad, CYCLES[3])];
    Box::new(move |time_s| {
        let run = (time_s / pass_s).clamp(0.0, PASSES);
        let pass = run.floor().min(PASSES - 1.0);
        let part = run - pass;
        let eased = part - (TAU * part).sin() / TAU;
        let progress = if (pass as u32).is_multiple_of(2) { eased - 0.5 } else { 0.5 - eased };
        // A cosine from one side to the other over the whole scan.
        let spin = -SPIN * limits.tilt_rad * (0.5 * TAU * run / PASSES).cos();
        Swing {
            progress,
            in_sheet_m: place.map(|wave| wave.at(time_s)),
            tilt_rad: [tilt[0].at(time_s), tilt[1].at(time_s), spin],
        }
    })
}
