//! The camera's clock on this PC's, by asking it for the time now and then.

use crate::failure::Failure;
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
/// Exchanges that contradict each other by more tell of a clock that was set, s.
const SET_S: f64 = 1e-3;

/// A map that is kept up.
pub struct LatchedClock {
    samples: VecDeque<LatchSample>,
    map: LatchMap,
    asked: Instant,
}

impl LatchedClock {
    /// Asks some times, to begin with.
    pub fn begin(source: &mut dyn FrameSource) -> Result<Self, Failure> {
        let mut samples = VecDeque::new();
        for _ in 0..AT_FIRST {
            samples.extend(source.latch()?);
            thread::sleep(APART);
        }
        let Some(map) = LatchMap::of(samples.make_contiguous()) else {
            return Err(Failure::new(
                format!("{} cannot be asked for its time", source.about().name),
                "--stamp first-packet needs nothing of the camera",
            ));
        };
        Ok(Self { samples, map, asked: Instant::now() })
    }

    /// Asks again if it is time to; returns the exchange, and whether the camera's clock was set meanwhile: then what came before
    /// is forgotten.
    pub fn keep_up(
        &mut self,
        source: &mut dyn FrameSource,
    ) -> Result<Option<(LatchSample, bool)>, CameraError> {
        if self.asked.elapsed() < EVERY {
            return Ok(None);
        }
        self.asked = Instant::now();
        let Some(sample) = source.latch()? else { return Ok(None) };
        if self.samples.len() == MOST {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
        let Some(map) = LatchMap::of(self.samples.make_contiguous()) else { return Ok(None) };
        let was_set = map.contradiction_s > SET_S;
        if was_set {
            // The old map still has the right rate; its origin comes with the exchanges that follow.
            self.samples.clear();
        } else {
            self.map = map;
        }
        Ok(Some((sample, was_set)))
    }

    /// This PC's steady time at a time of the camera's clock, ns both.
    pub fn steady_ns(&self, device_ns: i64) -> i64 {
        self.map.host_ns(device_ns)
    }
}
