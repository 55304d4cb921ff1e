//! The camera's clock on this PC's, by asking it for the time now and then.

use crate::error::CellError;
use std::collections::VecDeque;
use std::thread;
use std::time::{Duration, Instant};
use trueline_camera::{CameraError, FrameSource, LatchMap, LatchSample};

/// Exchanges before the first picture, and the time between them: a rate good to some ppm.
const AT_FIRST: usize = 12;
const APART: Duration = Duration::from_millis(80);
/// Between exchanges afterwards.
const EVERY: Duration = Duration::from_secs(1);
/// Exchanges that the map is made of: two minutes.
const MOST: usize = 120;
/// Exchanges that contradict each other by more show that a clock was set, s.
const SET_S: f64 = 1e-3;

/// A map that is kept up.
pub struct CameraClock {
    samples: VecDeque<LatchSample>,
    now: Reading,
    /// As it was before the clock was set last.
    before: Option<Reading>,
    asked: Instant,
}

/// The camera's clock in steady time: a map, and the total setting of the clock since then.
#[derive(Clone, Copy)]
struct Reading {
    map: LatchMap,
    shift_ns: i64,
}

impl Reading {
    fn steady_ns(&self, device_ns: i64) -> i64 {
        self.map.host_ns(device_ns) + self.shift_ns
    }
}

/// One exchange with the camera.
pub struct Exchange {
    /// A reading of both clocks, and when it was taken.
    pub sample: LatchSample,
    /// The camera's clock was set since the one before.
    pub was_set: bool,
}

impl CameraClock {
    /// Reads the camera's clock some times, to begin with.
    ///
    /// # Errors
    /// A camera that fails, or has no clock that can be read.
    pub fn begin(source: &mut dyn FrameSource) -> Result<Self, CellError> {
        let mut samples = VecDeque::new();
        for _ in 0..AT_FIRST {
            samples.extend(source.latch()?);
            thread::sleep(APART);
        }
        let Some(map) = LatchMap::of(samples.make_contiguous()) else {
            return Err(CellError::NoCameraClock { name: source.about().name.clone() });
        };
        Ok(Self { samples, now: Reading { map, shift_ns: 0 }, before: None, asked: Instant::now() })
    }

    /// Reads it again, if a second has passed or `at_once`.
    ///
    /// # Errors
    /// A camera that fails.
    pub(crate) fn keep_up(
        &mut self,
        source: &mut dyn FrameSource,
        at_once: bool,
    ) -> Result<Option<Exchange>, CameraError> {
        if !at_once && self.asked.elapsed() < EVERY {
            return Ok(None);
        }
        self.asked = Instant::now();
        let Some(sample) = source.latch()? else { return Ok(None) };
        let middle_ns = sample.before_ns + (sample.after_ns - sample.before_ns) / 2;
        let off_ns = middle_ns - self.now.steady_ns(sample.device_ns);
        let uncertain_s = SET_S + (sample.after_ns - sample.before_ns) as f64 * 1e-9;
        let was_set = off_ns as f64 * 1e-9 > uncertain_s || (off_ns as f64) * 1e-9 < -uncertain_s;
        if was_set {
            // The rate stays. The origin follows this exchange.
            self.before = Some(self.now);
            self.now.shift_ns += off_ns;
            self.samples.clear();
        }
        if self.samples.len() == MOST {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
        if self.samples.len() >= AT_FIRST
            && let Some(map) = LatchMap::of(self.samples.make_contiguous())
        {
            self.now = Reading { map, shift_ns: 0 };
        }
        Ok(Some(Exchange { sample, was_set }))
    }

    /// This PC's steady time at a time of the camera's clock, ns both.
    #[must_use]
    pub fn steady_ns(&self, device_ns: i64) -> i64 {
        self.now.steady_ns(device_ns)
    }

    /// The same for a picture, where the clock may have been set between its exposure and the last exchange.
    /// Of both readings it takes the one that gives the picture its usual delay.
    #[must_use]
    pub(crate) fn likely_steady_ns(&self, device_ns: i64, arrival_ns: i64, usual_ns: Option<i64>) -> i64 {
        let now_ns = self.steady_ns(device_ns);
        let (Some(before), Some(usual_ns)) = (self.before, usual_ns) else { return now_ns };
        let before_ns = before.steady_ns(device_ns);
        let odd = |steady_ns: i64| (arrival_ns - steady_ns - usual_ns).abs();
        if odd(before_ns) < odd(now_ns) { before_ns } else { now_ns }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use trueline_camera::{CameraFrame, SourceAbout};

    /// A camera with only a clock; time advances by a second with every question.
    struct Clock {
        now_ns: i64,
        set_by_ns: i64,
        about: SourceAbout,
    }

    const EPOCH_NS: i64 = 900_000_000_000;

    impl Clock {
        fn device_ns(&self, steady_ns: i64) -> i64 {
            // 50 ppm fast.
            EPOCH_NS + steady_ns + steady_ns / 20_000 + self.set_by_ns
        }
    }

    impl FrameSource for Clock {
        fn next(&mut self, _: Duration) -> Result<Option<CameraFrame>, CameraError> {
            Ok(None)
        }

        fn about(&self) -> &SourceAbout {
            &self.about
        }

        fn latch(&mut self) -> Result<Option<LatchSample>, CameraError> {
            self.now_ns += 1_000_000_000;
            let (before_ns, after_ns) = (self.now_ns - 50_000, self.now_ns + 50_000);
            Ok(Some(LatchSample { before_ns, device_ns: self.device_ns(self.now_ns), after_ns }))
        }
    }

    #[test]
    fn a_clock_that_is_set_is_followed_at_the_next_exchange() {
        for step_ns in [10_000_000_000, 5_000_000, -300_000_000] {
            let about = SourceAbout {
                name: String::new(),
                width: 1,
                height: 1,
                tick_hz: None,
                stamp_meaning: String::new(),
                trigger: None,
            };
            let mut camera = Clock { now_ns: 0, set_by_ns: 0, about };
            let Ok(mut clock) = CameraClock::begin(&mut camera) else { unreachable!("it can be asked") };
            assert!(!clock.keep_up(&mut camera, true).unwrap().unwrap().was_set);
            // Two pictures, 0.2 s before and after the clock is set; they take 30 ms to come.
            let (early_ns, late_ns) = (camera.now_ns + 300_000_000, camera.now_ns + 700_000_000);
            let early_device_ns = camera.device_ns(early_ns);
            camera.set_by_ns = step_ns;
            let late_device_ns = camera.device_ns(late_ns);
            assert!(clock.keep_up(&mut camera, true).unwrap().unwrap().was_set, "{step_ns}");
            for (device_ns, exposed_ns) in [(early_device_ns, early_ns), (late_device_ns, late_ns)] {
                let arrival_ns = exposed_ns + 30_400_000;
                let stamp_ns = clock.likely_steady_ns(device_ns, arrival_ns, Some(30_000_000));
                // Half a round trip, and some ppm of a second.
                assert!((stamp_ns - exposed_ns).abs() < 100_000, "{} ns", stamp_ns - exposed_ns);
            }
            for _ in 0..40 {
                assert!(!clock.keep_up(&mut camera, true).unwrap().unwrap().was_set);
                let now_ns = camera.now_ns;
                assert!((clock.steady_ns(camera.device_ns(now_ns)) - now_ns).abs() < 100_000);
            }
        }
    }
}
