//! Estimates the sampling clock from a stream's receive stamps.
//!
//! A camera or a controller samples periodically, but its samples are stamped on arrival. The receiving clock is correct on average, and the
//! transport has a variable delay. The sampling times are recovered by fitting receive stamps to the source's regular tick: its own device stamps or
//! a counter if recorded, else the number of periods since the start. Recorded stamps are kept. Fitted ones are used if the stamps are late on one
//! side or rounded, or else if the data confirm them.

use crate::input::clock_count::{self, PeriodIs, steps_of, unwrapped};
use crate::input::clock_line::{self, along_lower_hull, through_middle};
use crate::input::clock_wander;
use crate::input::lateness::{EarlyEdge, Lateness};
use crate::order_statistics::{mad_sigma, median};

pub use crate::input::clock_count::missing;
pub use crate::input::clock_line::{FitKind, StreamClock};

/// The regular clock of the source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ticks<'a> {
    /// Stamps of the device's own clock, s.
    Device(&'a [f64]),
    /// A counter of samples.
    Counter(&'a [u64]),
    /// Nothing else was recorded. Periods are counted between the stamps.
    Counted,
}

/// Minimum stamps to find a period.
const MIN_STAMPS: usize = 20;
/// Jitter above this fraction of the period makes counting impossible.
const JITTER_LIMIT: f64 = 0.3;
/// The same for a wandering clock. Samples triggered at random scatter by 0.26 of their mean period about the best such clock.
const WANDERING_JITTER_LIMIT: f64 = 0.1;
/// White jitter scatters about the grid as predicted from the steps between stamps. An irregular source scatters more.
const WANDER_LIMIT: f64 = 1.5;
/// If fewer than one tick in this many left a stamp, the ticks are only the rounding of the stamps.
const MOST_TICKS: f64 = 4.0;

/// Fits the clock to `stamps_s` (rising, one for each sample). `None` if they do not come from a regular tick: too few stamps, jitter too large to
/// count periods, or steps that add up to a random walk.
#[must_use]
pub fn fit(stamps_s: &[f64], ticks: Ticks<'_>) -> Option<StreamClock> {
    if stamps_s.len() < MIN_STAMPS {
        return None;
    }
    let counted = || by_counting(stamps_s);
    match ticks {
        Ticks::Counted => counted(),
        Ticks::Device(device) => {
            let mut clock = fit_ticks(stamps_s, device, Index::Known)?;
            clock.device_drift_ppm = Some((1.0 / clock.period_s - 1.0) * 1e6);
            clock.period_s *= median(steps_of(device))?;
            Some(clock)
        }
        // A counter may be a mere row number that ignores lost samples.
        Ticks::Counter(counter) => {
            let unwrapped: Vec<f64> = unwrapped(counter).iter().map(|n| *n as f64).collect();
            let by_counter = fit_ticks(stamps_s, &unwrapped, Index::Known);
            match (by_counter, counted()) {
                (Some(a), Some(b)) if b.jitter_s < 0.5 * a.jitter_s || b.pieces < a.pieces => Some(b),
                (a, b) => a.or(b),
            }
        }
    }
}

/// The clock with ticks counted in the usual step between stamps, or in a short one.
fn by_counting(stamps_s: &[f64]) -> Option<StreamClock> {
    let by = |period_is| fit_ticks(stamps_s, &clock_count::counted(stamps_s, period_is)?, Index::Counted);
    by(PeriodIs::UsualStep).or_else(|| {
        by(PeriodIs::ShortStep).filter(|clock| {
            let lost = missing(stamps_s, clock.period_s) as f64;
            lost < (MOST_TICKS - 1.0) * stamps_s.len() as f64
                && clock.jitter_s < JITTER_LIMIT * clock.period_s
        })
    })
}

/// Origin of the ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Index {
    /// From the source.
    Known,
    /// Counted between the stamps.
    Counted,
}

/// The affine fit. The period is that of one tick.
fn fit_ticks(stamps_s: &[f64], ticks: &[f64], index: Index) -> Option<StreamClock> {
    if ticks.windows(2).any(|w| w[1] <= w[0]) {
        return None;
    }
    let rough_period = clock_count::slope(stamps_s, ticks)?;
    let usual_ticks = median(steps_of(ticks))?;
    let detrended: Vec<f64> = stamps_s.iter().zip(ticks).map(|(s, t)| s - t * rough_period).collect();
    // If a period is a multiple of the rounding, rounding shifts neighbouring stamps equally and is not visible in their steps.
    let rounding = rounding_sigma_s(stamps_s);
    let white = clock_line::white_jitter(stamps_s, ticks, rough_period).max(rounding);
    let is_even = |clock: &StreamClock| {
        let scatter = mad_sigma(&clock.deviations_s(stamps_s));
        let tick_s = clock.period_s * usual_ticks;
        let limit = if clock.wander_s > 0.0 { WANDERING_JITTER_LIMIT } else { JITTER_LIMIT };
        scatter <= WANDER_LIMIT * white + 2e-9 && scatter < limit * tick_s
    };
    let in_pieces = |edges: &[usize]| {
        let period_s = clock_line::pooled_period(stamps_s, ticks, edges, white, rough_period)?;
        let residuals: Vec<f64> = stamps_s.iter().zip(ticks).map(|(s, t)| s - t * period_s).collect();
        let floor = EarlyEdge::of(&residuals).filter(|_| edges.len() == 2 && rounding == 0.0);
        let on_floor = floor.and_then(|edge| on_floor(stamps_s, ticks, edge, period_s, index));
        // A sharp early edge belongs to a regular clock, however much its packets are delayed.
        on_floor.filter(is_even).or_else(|| {
            let clock = through_middle(stamps_s, ticks, &residuals, edges, period_s);
            let clock = clock_wander::followed(&clock, stamps_s, white, rounding).unwrap_or(clock);
            is_even(&clock).then_some(clock)
        })
    };
    let edges = clock_line::piece_edges(&detrended, white);
    // A fast-wandering clock looks like many steps, and these do not make it regular.
    let clock = in_pieces(&edges).or_else(|| in_pieces(&[0, stamps_s.len()]).filter(|_| edges.len() > 2))?;
    Some(with_lateness(clock, stamps_s))
}

/// The clock along the earliest stamps, if these have a sharp edge.
fn on_floor(
    stamps_s: &[f64],
    ticks: &[f64],
    edge: EarlyEdge,
    period_s: f64,
    index: Index,
) -> Option<StreamClock> {
    let earliest_s = edge.least_s - edge.width_s;
    match index {
        Index::Known => along_lower_hull(stamps_s, ticks, period_s, earliest_s),
        Index::Counted => {
            let ticks = clock_count::counted_back(stamps_s, earliest_s, period_s);
            // The ticks are counted again from the earliest stamp.
            along_lower_hull(stamps_s, &ticks, period_s, earliest_s)
        }
    }
}

fn with_lateness(clock: StreamClock, stamps_s: &[f64]) -> StreamClock {
    let about = clock.deviations_s(stamps_s);
    StreamClock { jitter_s: root_mean_square(&about), lateness: Lateness::of(&about), ..clock }
}

/// Rounding below this is negligible, µs.
const COARSE_US: i64 = 500;

/// Standard deviation of rounding, s, if all stamps are multiples of a coarse grain shorter than half a step.
fn rounding_sigma_s(stamps_s: &[f64]) -> f64 {
    let mut grain_us = 0;
    for step_s in steps_of(stamps_s) {
        let (mut a, mut b) = (grain_us, (step_s * 1e6).round() as i64);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        grain_us = a;
        if grain_us < COARSE_US && grain_us != 0 {
            return 0.0;
        }
    }
    let grain_s = grain_us as f64 * 1e-6;
    let usual_s = median(steps_of(stamps_s)).unwrap_or(0.0);
    if grain_s < 0.5 * usual_s { grain_s / 12.0_f64.sqrt() } else { 0.0 }
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}
