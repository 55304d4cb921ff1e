//! Follows a receive clock that wanders about a regular tick, if the wander exceeds its jitter.

use crate::input::clock_count::steps_of;
use crate::input::clock_line::{StreamClock, middle};
use crate::order_statistics::{mad_sigma, median};

/// The wander is a running Huber estimate over this time, s. Medians of stamps in whole milliseconds would jump …
const WINDOW_S: f64 = 2.0;
/// … and over at least this many stamps. A source that takes each step from its last sample is a random walk. About the middle of 30 stamps it
/// scatters by 2.2 times the prediction from its steps.
const FEWEST: usize = 30;
/// A smaller wander is ignored, s: 50 mm/s × 0.3 ms = 15 µm.
const LEAST_WANDER_S: f64 = 0.3e-3;
/// The largest of a hundred middles is off by 3 of their standard deviations by chance.
const SIGMAS: f64 = 6.0;

/// The same clock along the running middle of the stamps, if its deviation from the line is significant. `white_s` is the jitter of a stamp, and
/// `rounding_s` its part from rounding.
#[must_use]
pub(crate) fn followed(
    clock: &StreamClock,
    stamps_s: &[f64],
    white_s: f64,
    rounding_s: f64,
) -> Option<StreamClock> {
    let n = stamps_s.len();
    // Device stamps count ticks of a second, so the clock's period differs from that of the samples.
    let half = ((0.5 * WINDOW_S / median(steps_of(stamps_s))?) as usize).max(FEWEST / 2);
    if n < 4 * half {
        return None;
    }
    let about = clock.deviations_s(stamps_s);
    let knots = knots(&about, half);
    let all = middle(&about);
    let wander_s = knots.iter().map(|(_, off)| (off - all).abs()).fold(0.0, f64::max);
    // The median of w stamps has the standard deviation 1.2533 σ/√w. That of the Huber estimate is smaller.
    let by_chance = SIGMAS * 1.2533 * white_s / (2.0 * half as f64).sqrt();
    // Rounding to one side for a while moves the middle by half a grain, √3 of its standard deviations.
    if wander_s <= LEAST_WANDER_S.max(by_chance) + 3.0_f64.sqrt() * rounding_s {
        return None;
    }
    let off = interpolated(&knots, n);
    let regular_s = clock.regular_s.iter().zip(&off).map(|(r, off)| r + off).collect();
    let left: Vec<f64> = about.iter().zip(&off).map(|(about, off)| about - off).collect();
    let phase_sigma_s = mad_sigma(&left) / (n as f64).sqrt();
    Some(StreamClock { regular_s, wander_s, phase_sigma_s, ..clock.clone() })
}

/// Middles of windows of twice `half`, every half window, with their places.
fn knots(about_s: &[f64], half: usize) -> Vec<(f64, f64)> {
    let last = about_s.len() - 1;
    let centres = (0..=last / half).map(|k| k * half).chain([last]);
    let knot = |centre: usize| {
        // Symmetric windows. They are shorter at the ends, and a slope does not bias them.
        let reach = half.min(centre.max(half / 4)).min((last - centre).max(half / 4));
        let window = centre.saturating_sub(reach)..=(centre + reach).min(last);
        let place = 0.5 * (window.start() + window.end()) as f64;
        (place, middle(&about_s[window]))
    };
    let mut knots: Vec<(f64, f64)> = centres.map(knot).collect();
    knots.dedup_by(|later, earlier| later.0 <= earlier.0);
    knots
}

/// Linear between the knots and beyond the first and last.
fn interpolated(knots: &[(f64, f64)], count: usize) -> Vec<f64> {
    let at = |k: usize| {
        let place = k as f64;
        let right = knots.partition_point(|(knot, _)| *knot <= place).clamp(1, knots.len() - 1);
        let ((a, from), (b, to)) = (knots[right - 1], knots[right]);
        from + (to - from) * (place - a) / (b - a)
    };
    (0..count).map(at).collect()
}
