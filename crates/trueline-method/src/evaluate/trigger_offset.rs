//! Measured time offset: the exposure output of the camera is wired to an input of the robot.
//!
//! The robot reads its inputs when it samples its pose, so an edge lies between two samples. With d the time offset, e half the exposure and s the
//! image's stamp, the exposure began at s − d − e. The stamps have logistic jitter of standard deviation σ and distribution function F. The
//! likelihood of an edge between samples at a and b is F(s − a − e − d) − F(s − b − e − d). The product over all edges is normalised over d. The
//! unknown σ is integrated out. If images and samples run in step, every edge lies at the same place between its samples. The product, and the
//! uncertainty, are then as wide as a cycle.

use crate::calibration::Calibration;
use crate::input::observations::origin_ns;
use crate::input::timestamps::{Dejittered, Sampling};
use crate::order_statistics::median;
use crate::problem::parameters::TIME_OFFSET;
use std::collections::BTreeMap;
use std::fmt;
use trueline_dataset::Recording;

/// Edges of a robot input, made by the exposures of a camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriggerEdges {
    /// For each rising edge the stamps of the robot's samples before and after it, ns.
    pub between_ns: Vec<[i64; 2]>,
    /// Length of an exposure, s.
    pub exposure_s: f64,
}

/// A measured time offset, with the estimated one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredOffset {
    /// Edges that belong to an image.
    pub edges: usize,
    /// The measured offset, s.
    pub offset_s: f64,
    /// Its standard deviation, s.
    pub sigma_s: f64,
    /// The estimated time offset and its standard deviation, s.
    pub estimated_s: [f64; 2],
}

impl MeasuredOffset {
    /// Difference of both in standard deviations.
    #[must_use]
    pub fn z(&self) -> f64 {
        (self.offset_s - self.estimated_s[0]) / self.sigma_s.hypot(self.estimated_s[1])
    }

    /// Whether both agree.
    #[must_use]
    pub fn agrees(&self) -> bool {
        self.z().abs() <= AGREES
    }
}

impl fmt::Display for MeasuredOffset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [estimated_ms, estimated_sigma_ms] = self.estimated_s.map(|s| 1e3 * s);
        let (measured_ms, sigma_ms) = (1e3 * self.offset_s, 1e3 * self.sigma_s);
        write!(
            f,
            "time offset measured by {} edges {measured_ms:.3} ± {sigma_ms:.3} ms, estimated {estimated_ms:.3} ± \
             {estimated_sigma_ms:.3} ms: ",
            self.edges
        )?;
        if self.agrees() {
            return write!(f, "they agree ({:.1} σ apart)", self.z().abs());
        }
        write!(
            f,
            "they contradict each other by {:.3} ms ({:.0} σ). Check the filter and delay of the input, the \
             edge of the pulse, and the meaning of the camera's output",
            (measured_ms - estimated_ms).abs(),
            self.z().abs()
        )
    }
}

/// Difference in standard deviations above which two answers contradict each other.
const AGREES: f64 = 4.0;
/// Minimum number of edges.
const LEAST_EDGES: usize = 10;
/// An edge belongs to an image if it is within this number of periods of the estimated start of exposure.
const WITHIN_PERIODS: f64 = 0.5;
/// Grid points of the offset, over the range that the edges allow, and of the jitter.
const OFFSETS: usize = 801;
const JITTERS_S: [f64; 9] = [1e-5, 2e-5, 4e-5, 8e-5, 1.6e-4, 3.2e-4, 6.4e-4, 1.28e-3, 2.56e-3];

/// Measures the time offset of a calibrated recording from edges. `None` with too few of them, or if no offset was estimated.
///
/// The estimate assigns each edge to an exposure, so an error by whole periods of the camera is not detected.
#[must_use]
pub fn measured_offset(
    recording: &Recording,
    trigger: &TriggerEdges,
    calibration: &Calibration,
) -> Option<MeasuredOffset> {
    let estimated_s = [calibration.best_fit().time_offset_s, calibration.sigma(TIME_OFFSET)?];
    let stamps = &calibration.findings.streams;
    let dejittered = Dejittered { robot: stamps.robot.dejittered, images: stamps.images.dejittered };
    let bounds_s = bounds_s(recording, trigger, dejittered, estimated_s[0]);
    let (edges, (offset_s, sigma_s)) = (bounds_s.len(), likely(&bounds_s)?);
    Some(MeasuredOffset { edges, offset_s, sigma_s, estimated_s })
}

/// Bounds of the time offset from every edge, s.
fn bounds_s(
    recording: &Recording,
    trigger: &TriggerEdges,
    dejittered: Dejittered,
    estimated_s: f64,
) -> Vec<[f64; 2]> {
    let origin_ns = origin_ns(recording);
    let sampling = Sampling::of(recording, origin_ns);
    let seconds = |ns: i64| (ns - origin_ns) as f64 * 1e-9;
    // The clocks of the estimate.
    let robot_s = sampling.robot_times_s(dejittered);
    let robot: BTreeMap<i64, f64> =
        recording.robot.iter().map(|sample| sample.stamp_ns).zip(robot_s.iter().copied()).collect();
    let mut images_s = sampling.image_times_s(dejittered).to_vec();
    images_s.dedup();
    let Some(period_s) = median(images_s.windows(2).map(|pair| pair[1] - pair[0])) else {
        return Vec::new();
    };
    let (half_s, within_s) = (0.5 * trigger.exposure_s, WITHIN_PERIODS * period_s);
    let clock_s = |ns: i64| robot.get(&ns).copied().unwrap_or_else(|| seconds(ns));
    let bounds = trigger.between_ns.iter().filter_map(|[before_ns, after_ns]| {
        let (before_s, after_s) = (clock_s(*before_ns), clock_s(*after_ns));
        let middle_s = 0.5 * (before_s + after_s);
        let likely_s = middle_s + estimated_s + half_s;
        let later = images_s.partition_point(|stamp_s| *stamp_s < likely_s);
        let near = [later.checked_sub(1), Some(later)].into_iter().flatten();
        let stamp_s = near
            .filter_map(|k| images_s.get(k).copied())
            .min_by(|a, b| (a - likely_s).abs().total_cmp(&(b - likely_s).abs()))?;
        let is_its = (stamp_s - likely_s).abs() < within_s;
        is_its.then_some([stamp_s - after_s - half_s, stamp_s - before_s - half_s])
    });
    bounds.collect()
}

/// Mean and standard deviation of the time offset from the likelihood.
fn likely(bounds_s: &[[f64; 2]]) -> Option<(f64, f64)> {
    if bounds_s.len() < LEAST_EDGES {
        return None;
    }
    // The method tolerates a few edges of another source.
    let middles = || bounds_s.iter().map(|[low, high]| 0.5 * (low + high));
    let middle_s = median(middles())?;
    let width_s = median(bounds_s.iter().map(|[low, high]| high - low))?;
    let reach_s = 2.0 * width_s + 6.0 * median(middles().map(|m| (m - middle_s).abs()))?;
    let step_s = 2.0 * reach_s / (OFFSETS - 1) as f64;
    let at = |k: usize| middle_s - reach_s + step_s * k as f64;
    let logs: Vec<(f64, f64)> = (0..OFFSETS)
        .flat_map(|k| JITTERS_S.map(|jitter_s| (at(k), log_likelihood(bounds_s, at(k), jitter_s))))
        .collect();
    let best = logs.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
    let moment = |power: &dyn Fn(f64) -> f64| -> f64 {
        logs.iter().map(|(offset_s, log)| (log - best).exp() * power(*offset_s)).sum()
    };
    let weight = moment(&|_| 1.0);
    let mean = moment(&|offset_s| offset_s) / weight;
    let variance = moment(&|offset_s| (offset_s - mean).powi(2)) / weight;
    // At least the resolution of the grid.
    Some((mean, variance.sqrt().hypot(step_s / 12_f64.sqrt())))
}

/// Likelihood of an edge without an explanation: one in a thousand.
const STRAY: f64 = 1e-3;

fn log_likelihood(bounds_s: &[[f64; 2]], offset_s: f64, jitter_s: f64) -> f64 {
    let scale_s = jitter_s * 3_f64.sqrt() / std::f64::consts::PI;
    let below = |bound_s: f64| 0.5 * (1.0 + (0.5 * (bound_s - offset_s) / scale_s).tanh());
    bounds_s.iter().map(|[low, high]| (below(*high) - below(*low)).max(0.0) + STRAY).map(f64::ln).sum()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    const OFFSET_S: f64 = 0.0213;
    const CYCLE_S: f64 = 0.002;

    /// Edges of periodic exposures, read by a robot that samples on a grid, with jitter of the stamps.
    fn edges(period_s: f64, jitter_s: f64, count: usize, seed: u64) -> Vec<[f64; 2]> {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut uniform = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..count)
            .map(|k| {
                let began_s = 0.000_37 + k as f64 * period_s;
                // The sum of twelve uniform numbers is nearly normal.
                let noise = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                let stamp_s = began_s + OFFSET_S + jitter_s * noise;
                let after_s = (began_s / CYCLE_S).ceil() * CYCLE_S;
                [stamp_s - after_s, stamp_s - after_s + CYCLE_S]
            })
            .collect()
    }

    #[test]
    fn the_offset_is_within_its_sigma_as_often_as_it_should_be() {
        for (jitter_s, period_s) in [(1e-5, 0.0303), (2e-4, 0.0303), (1e-3, 0.0271)] {
            let z: Vec<f64> = (1..=12)
                .map(|seed| {
                    let (offset_s, sigma_s) = likely(&edges(period_s, jitter_s, 100, seed)).unwrap();
                    // Far better than a cycle.
                    assert!(sigma_s < 2e-4, "{sigma_s}");
                    (offset_s - OFFSET_S) / sigma_s
                })
                .collect();
            let rms = (z.iter().map(|z| z * z).sum::<f64>() / 12.0).sqrt();
            // The RMS of 12 draws is one within 20 %. The limit is three of these.
            assert!(rms < 1.6, "{rms} at {jitter_s} s");
        }
    }

    #[test]
    fn images_in_step_with_the_samples_leave_a_cycle() {
        // Fifteen cycles a period: every edge lies at the same place between its samples.
        let (offset_s, sigma_s) = likely(&edges(0.030, 1e-6, 400, 1)).unwrap();
        let uniform_s = CYCLE_S / 12_f64.sqrt();
        // Small jitter of the stamps is not visible in the edges. It reduces the cycle at both ends.
        assert!((0.8 * uniform_s..1.02 * uniform_s).contains(&sigma_s), "{sigma_s}");
        assert!((offset_s - OFFSET_S).abs() < 0.5 * CYCLE_S);
    }

    #[test]
    fn a_few_edges_of_something_else_do_not_matter_and_too_few_are_no_measurement() {
        let mut with_others = edges(0.0303, 5e-5, 200, 3);
        with_others.extend((0..8).map(|k| [0.03 + 1e-4 * f64::from(k), 0.032 + 1e-4 * f64::from(k)]));
        let (offset_s, sigma_s) = likely(&with_others).unwrap();
        assert!((offset_s - OFFSET_S).abs() < 4.0 * sigma_s, "{offset_s} ± {sigma_s}");
        assert_eq!(likely(&with_others[..9]), None);
    }
}
