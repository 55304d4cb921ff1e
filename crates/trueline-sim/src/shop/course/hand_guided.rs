//! A hand that guides the robot: slow swings of all frequencies, the slower the larger, and uneven progress.

use super::swing::{Limits, Swing, Swings, Wave, even};
use crate::noise::Noise;

/// Waves of each quantity and their frequencies, Hz.
const WAVES: usize = 7;
const HZ: [f64; 2] = [0.06, 1.0];
/// Largest deviation of the progress from an even one, as a part of the scan.
const UNEVEN: f64 = 0.06;
/// The waves of a quantity reach this many of its standard deviations now and then.
const REACH: f64 = 2.0;

/// The motion.
pub(super) fn drawn(noise: &mut Noise, limits: Limits) -> Swings {
    let mut waves = |limit: f64| -> [Wave; WAVES] {
        let hertz: [f64; WAVES] = std::array::from_fn(|_| noise.uniform(HZ[0].ln(), HZ[1].ln()).exp());
        let weights = hertz.map(|hz| 1.0 / hz.sqrt());
        let rms = (0.5 * weights.iter().map(|weight| weight * weight).sum::<f64>()).sqrt();
        std::array::from_fn(|k| Wave::drawn(noise, limit / REACH * weights[k] / rms, hertz[k]))
    };
    let progress = waves(UNEVEN);
    let place = limits.in_sheet_m.map(&mut waves);
    let tilt = [limits.tilt_rad * 1.2; 3].map(&mut waves);
    let sum = |waves: &[Wave; WAVES], time_s: f64| waves.iter().map(|wave| wave.at(time_s)).sum::<f64>();
    Box::new(move |time_s| Swing {
        progress: even(time_s, &limits) + sum(&progress, time_s),
        in_sheet_m: place.each_ref().map(|waves| sum(waves, time_s)),
        tilt_rad: tilt.each_ref().map(|waves| sum(waves, time_s)),
    })
}
