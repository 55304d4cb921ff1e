//! Lateness of stamps relative to a regular clock, and whether they date the arrival.
//!
//! A queue, a stall of the receiver or a busy network delays packets and never makes them early. Nothing else is late on one side only, so such
//! stamps date the arrival and not the sample. Jitter on both sides may come from the source.

use crate::order_statistics::{mad_sigma, median, quantile};

/// Lateness of a stream's stamps against its clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lateness {
    /// Lateness of the median stamp, s.
    pub median_s: f64,
    /// Lateness of the latest stamp, s.
    pub most_s: f64,
    /// Standard deviation of the stamps about the clock, from the median absolute deviation, s.
    pub spread_s: f64,
    /// Whether the stamps have a sharp early edge and a tail on the late side.
    pub has_sharp_edge: bool,
    /// Number of stamps far later than the early side of the distribution explains, minus three times the number that are as early.
    pub late_packets: usize,
}

/// Minimum stamps to assess their distribution. With this number, the quantiles of a Gaussian are asymmetric by 0.13.
const FEWEST: usize = 60;
/// Least asymmetry of the quantiles 2, 50 and 98 %: 0.44 for half a normal distribution, 0.65 for an exponential one, 0 for symmetric ones.
const LEAST_ASYMMETRY: f64 = 0.25;
/// Largest distance of the quantiles 2 and 10 % relative to that of 10 and 50 %: 0.18 for half a normal distribution, 0.6 for a whole one.
const SHARP: f64 = 0.4;
/// Standard deviations beyond which a packet is late. Among a million Gaussian stamps one is later than 4.9.
const LATE_SIGMAS: f64 = 6.0;
/// This number of late packets is significant …
const FEWEST_LATE: usize = 4;
/// … if at most a third of that number are as early. Otherwise there are outliers on both sides.
const EARLY_COUNTS: usize = 3;

impl Lateness {
    /// From the deviations of stamps from their clock, s.
    #[must_use]
    pub(crate) fn of(about_s: &[f64]) -> Self {
        let at = |part| quantile(about_s.iter().copied(), part).unwrap_or(0.0);
        let middle = at(0.5);
        let most_s = about_s.iter().copied().fold(0.0, f64::max);
        let spread_s = mad_sigma(about_s);
        if about_s.len() < FEWEST {
            return Self { median_s: middle, most_s, spread_s, ..Self::default() };
        }
        let [least, low, high] = [0.02, 0.1, 0.98].map(at);
        let asymmetry = (high + least - 2.0 * middle) / (high - least).max(f64::MIN_POSITIVE);
        let has_sharp_edge = asymmetry > LEAST_ASYMMETRY && low - least < SHARP * (middle - low);
        // Only the early side gives the spread, because it contains no late packets.
        let early = median(about_s.iter().filter(|off| **off < middle).map(|off| middle - off));
        let far = LATE_SIGMAS * (1.4826 * early.unwrap_or(0.0)).max(1e-6);
        let late = about_s.iter().filter(|off| **off - middle > far).count();
        let as_early = about_s.iter().filter(|off| middle - **off > far).count();
        let late_packets = late.saturating_sub(EARLY_COUNTS * as_early);
        Self { median_s: middle, most_s, spread_s, has_sharp_edge, late_packets }
    }

    /// Whether the stamps date the arrival of earlier samples.
    #[must_use]
    pub fn is_of_arrival(&self) -> bool {
        self.has_sharp_edge || self.late_packets >= FEWEST_LATE
    }
}

/// The earliest stamps about a line, if they have a sharp edge, s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EarlyEdge {
    /// Upper bound of the earliest fiftieth.
    pub(crate) least_s: f64,
    /// Distance from there to the middle.
    pub(crate) width_s: f64,
}

impl EarlyEdge {
    /// `None` if the early side is not sharp.
    pub(crate) fn of(about_s: &[f64]) -> Option<Self> {
        let edge = quantile(about_s.iter().copied(), 0.02)?;
        let middle = median(about_s.iter().copied())?;
        Lateness::of(about_s).has_sharp_edge.then_some(Self { least_s: edge, width_s: middle - edge })
    }
}
