//! Timing of a path: from rest to its own pace and back, always along the path.
//!
//! The path's time runs at a rate between 0 and 1. The commanded rate is a ramp, `q' = ±ρ`. The rate follows it by a lag,
//! `r' = (q − r)/W`. Then `|r'| ≤ ρ` and `|r''| ≤ 2ρ/W` for any commands at any times, and the path time before rest is
//! `q²/(2ρ) + W·r`, exactly.

/// How quickly the rate may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// Greatest change of the rate, 1/s.
    pub slope_per_s: f64,
    /// Lag behind the ramp, s.
    pub lag_s: f64,
}

/// Place on the path, and rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathState {
    /// Time on the path, s.
    pub path_s: f64,
    /// Commanded rate, 0 to 1.
    pub asked: f64,
    /// Rate, 0 to 1.
    pub rate: f64,
}

/// A rate below this is rest: of 250 mm/s it is 0.0025 mm/s.
const REST: f64 = 1e-5;

impl PathState {
    /// Path time that passes until rest if braking begins now, s.
    #[must_use]
    pub(crate) fn until_rest_s(&self, ramp: Ramp) -> f64 {
        self.asked * self.asked / (2.0 * ramp.slope_per_s) + ramp.lag_s * self.rate
    }

    /// Whether it rests.
    #[must_use]
    pub fn rests(&self) -> bool {
        self.asked == 0.0 && self.rate == 0.0
    }

    /// The motion after so long, speeding up (or keeping the path's pace) or braking.
    #[must_use]
    pub fn after(self, elapsed_s: f64, ramp: Ramp, go: bool) -> Self {
        let (slope, most_s) = if go {
            (ramp.slope_per_s, (1.0 - self.asked) / ramp.slope_per_s)
        } else {
            (-ramp.slope_per_s, self.asked / ramp.slope_per_s)
        };
        let ramped_s = elapsed_s.min(most_s);
        let mut on_path = self.along(ramped_s, slope, ramp.lag_s);
        if elapsed_s >= most_s {
            on_path.asked = if go { 1.0 } else { 0.0 };
            on_path = on_path.along(elapsed_s - ramped_s, 0.0, ramp.lag_s);
        }
        if on_path.asked == 0.0 && on_path.rate < REST {
            on_path.rate = 0.0;
        }
        on_path
    }

    /// Exact solution of the two equations for a constant slope.
    fn along(self, for_s: f64, slope: f64, lag_s: f64) -> Self {
        let forgotten = -(-for_s / lag_s).exp_m1();
        // r = q(t) − slope·W + (r₀ − q₀ + slope·W)·e^(−t/W)
        let settling = self.rate - self.asked + slope * lag_s;
        let asked = self.asked + slope * for_s;
        Self {
            path_s: self.path_s
                + (self.asked - slope * lag_s) * for_s
                + 0.5 * slope * for_s * for_s
                + settling * lag_s * forgotten,
            asked,
            rate: asked - slope * lag_s + settling * (1.0 - forgotten),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RAMP: Ramp = Ramp { slope_per_s: 1.7, lag_s: 0.12 };

    #[test]
    fn the_way_to_rest_is_what_it_says() {
        for (asked, rate) in [(1.0, 1.0), (1.0, 0.3), (0.2, 0.7), (0.0, 0.5)] {
            let mut on_path = PathState { path_s: 3.0, asked, rate };
            let expected = 3.0 + on_path.until_rest_s(RAMP);
            for _ in 0..2000 {
                on_path = on_path.after(0.004, RAMP, false);
            }
            assert!(on_path.rests());
            // The part that REST cuts off: lag · 1e-5.
            assert!((on_path.path_s - expected).abs() < 2e-6, "{} is not {expected}", on_path.path_s);
        }
    }

    /// Against many small Euler steps: their error is of first order in the step, 2e-6 here.
    #[test]
    fn the_solution_is_that_of_its_equations() {
        let start = PathState { path_s: 0.0, asked: 0.4, rate: 0.1 };
        let exact = start.after(0.5, RAMP, true);
        let (mut euler, step) = (start, 1e-6);
        for _ in 0..500_000 {
            euler.path_s += euler.rate * step;
            euler.rate += (euler.asked - euler.rate) / RAMP.lag_s * step;
            euler.asked = (euler.asked + RAMP.slope_per_s * step).min(1.0);
        }
        assert!((exact.path_s - euler.path_s).abs() < 5e-6 && (exact.rate - euler.rate).abs() < 5e-6);
    }

    #[test]
    fn whatever_is_asked_the_bounds_hold() {
        let (mut on_path, mut before) = (PathState::default(), PathState::default());
        let (dt, mut change_before) = (0.001, 0.0);
        for k in 0..20_000_u32 {
            // An arbitrary but fixed sequence of commands.
            let go = (k.wrapping_mul(2_654_435_761) >> 22) % 3 != 0;
            on_path = on_path.after(dt, RAMP, go);
            let change = (on_path.rate - before.rate) / dt;
            assert!((0.0..=1.0).contains(&on_path.rate) && (0.0..=1.0).contains(&on_path.asked));
            // Setting a rate below REST to zero changes it by 1e-5 at most.
            assert!(change.abs() <= RAMP.slope_per_s + 1e-5 / dt);
            assert!(
                (change - change_before).abs() / dt <= 2.0 * RAMP.slope_per_s / RAMP.lag_s + 2e-5 / dt / dt
            );
            (before, change_before) = (on_path, change);
        }
    }
}
