//! The clock behind a stream's receive stamps.
//!
//! A camera or a controller samples periodically, but its samples are stamped on arrival: by a clock that
//! is right on average and by a transport that is not always equally quick. The times of sampling are found
//! again by fitting receive stamps against what ticked evenly at the source: its own device stamps or a
//! counter where they are recorded, else the number of periods since the start. Recorded stamps are kept;
//! this is a second opinion that is used only where the data bear it out.

use crate::order_statistics::{mad_sigma, median, quantile};

/// What ticked evenly at the source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ticks<'a> {
    /// Stamps of the device's own clock, s.
    Device(&'a [f64]),
    /// A counter of samples.
    Counter(&'a [u64]),
    /// Nothing was recorded: periods are counted between the stamps.
    Counted,
}

/// How the fit ran through the stamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitKind {
    /// Through their middle: jitter to both sides.
    LeastSquares,
    /// Along their lower hull: delays to one side only \[Zhang2002\].
    LowerEnvelope,
}

/// A stream whose samples were taken evenly.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamClock {
    /// When each sample was taken, by the receiver's clock, s.
    pub regular_s: Vec<f64>,
    /// Time between samples, s.
    pub period_s: f64,
    /// Standard deviation of a receive stamp about the regular one, s.
    pub jitter_s: f64,
    /// Standard deviation of what the fit leaves unknown of all stamps together, s.
    pub phase_sigma_s: f64,
    /// Rate of the device's clock against the receiver's, parts per million; `None` without device stamps.
    pub device_drift_ppm: Option<f64>,
    /// How the fit ran.
    pub fit_kind: FitKind,
    /// Pieces with a phase of their own: after a step of the clock, or after a silence.
    pub pieces: usize,
    /// Time of each step of the receive clock, s, and its height, s.
    pub steps: Vec<(f64, f64)>,
}

impl StreamClock {
    /// Whether it follows the earliest stamps: jitter to one side.
    #[must_use]
    pub(crate) fn is_one_sided(&self) -> bool {
        self.fit_kind == FitKind::LowerEnvelope
    }
}

/// Fewest stamps that show a period.
const MIN_STAMPS: usize = 20;
/// More jitter than this part of the period, and periods cannot be counted.
const JITTER_LIMIT: f64 = 0.3;
/// Stamps to either side of a suspected step of the clock.
const STEP_WINDOW: usize = 20;
/// No standard deviation is taken to be smaller than this, s: steps of a few microseconds are negligible.
pub(crate) const LEAST_STEP_S: f64 = 1e-5;
/// Stamps to either side over which a step must last.
const STAY_WINDOW: usize = 200;
/// The share of stamps that are quicker than what is taken for their floor.
pub(crate) const FLOOR: f64 = 0.1;
/// A step is this many standard deviations of the difference of two medians high.
pub(crate) const STEP_SIGMAS: f64 = 8.0;
/// A stamp further off than this says little about the period.
pub(crate) const HUBER_SIGMAS: f64 = 2.0;
/// Skewness above which delays are one-sided: an exponential tail has 2, noise of 100 stamps 0.25.
const ONE_SIDED_SKEWNESS: f64 = 1.0;
/// White jitter scatters as much about the grid as steps between stamps say; a clock that wanders, or a
/// source that does not tick evenly, scatters more.
const WANDER_LIMIT: f64 = 1.5;

/// A silence is longer than this many ticks.
pub(crate) const SILENCE_TICKS: f64 = 4.0;

/// Number of samples missing between the first and the last: periods without a stamp.
#[must_use]
pub fn missing(stamps_s: &[f64], period_s: f64) -> usize {
    let [first, .., last] = stamps_s else { return 0 };
    (((last - first) / period_s).round() as usize + 1).saturating_sub(stamps_s.len())
}

/// Fits the clock behind `stamps_s` (rising, one for each sample); `None` if they do not come from an even
/// tick: too few, jitter too large to count periods, or a clock that wanders.
#[must_use]
pub fn fit(stamps_s: &[f64], ticks: Ticks<'_>) -> Option<StreamClock> {
    if stamps_s.len() < MIN_STAMPS {
        return None;
    }
    let counted = || by_counting(stamps_s);
    match ticks {
        Ticks::Counted => counted(),
        Ticks::Device(device) => {
            let mut clock = fit_ticks(stamps_s, device)?;
            clock.device_drift_ppm = Some((1.0 / clock.period_s - 1.0) * 1e6);
            clock.period_s *= median(steps_of(device))?;
            Some(clock)
        }
        // What is called a counter may be a mere row number that knows nothing of lost samples.
        Ticks::Counter(counter) => {
            let unwrapped: Vec<f64> = unwrapped(counter).iter().map(|n| *n as f64).collect();
            let by_counter = fit_ticks(stamps_s, &unwrapped);
            match (by_counter, counted()) {
                (Some(a), Some(b)) if b.jitter_s < 0.5 * a.jitter_s || b.pieces < a.pieces => Some(b),
                (a, b) => a.or(b),
            }
        }
    }
}

/// A counter that starts again at a power of two goes on.
fn unwrapped(counter: &[u64]) -> Vec<u64> {
    let mut carry = 0;
    let mut last = 0;
    let next = |&value: &u64| {
        if value + carry < last {
            carry += (last - carry + 1).next_power_of_two();
        }
        last = value + carry;
        last
    };
    counter.iter().map(next).collect()
}

/// Steps that differ by less than this part are of as many periods.
const ALIKE: f64 = 1.0 / 3.0;
/// Of a stream that lost more than half of its samples most steps are several periods; this part of them is one at most …
const SHORT_STEPS: f64 = 0.1;
/// … and ticks of which fewer than one in this many left a stamp are only what stamps are rounded to.
const MOST_TICKS: f64 = 4.0;

/// The clock whose ticks are counted in the usual step between stamps, or in a short one.
fn by_counting(stamps_s: &[f64]) -> Option<StreamClock> {
    let steps = || steps_of(stamps_s).filter(|d| *d > 0.0);
    // Of the steps about one: where many are twice as long, the median of all lies at the upper end of the single ones.
    let alike = |about_s: f64| median(steps().filter(|d| (d / about_s - 1.0).abs() < ALIKE));
    let by = |about_s: f64| fit_ticks(stamps_s, &counted_periods(stamps_s, alike(about_s)?)?);
    by(median(steps())?).or_else(|| {
        by(quantile(steps(), SHORT_STEPS)?).filter(|clock| {
            let lost = missing(stamps_s, clock.period_s) as f64;
            lost < (MOST_TICKS - 1.0) * stamps_s.len() as f64
                && clock.jitter_s < JITTER_LIMIT * clock.period_s
        })
    })
}

/// Number of periods since the first stamp, of which one is about as long as `step_s`.
fn counted_periods(stamps_s: &[f64], step_s: f64) -> Option<Vec<f64>> {
    let mut period = step_s;
    let mut ticks = tracked(stamps_s, period);
    // A median of steps is some percent off at worst; slopes over many periods are not.
    for _ in 0..2 {
        period = slope(stamps_s, &ticks)?;
        ticks = tracked(stamps_s, period);
    }
    // A sample that was delayed beyond the next one's tick has that tick: it belongs to the one before.
    for k in (1..ticks.len()).rev() {
        ticks[k - 1] = ticks[k - 1].min(ticks[k] - 1.0);
    }
    Some(ticks)
}

/// Part of a stamp's deviation that the tracked phase follows.
const TRACKING: f64 = 0.1;
/// A deviation beyond this part of a period is a delay, not a change of phase.
const TRACKED_PART: f64 = 0.2;

/// Periods counted against a phase that follows the stamps slowly, so that one delay miscounts nothing.
fn tracked(stamps_s: &[f64], period: f64) -> Vec<f64> {
    let mut tick = 0.0;
    let mut expected = stamps_s.first().copied().unwrap_or(0.0);
    let count = |stamp: &f64| {
        let periods = ((stamp - expected) / period).round();
        tick += periods;
        expected += periods * period;
        expected += TRACKING * (stamp - expected).clamp(-TRACKED_PART * period, TRACKED_PART * period);
        tick
    };
    stamps_s.iter().map(count).collect()
}

fn steps_of(values: &[f64]) -> impl Iterator<Item = f64> + '_ {
    values.windows(2).map(|w| w[1] - w[0])
}

/// Median slope over an eighth of the samples: neither delays nor a few steps of the clock matter.
fn slope(stamps_s: &[f64], ticks: &[f64]) -> Option<f64> {
    let reach = (stamps_s.len() / 8).clamp(1, 500);
    let slopes = stamps_s.windows(reach + 1).zip(ticks.windows(reach + 1)).filter_map(|(s, t)| {
        let run = t[reach] - t[0];
        (run > 0.0).then(|| (s[reach] - s[0]) / run)
    });
    median(slopes)
}

/// The affine fit; the period is that of one tick.
fn fit_ticks(stamps_s: &[f64], ticks: &[f64]) -> Option<StreamClock> {
    if ticks.windows(2).any(|w| w[1] <= w[0]) {
        return None;
    }
    let rough_period = slope(stamps_s, ticks)?;
    let detrended: Vec<f64> = stamps_s.iter().zip(ticks).map(|(s, t)| s - t * rough_period).collect();
    let white = white_jitter(stamps_s, ticks, rough_period);
    let edges = piece_edges(&detrended, white);
    let period_s = pooled_period(stamps_s, ticks, &edges, white, rough_period)?;
    let residuals: Vec<f64> = stamps_s.iter().zip(ticks).map(|(s, t)| s - t * period_s).collect();
    let one_sided = edges.len() == 2 && skewness(&residuals) > ONE_SIDED_SKEWNESS;
    let mut clock = if one_sided {
        along_lower_hull(stamps_s, ticks)
    } else {
        through_middle(stamps_s, ticks, &residuals, &edges, period_s)
    };
    let tick_s = median(steps_of(ticks))? * clock.period_s;
    let about: Vec<f64> = stamps_s.iter().zip(&clock.regular_s).map(|(s, r)| s - r).collect();
    clock.jitter_s = root_mean_square(&about);
    let scatter = mad_sigma(&about);
    let even = scatter <= WANDER_LIMIT * white + 2e-9 && scatter < JITTER_LIMIT * tick_s;
    even.then_some(clock)
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Jitter as the steps between neighbours tell it: their difference has √2 times that of a stamp.
fn white_jitter(stamps_s: &[f64], ticks: &[f64], period: f64) -> f64 {
    let off: Vec<f64> = steps_of(stamps_s).zip(steps_of(ticks)).map(|(s, t)| s - t * period).collect();
    mad_sigma(&off) / std::f64::consts::SQRT_2
}

/// Where a piece with a phase of its own begins, and the end.
fn piece_edges(detrended: &[f64], white: f64) -> Vec<usize> {
    let n = detrended.len();
    // Of two medians of w samples the difference has 1.2533 √(2/w) times the standard deviation of one.
    let limit = STEP_SIGMAS * (1.2533 * (2.0 / STEP_WINDOW as f64).sqrt() * white).max(LEAST_STEP_S);
    let level = |from: usize, to: usize| median(detrended[from..to].iter().copied()).unwrap_or(0.0);
    let mut edges = vec![0];
    // The edge and the height between its two neighbours.
    let mut best: Option<(usize, f64)> = None;
    for k in STEP_WINDOW..=n.saturating_sub(STEP_WINDOW) {
        // Only a step that shows between two neighbours can be a step of the clock; that is cheap to ask.
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
    // A step stays, and moves the quickest stamps as it moves the middle ones; delays in a row do not.
    let floor = |from: usize, to: usize| quantile(detrended[from..to].iter().copied(), FLOOR).unwrap_or(0.0);
    let stays = |&edge: &usize| {
        let (before, after) = (edge.saturating_sub(STAY_WINDOW), (edge + STAY_WINDOW).min(n));
        let steps =
            |of: &dyn Fn(usize, usize) -> f64| (of(edge, after) - of(before, edge)).abs() > 0.5 * limit;
        edge == 0 || edge == n || (steps(&level) && steps(&floor))
    };
    edges.into_iter().filter(stays).collect()
}

/// One period for all pieces, by least squares that large delays hardly bend.
fn pooled_period(
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

fn skewness(residuals: &[f64]) -> f64 {
    let n = residuals.len() as f64;
    let mean = residuals.iter().sum::<f64>() / n;
    let moment = |power: i32| residuals.iter().map(|r| (r - mean).powi(power)).sum::<f64>() / n;
    let deviation = moment(2).sqrt();
    if deviation > 0.0 { moment(3) / deviation.powi(3) } else { 0.0 }
}

fn through_middle(
    stamps_s: &[f64],
    ticks: &[f64],
    residuals: &[f64],
    edges: &[usize],
    period_s: f64,
) -> StreamClock {
    let mut regular_s = Vec::with_capacity(stamps_s.len());
    let mut phases = Vec::new();
    for piece in edges.windows(2) {
        let phase = middle(&residuals[piece[0]..piece[1]]);
        regular_s.extend(ticks[piece[0]..piece[1]].iter().map(|t| phase + t * period_s));
        phases.push(phase);
    }
    // After a silence a stream may go on with another phase: that is a new start, not a step of the clock.
    let across_silence = |k: usize| ticks[k] - ticks[k - 1] > SILENCE_TICKS;
    let steps = edges[1..edges.len() - 1].iter().zip(phases.windows(2)).filter(|(k, _)| !across_silence(**k));
    let about: Vec<f64> = stamps_s.iter().zip(&regular_s).map(|(s, r)| s - r).collect();
    StreamClock {
        phase_sigma_s: mad_sigma(&about) / (stamps_s.len() as f64).sqrt(),
        regular_s,
        period_s,
        jitter_s: 0.0,
        device_drift_ppm: None,
        fit_kind: FitKind::LeastSquares,
        pieces: edges.len() - 1,
        steps: steps.map(|(&k, p)| (stamps_s[k], p[1] - p[0])).collect(),
    }
}

/// Huber's estimate of the middle.
fn middle(values: &[f64]) -> f64 {
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

/// The line below all stamps that is nearest to them: the edge of the lower convex hull above the middle tick.
fn along_lower_hull(stamps_s: &[f64], ticks: &[f64]) -> StreamClock {
    let mut hull: Vec<usize> = Vec::new();
    for k in 0..stamps_s.len() {
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
    let (a, b) = (hull[right - 1], hull[right]);
    let period_s = (stamps_s[b] - stamps_s[a]) / (ticks[b] - ticks[a]);
    let regular_s: Vec<f64> = ticks.iter().map(|t| stamps_s[a] + (t - ticks[a]) * period_s).collect();
    // The least of n delays of mean τ lies τ/n above none, with that deviation; the fifth least five times
    // as high. Where the floor itself is noisy the fifth least is still above what that noise does.
    let mut above: Vec<f64> = stamps_s.iter().zip(&regular_s).map(|(s, r)| s - r).collect();
    let fifth = *above.select_nth_unstable_by(4, f64::total_cmp).1;
    StreamClock {
        regular_s,
        period_s,
        jitter_s: 0.0,
        phase_sigma_s: fifth.max(0.0),
        device_drift_ppm: None,
        fit_kind: FitKind::LowerEnvelope,
        pieces: 1,
        steps: Vec::new(),
    }
}
