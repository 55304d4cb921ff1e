//! When images are exposed and how they are stamped.

use crate::noise::Noise;
use crate::scenario::{Disturbance, Scenario, Timing};

/// One exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposed {
    /// Frame counter.
    pub frame: u64,
    /// Middle of the exposure since the start, s.
    pub exposed_s: f64,
    /// The stamp that it gets, ns.
    pub stamp_ns: i64,
}

/// Exposes image after image.
pub struct Shutter<'a> {
    timing: &'a Timing,
    disturbance: &'a Disturbance,
    receiver: Receiver,
    frame: u64,
}

impl<'a> Shutter<'a> {
    /// The shutter of a scenario, before the first image.
    #[must_use]
    pub fn new(scenario: &'a Scenario) -> Self {
        let timing = &scenario.timing;
        let receiver = Receiver::new(timing.start_ns);
        Self { timing, disturbance: &scenario.disturbance, receiver, frame: 0 }
    }

    /// How many images the scan has; the first is exposed half a period into the recording.
    #[must_use]
    pub fn count(&self) -> u64 {
        (self.timing.duration_s / self.timing.frame_period_s - 0.5).floor() as u64
    }

    /// The next exposure.
    pub fn expose(&mut self, noise: &mut Noise) -> Exposed {
        let (timing, frame) = (self.timing, self.frame);
        self.frame += 1;
        // Exposures fall on whole nanoseconds of the stamp, so that writing them loses nothing.
        let exposed_s = (frame as f64 + 0.5) * timing.frame_period_s;
        let stamp_s = exposed_s * (1.0 + self.disturbance.clock_drift_ppm * 1e-6) + timing.time_offset_s;
        let rounding_s = (stamp_s * 1e9).round() * 1e-9 - stamp_s;
        let stamp_ns = self.receiver.stamp(stamp_s + noise.normal(self.disturbance.frame_jitter_s));
        Exposed { frame, exposed_s: exposed_s + rounding_s, stamp_ns }
    }
}

/// Writes stamps as a receiver does: whole nanoseconds, never before the one that came earlier.
pub(crate) struct Receiver {
    start_ns: i64,
    last_ns: i64,
}

impl Receiver {
    pub(crate) fn new(start_ns: i64) -> Self {
        Self { start_ns, last_ns: i64::MIN }
    }

    pub(crate) fn stamp(&mut self, time_s: f64) -> i64 {
        self.last_ns = self.last_ns.max(self.start_ns + (time_s * 1e9).round() as i64);
        self.last_ns
    }
}
