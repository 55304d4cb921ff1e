//! Ticks of a source between its stamps: the number of periods between samples.

use crate::order_statistics::{median, quantile};

/// Steps that differ by less than this fraction have the same number of periods.
const ALIKE: f64 = 1.0 / 3.0;
/// If more than half of the samples are lost, most steps are several periods. At least this fraction is assumed to be one period.
const SHORT_STEPS: f64 = 0.1;

/// Number of samples missing between the first and the last: periods without a stamp.
#[must_use]
pub fn missing(stamps_s: &[f64], period_s: f64) -> usize {
    let [first, .., last] = stamps_s else { return 0 };
    (((last - first) / period_s).round() as usize + 1).saturating_sub(stamps_s.len())
}

/// Steps between neighbours.
pub(crate) fn steps_of(values: &[f64]) -> impl Iterator<Item = f64> + '_ {
    values.windows(2).map(|w| w[1] - w[0])
}

/// The step between stamps that is one period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PeriodIs {
    /// The usual step.
    UsualStep,
    /// A short step, if most samples are lost.
    ShortStep,
}

/// Ticks since the first stamp, by counting the periods between stamps.
pub(crate) fn counted(stamps_s: &[f64], period_is: PeriodIs) -> Option<Vec<f64>> {
    let steps = || steps_of(stamps_s).filter(|d| *d > 0.0);
    let about_s = match period_is {
        PeriodIs::UsualStep => median(steps())?,
        PeriodIs::ShortStep => quantile(steps(), SHORT_STEPS)?,
    };
    // If many steps are twice as long, the median of all is at the upper end of the single ones.
    let alike = median(steps().filter(|d| (d / about_s - 1.0).abs() < ALIKE))?;
    counted_periods(stamps_s, alike)
}

/// Unwraps a counter that restarts at a power of two.
pub(crate) fn unwrapped(counter: &[u64]) -> Vec<u64> {
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

/// Number of periods since the first stamp. One period is about `step_s`.
fn counted_periods(stamps_s: &[f64], step_s: f64) -> Option<Vec<f64>> {
    let mut period = step_s;
    let mut ticks = tracked(stamps_s, period);
    // A median of steps is off by some percent at worst. Slopes over many periods are accurate.
    for _ in 0..2 {
        period = slope(stamps_s, &ticks)?;
        ticks = tracked(stamps_s, period);
    }
    set_apart(&mut ticks);
    Some(ticks)
}

/// A sample delayed beyond the next one's tick shares that tick. It is moved to the previous one.
fn set_apart(ticks: &mut [f64]) {
    for k in (1..ticks.len()).rev() {
        ticks[k - 1] = ticks[k - 1].min(ticks[k] - 1.0);
    }
}

/// Ticks of stamps that are late and never early. Each stamp gets the last tick before it that no later stamp needs. Rounding would fail for a
/// sample that is late by more than half a period before a lost one: it would get the lost tick, half a period early.
pub(crate) fn counted_back(stamps_s: &[f64], earliest_s: f64, period_s: f64) -> Vec<f64> {
    let mut ticks: Vec<f64> = stamps_s.iter().map(|s| ((s - earliest_s) / period_s).floor()).collect();
    set_apart(&mut ticks);
    ticks
}

/// Fraction of a stamp's deviation that the tracked phase follows.
const TRACKING: f64 = 0.1;
/// A deviation beyond this fraction of a period is a delay, not a phase change.
const TRACKED_PART: f64 = 0.2;

/// Counts periods against a phase that follows the stamps slowly, so that one delay causes no miscount.
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

/// Median slope over an eighth of the samples. It is robust against delays and a few clock steps.
pub(crate) fn slope(stamps_s: &[f64], ticks: &[f64]) -> Option<f64> {
    let reach = (stamps_s.len() / 8).clamp(1, 500);
    let slopes = stamps_s.windows(reach + 1).zip(ticks.windows(reach + 1)).filter_map(|(s, t)| {
        let run = t[reach] - t[0];
        (run > 0.0).then(|| (s[reach] - s[0]) / run)
    });
    median(slopes)
}
