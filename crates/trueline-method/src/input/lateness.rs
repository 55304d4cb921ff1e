//! How late stamps are against an even clock, and whether they are stamps of arrival.
//!
//! A queue, a stall of the receiver or a busy network delays packets and never makes them early. Nothing else is late to one side
//! only, so such stamps date the arrival and not the sample. Jitter to both sides may be the source's own.

use crate::order_statistics::{mad_sigma, median, quantile};

/// Lateness of a stream's stamps against its clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lateness {
    /// Of the middle stamp, s.
    pub median_s: f64,
    /// Of the latest stamp, s.
    pub most_s: f64,
    /// Mad sigma of the stamps about the clock, s.
    pub spread_s: f64,
    /// Whether the stamps have a sharp early edge and a tail on the late side.
    pub has_sharp_edge: bool,
    /// Stamps far later than the early side of the distribution explains, less three times those that are as early.
    pub late_packets: usize,
}

/// Fewer stamps than these have no shape: of this many, the quantiles of a Gaussian are asymmetric by 0.13.
const FEWEST: usize = 60;
/// Asymmetry of the quantiles 2, 50 and 98 %: 0.44 of half a normal distribution, 0.65 of an exponential one; 0 of symmetric ones.
const LEAST_ASYMMETRY: f64 = 0.25;
/// Distance of the quantiles 2 and 10 % over that of 10 and 50 %: 0.18 of half a normal distribution, 0.6 of a whole one.
const SHARP: f64 = 0.4;
/// A late packet is this many standard deviations late; of a million Gaussian stamps one is later than 4.9.
const LATE_SIGMAS: f64 = 6.0;
/// This number of late packets is not chance …
const FEWEST_LATE: usize = 4;
/// … if those that are as early are a third at most: outliers to both sides are another matter.
const EARLY_COUNTS: usize = 3;

impl Lateness {
    /// Of the deviations of stamps from their clock, s.
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
        // The early side alone gives the spread: late packets are none of it.
        let early = median(about_s.iter().filter(|off| **off < middle).map(|off| middle - off));
        let far = LATE_SIGMAS * (1.4826 * early.unwrap_or(0.0)).max(1e-6);
        let late = about_s.iter().filter(|off| **off - middle > far).count();
        let as_early = about_s.iter().filter(|off| middle - **off > far).count();
        let late_packets = late.saturating_sub(EARLY_COUNTS * as_early);
        Self { median_s: middle, most_s, spread_s, has_sharp_edge, late_packets }
    }

    /// Whether the stamps date the arrival of samples that were taken earlier.
    #[must_use]
    pub fn is_of_arrival(&self) -> bool {
        self.has_sharp_edge || self.late_packets >= FEWEST_LATE
    }
}

/// The earliest stamps about a line, where they are sharply bounded, s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EarlyEdge {
    /// The earliest fiftieth is earlier than this.
    pub(crate) least_s: f64,
    /// From there to the middle.
    pub(crate) width_s: f64,
}

impl EarlyEdge {
    /// `None` where the early side is not sharp.
    pub(crate) fn of(about_s: &[f64]) -> Option<Self> {
        let edge = quantile(about_s.iter().copied(), 0.02)?;
        let middle = median(about_s.iter().copied())?;
        Lateness::of(about_s).has_sharp_edge.then_some(Self { least_s: edge, width_s: middle - edge })
    }
}
