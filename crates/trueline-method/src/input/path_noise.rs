//! Autocorrelation of the noise of the robot's path.
//!
//! The noise of recorded poses is independent from sample to sample. That of a path through them is not. A path is linear in its samples: with W(t)
//! its response to one sample, the noise at two times a lag τ apart has the correlation R(τ) = ∫ W(t) W(t + τ) dt / ∫ W² dt. A local quadratic is a
//! low-pass filter with negative side lobes. Images 1.25 to 2 half windows apart have noise of opposite sign, and closer ones share it.

use nalgebra::{Translation3, Vector3};
use trueline_geometry::{Pose, Trajectory};

/// The correlation of the path's noise as a function of the lag.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NoiseCorrelation {
    step_s: f64,
    /// Values at multiples of the step. Zero beyond.
    at_steps: Vec<f64>,
}

/// Steps in a period. The correlation is linear between them.
const STEPS: usize = 16;
/// Samples on each side that affect the curve between two of them, with margin.
const CURVED: usize = 8;

impl NoiseCorrelation {
    /// For the paths that `through` makes of samples `period_s` apart. The response to one sample ends within `reach_s` and some periods.
    #[must_use]
    pub fn of(
        period_s: f64,
        reach_s: f64,
        through: impl Fn(&[f64], &[Pose]) -> Option<Trajectory>,
    ) -> Option<Self> {
        let side = (reach_s / period_s).ceil() as usize + CURVED;
        let middle = 2 * side;
        let times: Vec<f64> = (0..=2 * middle).map(|k| (k as f64 - middle as f64) * period_s).collect();
        let mut poses = vec![Pose::identity(); times.len()];
        poses[middle].translation = Translation3::from(Vector3::x());
        let path = through(&times, &poses)?;
        let step_s = period_s / STEPS as f64;
        let within = (side * STEPS) as i64;
        let response: Option<Vec<f64>> =
            (-within..=within).map(|k| Some(path.pose_at(k as f64 * step_s)?.translation.x)).collect();
        let response = response?;
        let product = |lag: usize| response.iter().zip(&response[lag..]).map(|(a, b)| a * b).sum::<f64>();
        let whole = product(0);
        let at_steps = (0..response.len()).map(|lag| product(lag) / whole).collect();
        (whole > 0.0).then_some(Self { step_s, at_steps })
    }

    /// The correlation at a lag, s.
    #[must_use]
    pub fn over(&self, apart_s: f64) -> f64 {
        let steps = apart_s.abs() / self.step_s;
        let before = steps as usize;
        let at = |k: usize| self.at_steps.get(k).copied().unwrap_or(0.0);
        if steps.is_finite() { at(before) + (at(before + 1) - at(before)) * steps.fract() } else { 0.0 }
    }

    /// Lag beyond which the correlation is zero, s.
    #[must_use]
    pub(crate) fn reach_s(&self) -> f64 {
        self.step_s * self.at_steps.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::NoiseCorrelation;
    use nalgebra::{Translation3, Vector3};
    use trueline_geometry::{Pose, Trajectory, smooth};

    const PERIOD_S: f64 = 0.004;
    const HALF_WINDOW_S: f64 = 0.020;

    fn through(times: &[f64], poses: &[Pose]) -> Option<Trajectory> {
        let smoothed = smooth::local_quadratic(times, poses, 1.0, HALF_WINDOW_S);
        Trajectory::new(times.to_vec(), &smoothed).ok()
    }

    #[test]
    fn straight_lines_between_samples_share_them() {
        // W is a triangle of half a width T: R(τ)/R(0) = 1 − 3/2 τ² + 3/4 τ³ up to T, (2 − τ)³/4 up to 2 T. Steps of T/16: 2e-3.
        let straight = |times: &[f64], poses: &[Pose]| Trajectory::new(times.to_vec(), poses).ok();
        let found = NoiseCorrelation::of(PERIOD_S, 0.0, straight).unwrap();
        for k in 0..30 {
            let periods = 0.09 * f64::from(k);
            let expected = match periods {
                0.0..1.0 => 1.0 - 1.5 * periods.powi(2) + 0.75 * periods.powi(3),
                1.0..2.0 => (2.0 - periods).powi(3) / 4.0,
                _ => 0.0,
            };
            assert!((found.over(periods * PERIOD_S) - expected).abs() < 3e-3, "{periods}");
        }
    }

    #[test]
    fn it_is_that_of_noise() {
        // Noise of 40,000 samples through the same path: over three axes a correlation is known to 1/√(3 · 40,000 · 4/20) = 0.0065.
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let times: Vec<f64> = (0..40_000).map(|k| f64::from(k) * PERIOD_S).collect();
        let poses: Vec<Pose> = times
            .iter()
            .map(|_| Pose::from(Translation3::from(Vector3::new(uniform(), uniform(), uniform()))))
            .collect();
        let path = through(&times, &poses).unwrap();
        let found = NoiseCorrelation::of(PERIOD_S, HALF_WINDOW_S, through).unwrap();
        for lag_s in [0.003, 0.010, 0.020, 0.0303, 0.036, 0.060] {
            let (mut product, mut power) = (0.0, 0.0);
            for k in 0..30_000 {
                let time_s = 1.0 + 0.004_1 * f64::from(k);
                let place = |time_s: f64| path.pose_at(time_s).unwrap().translation.vector;
                let (here, there) = (place(time_s), place(time_s + lag_s));
                product += here.dot(&there);
                power += here.norm_squared();
            }
            // Three of its standard deviations.
            assert!((found.over(lag_s) - product / power).abs() < 0.02, "{lag_s}: {}", product / power);
        }
        assert!(found.over(0.0303) < -0.05);
        assert_eq!(found.over(0.0), 1.0);
    }
}
