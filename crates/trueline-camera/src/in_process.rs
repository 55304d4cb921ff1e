//! A simulated camera without a network: pictures of its own clock, straight into the program.

use crate::error::CameraError;
use crate::frame_source::{CameraFrame, FrameSource, FrameStatus, SourceAbout};
use crate::latch_clock::LatchSample;
use std::thread;
use std::time::Duration;
use trueline_dataset::{FrameSignals, GrayImage, Pixels};
use trueline_live::HostClock;

/// How such a camera takes pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InProcessSettings {
    /// Columns and rows, px.
    pub size: [usize; 2],
    /// Between the starts of two exposures, s.
    pub period_s: f64,
    /// Exposure time, s.
    pub exposure_s: f64,
    /// From the end of an exposure until its picture is there, s.
    pub latency_s: f64,
    /// Its clock's reading at the start, ns.
    pub epoch_ns: i64,
    /// By how much its clock gains on the PC's, parts per million.
    pub drift_ppm: f64,
}

/// Pictures by the start of their exposure on the steady clock, ns; `None` drops one.
pub(crate) type Scene = Box<dyn FnMut(i64) -> Option<GrayImage> + Send>;

/// The camera.
pub struct InProcess {
    settings: InProcessSettings,
    scene: Scene,
    clock: HostClock,
    about: SourceAbout,
    start_ns: i64,
    next: u64,
}

impl InProcess {
    /// Its first exposure starts now.
    #[must_use]
    pub fn start(settings: InProcessSettings, scene: Scene, clock: HostClock) -> Self {
        let [width, height] = settings.size;
        let about = SourceAbout {
            name: "simulated camera in this program".to_owned(),
            width,
            height,
            tick_hz: Some(1e9),
            stamp_meaning: "start of the exposure".to_owned(),
            trigger: None,
        };
        Self { settings, scene, clock, about, start_ns: clock.read().steady_ns, next: 0 }
    }

    fn exposure_start_ns(&self) -> i64 {
        self.start_ns + (self.next as f64 * self.settings.period_s * 1e9).round() as i64
    }

    /// Its clock's reading at a steady time, ns both.
    #[must_use]
    pub fn device_ns(&self, steady_ns: i64) -> i64 {
        let passed_ns = steady_ns - self.start_ns;
        let fast_ns = (passed_ns as f64 * self.settings.drift_ppm * 1e-6).round() as i64;
        self.settings.epoch_ns + passed_ns + fast_ns
    }

    fn frame(&self, image: GrayImage, exposure_start_ns: i64, complete_ns: i64) -> CameraFrame {
        let size = [image.width, image.height];
        let levels = match &image.pixels {
            Pixels::Eight(levels) => levels.len(),
            Pixels::Sixteen(levels) => levels.len(),
        };
        let whole = size == self.settings.size && levels == size[0] * size[1];
        let [width, height] = size.map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        CameraFrame {
            image: whole.then_some(image),
            profiles: Vec::new(),
            frame: self.next,
            device_ns: Some(self.device_ns(exposure_start_ns)),
            first_packet_ns: Some(complete_ns),
            complete_ns,
            exposure_us: Some(self.settings.exposure_s * 1e6),
            signals: FrameSignals::default(),
            status: if whole { FrameStatus::Complete } else { FrameStatus::WrongSize { width, height } },
        }
    }
}

impl FrameSource for InProcess {
    fn next(&mut self, timeout: Duration) -> Result<Option<CameraFrame>, CameraError> {
        let until_ns =
            self.clock.read().steady_ns + i64::try_from(timeout.as_nanos()).unwrap_or(i64::MAX / 2);
        loop {
            let exposure_start_ns = self.exposure_start_ns();
            let ready_s = self.settings.exposure_s + self.settings.latency_s;
            let due_ns = exposure_start_ns + (ready_s * 1e9).round() as i64;
            let now_ns = self.clock.read().steady_ns;
            let wait_ns = due_ns.min(until_ns) - now_ns;
            thread::sleep(Duration::from_nanos(u64::try_from(wait_ns).unwrap_or(0)));
            if due_ns > until_ns {
                return Ok(None);
            }
            let image = (self.scene)(exposure_start_ns);
            // Its due time, at any load of the machine: only the network is not simulated.
            let frame = image.map(|image| self.frame(image, exposure_start_ns, due_ns));
            self.next += 1;
            if frame.is_some() {
                return Ok(frame);
            }
        }
    }

    fn about(&self) -> &SourceAbout {
        &self.about
    }

    fn latch(&mut self) -> Result<Option<LatchSample>, CameraError> {
        let before_ns = self.clock.read().steady_ns;
        let device_ns = self.device_ns(before_ns);
        Ok(Some(LatchSample { before_ns, device_ns, after_ns: self.clock.read().steady_ns }))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    const SETTINGS: InProcessSettings = InProcessSettings {
        size: [4, 2],
        period_s: 0.02,
        exposure_s: 0.004,
        latency_s: 0.003,
        epoch_ns: 777_000,
        drift_ppm: 200.0,
    };

    fn picture(width: usize) -> GrayImage {
        GrayImage { width, height: 2, pixels: Pixels::Eight(vec![9; 2 * width]) }
    }

    #[test]
    fn pictures_come_when_they_are_due_with_the_stamps_of_their_exposure() {
        let clock = HostClock::start();
        let mut count = 0;
        let scene: Scene = Box::new(move |_| {
            count += 1;
            (count != 3).then(|| picture(4))
        });
        let mut camera = InProcess::start(SETTINGS, scene, clock);
        let start_ns = camera.start_ns;
        for frame in [0_i64, 1, 3, 4] {
            let given = camera.next(Duration::from_secs(5)).unwrap().unwrap();
            let exposed_ns = start_ns + frame * 20_000_000;
            assert_eq!((given.frame, given.status.clone()), (frame as u64, FrameStatus::Complete));
            assert_eq!(given.complete_ns, exposed_ns + 7_000_000);
            // 200 ppm of 20 ms are 4 µs.
            assert_eq!(given.device_ns, Some(777_000 + frame * 20_004_000));
            assert!(clock.read().steady_ns >= given.complete_ns, "never early");
        }
        assert!(camera.next(Duration::ZERO).unwrap().is_none());
        let LatchSample { before_ns, device_ns, after_ns } = camera.latch().unwrap().unwrap();
        assert!((camera.device_ns(before_ns)..=camera.device_ns(after_ns)).contains(&device_ns));
    }

    #[test]
    fn a_picture_of_another_size_has_no_pixels() {
        let mut camera = InProcess::start(SETTINGS, Box::new(|_| Some(picture(5))), HostClock::start());
        let given = camera.next(Duration::from_secs(5)).unwrap().unwrap();
        assert_eq!((given.image, given.status), (None, FrameStatus::WrongSize { width: 5, height: 2 }));
    }
}
