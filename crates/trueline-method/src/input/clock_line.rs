//! Fits lines to the stamps of a stream over its ticks: through their middle in pieces, or along their floor.

use crate::input::clock_count::steps_of;
use crate::input::lateness::Lateness;
use crate::order_statistics::{mad_sigma, median, quantile};

/// Kind of fit to the stamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitKind {
    /// Through their middle: jitter on both sides.
    LeastSquares,
    /// Along their lower hull: delays on one side only \[Zhang2002\].
    LowerEnvelope,
}

/// A stream that was sampled at regular intervals.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamClock {
    /// Time of each sample, by the receiver's clock, s.
    pub regular_s: Vec<f64>,
    /// Time between samples, s.
    pub period_s: f64,
    /// Standard deviation of a receive stamp about the regular one, s.
    pub jitter_s: f64,
    /// Standard deviation of the common error of all fitted stamps, s.
    pub phase_sigma_s: f64,
    /// Rate of the device's clock against the receiver's, parts per million; `None` without device stamps.
    pub device_drift_ppm: Option<f64>,
    /// Kind of fit.
    pub fit_kind: FitKind,
    /// Pieces with their own phase: after a clock step, or after a pause.
    pub pieces: usize,
    /// Time and height of each step of the receive clock, s.
    pub steps: Vec<(f64, f64)>,
    /// Whether the only step was removed. The samples before it are then dated by the clock after it.
    pub step_taken_out: bool,
    /// Largest deviation of the clock from a regular tick, if the regular stamps follow it, s. 0 if they do not.
    pub wander_s: f64,
    /// Lateness of the stamps relative to the regular ones.
    pub lateness: Lateness,
}

impl StreamClock {
    /// Whether it follows the earliest stamps, because jitter is one-sided.
    #[must_use]
    pub(crate) fn is_one_sided(&self) -> bool {
        self.fit_kind == FitKind::LowerEnvelope
    }

    /// The stamps minus the regular ones, s, without a removed step.
    pub(crate) fn deviations_s(&self, stamps_s: &[f64]) -> Vec<f64> {
        let before = |stamp_s: f64| match self.steps.first() {
            Some((at_s, height_s)) if self.step_taken_out && stamp_s < *at_s => *height_s,
            _ => 0.0,
        };
        stamps_s.iter().zip(&self.regular_s).map(|(s, regular)| s - regular + before(*s)).collect()
    }
}

/// Stamps on each side of a suspected clock step.
const STEP_WINDOW: usize = 20;
/// Lower bound of the standard deviation, s. Steps of a few microseconds are negligible.
pub(crate) const LEAST_STEP_S: f64 = 1e-5;
/// Stamps on each side over which a step must last.
const STAY_WINDOW: usize = 200;
/// Fraction of stamps below the estimated floor.
pub(crate) const FLOOR: f64 = 0.1;
/// Least height of a step, in standard deviations of the difference of two medians.
pub(crate) const STEP_SIGMAS: f64 = 8.0;
/// A stamp with a larger deviation has little weight on the period, standard deviations.
pub(crate) const HUBER_SIGMAS: f64 = 2.0;
/// A pause is longer than this many ticks.
pub(crate) const SILENCE_TICKS: f64 = 4.0;

/// Jitter from the steps between neighbours. The standard deviation of a step is √2 times that of a stamp.
pub(crate) fn white_jitter(stamps_s: &[f64], ticks: &[f64], period: f64) -> f64 {
    let off: Vec<f64> = steps_of(stamps_s).zip(steps_of(ticks)).map(|(s, t)| s - t * period).collect();
    let at = |part| quantile(off.iter().copied(), part).unwrap_or(0.0);
    // Half the distance of these quantiles is a Gaussian's standard deviation. With stamps in whole milliseconds more than half of the steps may be
    // equal, and their median absolute deviation 0.
    let spread = 0.5 * (at(0.84) - at(0.16));
    let of_steps = mad_sigma(&off);
    let sigma = if of_steps < 0.5 * spread { spread } else { of_steps };
    sigma / std::f64::consts::SQRT_2
}

/// First index of each piece with its own phase, and the end.
pub(crate) fn piece_edges(detrended: &[f64], white: f64) -> Vec<usize> {
    let n = detrended.len();
    // The difference of the medians of two sets of w samples has 1.2533 √(2/w) times the standard deviation of one sample.
    let limit = STEP_SIGMAS * (1.2533 * (2.0 / STEP_WINDOW as f64).sqrt() * white).max(LEAST_STEP_S);
    let level = |from: usize, to: usize| median(detrended[from..to].iter().copied()).unwrap_or(0.0);
    let mut edges = vec![0];
    // The edge and the height between its two neighbours.
    let mut best: Option<(usize, f64)> = None;
    for k in STEP_WINDOW..=n.saturating_sub(STEP_WINDOW) {
        // A clock step is visible between two neighbours. This test is cheap.
        let here = if k < n { (detrended[k] - detrended[k - 1]).abs() } else { 0.0 };
        let height = if here > 0.5 * limit {
            (level(k, (k + STEP_WINDOW).min(n)) - level(k - STEP_WINDOW, k)).abs()
        } else {
            0.0
        };
        if height > limit && best.is_none_or(|(_, h)| here > h) {
            best = Some((k, here));
        }
        if let Some((edge, _)) = best
            && k >= edge + STEP_WINDOW
        {
            edges.push(edge);
            best = None;
        }
    }
    edges.extend(best.map(|(edge, _)| edge));
    edges.push(n);
    // A step lasts, and moves the earliest stamps like the middle ones. Successive delays do neither.
    let floor = |from: usize, to: usize| quantile(detrended[from..to].iter().copied(), FLOOR).unwrap_or(0.0);
    let stays = |&edge: &usize| {
        let (before, after) = (edge.saturating_sub(STAY_WINDOW), (edge + STAY_WINDOW).min(n));
        let steps =
            |of: &dyn Fn(usize, usize) -> f64| (of(edge, after) - of(before, edge)).abs() > 0.5 * limit;
        edge == 0 || edge == n || (steps(&level) && steps(&floor))
    };
    edges.into_iter().filter(stays).collect()
}

/// One period for all pieces, by robust least squares.
pub(crate) fn pooled_period(
    stamps_s: &[f64],
    ticks: &[f64],
    edges: &[usize],
    white: f64,
    rough_period: f64,
) -> Option<f64> {
    let mut period = rough_period;
    for _ in 0..4 {
        let (mut top, mut bottom) = (0.0, 0.0);
        for piece in edges.windows(2) {
            let range = piece[0]..piece[1];
            let off: Vec<f64> = range.clone().map(|k| stamps_s[k] - ticks[k] * period).collect();
            let phase = median(off.iter().copied())?;
            let weight = |off: f64| (HUBER_SIGMAS * white.max(1e-9) / (off - phase).abs()).min(1.0);
            let sums = range.clone().zip(&off).fold([0.0; 3], |[w, t, y], (k, off)| {
                let own = weight(*off);
                [w + own, t + own * ticks[k], y + own * off]
            });
            let [mean_tick, mean_off] = [sums[1] / sums[0], sums[2] / sums[0]];
            for (k, off) in range.zip(&off) {
                let tick = ticks[k] - mean_tick;
                top += weight(*off) * tick * (off - mean_off);
                bottom += weight(*off) * tick * tick;
            }
        }
        period += top / bottom;
    }
    period.is_finite().then_some(period)
}

/// Smaller steps are left in the stamps, s. They are below the jitter of an ordinary receiver.
const LEAST_TAKEN_OUT_S: f64 = 0.2e-3;
/// Larger steps are left in too, s. Setting a receiver's clock makes smaller steps, so the source may have paused.
const MOST_TAKEN_OUT_S: f64 = 12e-3;

/// The clock through the middle of each piece. A single step is removed if no sample is missing at it.
pub(crate) fn through_middle(
    stamps_s: &[f64],
    ticks: &[f64],
    residuals: &[f64],
    edges: &[usize],
    period_s: f64,
) -> StreamClock {
    let pieces: Vec<&[usize]> = edges.windows(2).collect();
    let phases: Vec<f64> = pieces.iter().map(|piece| middle(&residuals[piece[0]..piece[1]])).collect();
    // After a pause a stream may continue with another phase. That is a restart, not a clock step.
    let across_silence = |k: usize| ticks[k] - ticks[k - 1] > SILENCE_TICKS;
    let steps = edges[1..edges.len() - 1].iter().zip(phases.windows(2)).filter(|(k, _)| !across_silence(**k));
    let steps: Vec<(f64, f64)> = steps.map(|(&k, p)| (stamps_s[k], p[1] - p[0])).collect();
    // With a missing sample at a step, its number of periods is unknown.
    let usual_ticks = median(steps_of(ticks)).unwrap_or(1.0);
    let is_whole = edges.len() == 3 && ticks[edges[1]] - ticks[edges[1] - 1] < 1.5 * usual_ticks;
    let is_usual =
        |(_, height_s): &(f64, f64)| (LEAST_TAKEN_OUT_S..MOST_TAKEN_OUT_S).contains(&height_s.abs());
    let step_taken_out = is_whole && steps.iter().all(is_usual);
    // The phase of the last piece.
    let phase_of = |piece: usize| phases[if step_taken_out { phases.len() - 1 } else { piece }];
    let regular_of = |(k, piece): (usize, &&[usize])| {
        let phase = phase_of(k);
        ticks[piece[0]..piece[1]].iter().map(move |t| phase + t * period_s)
    };
    let regular_s: Vec<f64> = pieces.iter().enumerate().flat_map(regular_of).collect();
    // The stamps of each piece relative to its own phase.
    let about = |(k, piece): (usize, &&[usize])| {
        let phase = phases[k];
        residuals[piece[0]..piece[1]].iter().map(move |off| off - phase)
    };
    let about: Vec<f64> = pieces.iter().enumerate().flat_map(about).collect();
    StreamClock {
        phase_sigma_s: mad_sigma(&about) / (stamps_s.len() as f64).sqrt(),
        regular_s,
        period_s,
        jitter_s: 0.0,
        device_drift_ppm: None,
        fit_kind: FitKind::LeastSquares,
        pieces: edges.len() - 1,
        steps,
        step_taken_out,
        wander_s: 0.0,
        lateness: Lateness::default(),
    }
}

/// Huber's estimate of the middle.
pub(crate) fn middle(values: &[f64]) -> f64 {
    let mut middle = median(values.iter().copied()).unwrap_or(0.0);
    let limit = HUBER_SIGMAS * mad_sigma(values);
    for _ in 0..10 {
        let (mut sum, mut weights) = (0.0, 0.0);
        for value in values {
            let weight = if limit > 0.0 { (limit / (value - middle).abs()).min(1.0) } else { 1.0 };
            sum += weight * value;
            weights += weight;
        }
        middle = sum / weights;
    }
    middle
}

/// The highest line below all stamps: the edge of the lower convex hull above the middle tick. Stamps earlier than `earliest_s` relative to the line
/// of `period_s` belong to another tick and are skipped.
pub(crate) fn along_lower_hull(
    stamps_s: &[f64],
    ticks: &[f64],
    period_s: f64,
    earliest_s: f64,
) -> Option<StreamClock> {
    let is_late = |k: &usize| stamps_s[*k] - ticks[*k] * period_s >= earliest_s;
    let mut hull: Vec<usize> = Vec::new();
    for k in (0..stamps_s.len()).filter(is_late) {
        while let [.., a, b] = hull[..] {
            let turn = (ticks[b] - ticks[a]) * (stamps_s[k] - stamps_s[a])
                - (ticks[k] - ticks[a]) * (stamps_s[b] - stamps_s[a]);
            if turn > 0.0 {
                break;
            }
            hull.pop();
        }
        hull.push(k);
    }
    let mean_tick = ticks.iter().sum::<f64>() / ticks.len() as f64;
    let right = hull.iter().position(|&k| ticks[k] >= mean_tick).unwrap_or(1).max(1);
    let (a, b) = (*hull.get(right - 1)?, *hull.get(right)?);
    let period_s = (stamps_s[b] - stamps_s[a]) / (ticks[b] - ticks[a]);
    let regular_s: Vec<f64> = ticks.iter().map(|t| stamps_s[a] + (t - ticks[a]) * period_s).collect();
    // The least of n delays of mean τ is τ/n above zero, with the same standard deviation. The fifth least is five times as high. With a noisy floor
    // the fifth least is still above that noise.
    let about: Vec<f64> = stamps_s.iter().zip(&regular_s).map(|(s, r)| s - r).collect();
    let mut above = about.clone();
    let fifth = *above.select_nth_unstable_by(4, f64::total_cmp).1;
    Some(StreamClock {
        regular_s,
        period_s,
        jitter_s: 0.0,
        phase_sigma_s: fifth.max(0.0),
        device_drift_ppm: None,
        fit_kind: FitKind::LowerEnvelope,
        pieces: 1,
        steps: Vec::new(),
        step_taken_out: false,
        wander_s: 0.0,
        lateness: Lateness::default(),
    })
}
