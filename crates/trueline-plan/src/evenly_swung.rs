//! Sweeps at many times in a row. If these are evenly spaced, a swing's sine and cosine are rotated by one step instead of
//! computed anew.

use crate::sweep::Sweep;

/// Swings of the five sweeps.
const SWINGS: usize = 10;
/// This many rotations in a row add up to some 1e-12 rad of rounding, most of it that of the times.
const TURNS: usize = 64;
/// Two times are evenly spaced if they differ from a step by less than this, s: at 1.2 Hz 64 of these are 5e-11 rad.
const EVEN_S: f64 = 1e-13;

/// See the module.
pub(crate) struct EvenlySwung<'a> {
    sweeps: [&'a Sweep; 5],
    step_s: f64,
    /// Cosine and sine of the turn of each swing over a step.
    by: [[f64; 2]; SWINGS],
    /// The same of each swing now.
    now: [[f64; 2]; SWINGS],
    last_s: f64,
    turns: usize,
}

impl<'a> EvenlySwung<'a> {
    /// For times that are mostly a step, s, apart.
    pub(crate) fn new(sweeps: [&'a Sweep; 5], step_s: f64) -> Self {
        let by = each(sweeps, |angular_rad_s, _| angular_rad_s * step_s);
        Self { sweeps, step_s, by, now: [[0.0; 2]; SWINGS], last_s: f64::NEG_INFINITY, turns: 0 }
    }

    /// The values of the sweeps at a time, s.
    pub(crate) fn at(&mut self, time_s: f64) -> [f64; 5] {
        if self.turns < TURNS && (time_s - self.last_s - self.step_s).abs() < EVEN_S {
            for ([c, s], [by_c, by_s]) in self.now.iter_mut().zip(&self.by) {
                (*c, *s) = (*c * by_c - *s * by_s, *s * by_c + *c * by_s);
            }
            self.turns += 1;
        } else {
            self.now = each(self.sweeps, |angular_rad_s, phase_rad| angular_rad_s * time_s + phase_rad);
            self.turns = 0;
        }
        self.last_s = time_s;
        std::array::from_fn(|k| {
            let Sweep { mean, swings: [a, b] } = self.sweeps[k];
            mean + a.amplitude * self.now[2 * k][1] + b.amplitude * self.now[2 * k + 1][1]
        })
    }
}

/// Cosine and sine of an angle of each swing, from its angular frequency and phase.
fn each(sweeps: [&Sweep; 5], angle: impl Fn(f64, f64) -> f64) -> [[f64; 2]; SWINGS] {
    std::array::from_fn(|k| {
        let swing = &sweeps[k / 2].swings[k % 2];
        let (s, c) = angle(std::f64::consts::TAU * swing.frequency_hz, swing.phase_rad).sin_cos();
        [c, s]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::Swing;

    #[test]
    fn turned_on_it_is_what_it_is_when_asked_for_anew() {
        let swing = |k: f64| Swing { amplitude: 0.1 * k, frequency_hz: 0.2 * k, phase_rad: k };
        let sweep = |k: f64| Sweep { mean: k, swings: [swing(k), swing(k + 0.5)] };
        let sweeps = [1.0, 2.0, 3.0, 4.0, 5.0].map(sweep);
        let mut swung = EvenlySwung::new(sweeps.each_ref(), 0.004);
        let mut time_s = 0.3;
        for k in 0..5000 {
            // Now and then the steps are uneven.
            time_s += if k % 700 < 50 { 0.003 } else { 0.004 };
            for (value, sweep) in swung.at(time_s).into_iter().zip(&sweeps) {
                // Times of 20 s are rounded to 2e-15, at up to 7 rad/s; 64 of these all one way are 1e-12 of an amplitude of 1.
                assert!((value - sweep.at(time_s)).abs() < 1e-12, "{k}");
            }
        }
    }
}
