//! The camera's clock: any origin, its own rate, and now and then set.

use super::words::locked;
use std::sync::Mutex;

/// How the camera's clock runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceClock {
    /// Its reading when the device starts, ns; not negative.
    pub epoch_ns: i64,
    /// By how much it gains on the PC's, parts per million.
    pub drift_ppm: f64,
    /// When it is set, if ever.
    pub step: Option<ClockStep>,
}

/// A clock that is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockStep {
    /// After the device's start, s.
    pub after_s: f64,
    /// By how much, ns.
    pub by_ns: i64,
}

impl Default for DeviceClock {
    /// Was switched on a quarter of an hour ago and keeps time.
    fn default() -> Self {
        Self { epoch_ns: 900_000_000_000, drift_ppm: 0.0, step: None }
    }
}

/// A clock that runs.
pub(super) struct RunningClock {
    start_ns: i64,
    epoch_ns: i64,
    drift: f64,
    /// From which steady time on, by how much, ns.
    steps: Mutex<Vec<(i64, i64)>>,
}

impl RunningClock {
    /// Starts at a steady time, ns.
    pub(super) fn start(clock: DeviceClock, start_ns: i64) -> Self {
        let first = clock.step.map(|step| (start_ns.saturating_add((step.after_s * 1e9) as i64), step.by_ns));
        Self {
            start_ns,
            epoch_ns: clock.epoch_ns,
            drift: clock.drift_ppm * 1e-6,
            steps: Mutex::new(first.into_iter().collect()),
        }
    }

    /// Sets it by this amount from a steady time on, ns.
    pub(super) fn step(&self, from_ns: i64, by_ns: i64) {
        locked(&self.steps).push((from_ns, by_ns));
    }

    /// Its reading at a steady time, ns.
    pub(super) fn device_ns(&self, steady_ns: i64) -> i64 {
        let since = steady_ns - self.start_ns;
        let gained = (since as f64 * self.drift).round() as i64;
        let steps = locked(&self.steps);
        let stepped: i64 = steps.iter().filter(|(from_ns, _)| *from_ns <= steady_ns).map(|(_, by)| by).sum();
        (self.epoch_ns + since + gained + stepped).max(0)
    }

    /// How long a time of this clock is on the steady one, ns.
    pub(crate) fn steady_length_ns(&self, device_length_ns: f64) -> f64 {
        device_length_ns / (1.0 + self.drift)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_drifts_from_its_epoch_and_a_step_holds_from_its_time_on() {
        let step = Some(ClockStep { after_s: 2.0, by_ns: 7 });
        let clock = RunningClock::start(DeviceClock { epoch_ns: 1000, drift_ppm: 50.0, step }, 5_000_000_000);
        assert_eq!(clock.device_ns(5_000_000_000), 1000);
        assert_eq!(clock.device_ns(6_000_000_000), 1_000_051_000);
        assert_eq!(clock.device_ns(7_000_000_000), 2_000_101_007);
        clock.step(8_000_000_000, -7);
        assert_eq!(clock.device_ns(8_000_000_000), 3_000_151_000);
        assert_eq!(clock.device_ns(7_000_000_000), 2_000_101_007, "the past stays as it was");
    }
}
