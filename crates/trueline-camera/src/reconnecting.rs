//! A camera that may go away and come back: its pictures continue, and its interruptions are counted.

use crate::error::CameraError;
use crate::frame_source::{CameraFrame, FrameSource, SourceAbout};
use crate::latch_clock::LatchSample;
use std::thread;
use std::time::{Duration, Instant};

/// Opens the camera again.
pub(crate) type Reopen = Box<dyn FnMut() -> Result<Box<dyn FrameSource>, CameraError> + Send>;

/// A camera that is opened again after it was unplugged.
pub struct Reconnecting {
    camera: Option<Box<dyn FrameSource>>,
    reopen: Reopen,
    about: SourceAbout,
    serial: Option<String>,
    tried: Instant,
    interruptions: u64,
    last_frame: Option<u64>,
    /// Added to the camera's numbers so that they continue; found anew with the first picture after an interruption.
    ahead: Option<u64>,
}

/// Between attempts.
const AGAIN: Duration = Duration::from_millis(500);

impl Reconnecting {
    /// A camera that is open, and how it is opened again.
    #[must_use]
    pub fn new(camera: Box<dyn FrameSource>, reopen: Reopen) -> Self {
        let (about, serial) = (camera.about().clone(), camera.serial().map(str::to_owned));
        Self {
            camera: Some(camera),
            reopen,
            about,
            serial,
            tried: Instant::now(),
            interruptions: 0,
            last_frame: None,
            ahead: Some(0),
        }
    }

    /// Survives an unplugged camera. All other errors stay errors.
    fn survive<T>(&mut self, result: Result<Option<T>, CameraError>) -> Result<Option<T>, CameraError> {
        if !matches!(result, Err(CameraError::Unplugged { .. })) {
            return result;
        }
        (self.camera, self.tried) = (None, Instant::now());
        self.interruptions += 1;
        tracing::warn!(serial = self.serial, interruptions = self.interruptions, "camera unplugged");
        Ok(None)
    }

    /// Tries once, if it is due; the camera found must be of the same kind.
    fn look_for_it(&mut self, timeout: Duration) -> Result<(), CameraError> {
        let until_next = AGAIN.saturating_sub(self.tried.elapsed());
        thread::sleep(until_next.min(timeout));
        if until_next > timeout {
            return Ok(());
        }
        let opened = (self.reopen)();
        self.tried = Instant::now();
        let Ok(camera) = opened else { return Ok(()) };
        let (was, is) = (&self.about, camera.about());
        if [was.width, was.height] != [is.width, is.height] {
            let px = |about: &SourceAbout| [about.width as u32, about.height as u32];
            return Err(CameraError::FrameSizeChanged { was: px(was), is: px(is) });
        }
        same("DeviceSerialNumber", self.serial.as_deref(), camera.serial())?;
        same("TriggerMode", was.trigger.as_deref(), is.trigger.as_deref())?;
        self.ahead = None;
        self.camera = Some(camera);
        tracing::info!(serial = self.serial, "camera found again");
        Ok(())
    }
}

/// A camera that comes back must have this as it was.
fn same(name: &str, was: Option<&str>, is: Option<&str>) -> Result<(), CameraError> {
    if was == is {
        return Ok(());
    }
    let [was, is] = [was, is].map(|told| told.unwrap_or("none"));
    let why = format!("the camera came back with another one: it was {was}, and now is {is}");
    Err(CameraError::Feature { name: name.to_owned(), why })
}

impl FrameSource for Reconnecting {
    fn next(&mut self, timeout: Duration) -> Result<Option<CameraFrame>, CameraError> {
        let Some(camera) = &mut self.camera else {
            self.look_for_it(timeout)?;
            return Ok(None);
        };
        let next = camera.next(timeout);
        let mut frame = self.survive(next)?;
        if let Some(frame) = &mut frame {
            let next = self.last_frame.map_or(frame.frame, |last| last + 1);
            let ahead = *self.ahead.get_or_insert(next.wrapping_sub(frame.frame));
            frame.frame = frame.frame.wrapping_add(ahead);
            self.last_frame = Some(frame.frame);
        }
        Ok(frame)
    }

    fn about(&self) -> &SourceAbout {
        &self.about
    }

    fn serial(&self) -> Option<&str> {
        self.serial.as_deref()
    }

    fn latch(&mut self) -> Result<Option<LatchSample>, CameraError> {
        let Some(camera) = &mut self.camera else { return Ok(None) };
        let sample = camera.latch();
        self.survive(sample)
    }

    fn has_ended(&self) -> bool {
        self.camera.as_ref().is_some_and(|camera| camera.has_ended())
    }

    fn interruptions(&self) -> u64 {
        self.interruptions
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame_source::FrameStatus;
    use trueline_dataset::FrameSignals;

    /// Gives some pictures, numbered from 100, and is unplugged then.
    struct Flaky {
        about: SourceAbout,
        left: u64,
        given: u64,
    }

    impl FrameSource for Flaky {
        fn next(&mut self, _: Duration) -> Result<Option<CameraFrame>, CameraError> {
            if self.given == self.left {
                return Err(CameraError::Unplugged { silent_s: 1.0 });
            }
            self.given += 1;
            Ok(Some(CameraFrame {
                image: None,
                profiles: Vec::new(),
                frame: 99 + self.given,
                device_ns: None,
                first_packet_ns: None,
                complete_ns: 0,
                exposure_us: None,
                signals: FrameSignals::default(),
                status: FrameStatus::Complete,
            }))
        }

        fn about(&self) -> &SourceAbout {
            &self.about
        }
    }

    fn flaky(width: usize, left: u64) -> Box<dyn FrameSource> {
        triggered(width, left, None)
    }

    fn triggered(width: usize, left: u64, trigger: Option<String>) -> Box<dyn FrameSource> {
        let (name, stamp_meaning) = (String::new(), String::new());
        let about = SourceAbout { name, width, height: 4, tick_hz: None, stamp_meaning, trigger };
        Box::new(Flaky { about, left, given: 0 })
    }

    #[test]
    fn a_camera_that_comes_back_goes_on_with_its_numbers() {
        let mut attempts = 0;
        let reopen = Box::new(move || {
            attempts += 1;
            if attempts % 2 == 1 { Err(CameraError::Unplugged { silent_s: 0.0 }) } else { Ok(flaky(4, 3)) }
        });
        let mut camera = Reconnecting::new(flaky(4, 3), reopen);
        let mut numbers = Vec::new();
        while numbers.len() < 9 {
            numbers.extend(camera.next(Duration::from_secs(1)).unwrap().map(|frame| frame.frame));
        }
        // No picture is made up, and none is missing: the number in between is unknown.
        assert_eq!(numbers, (100..109).collect::<Vec<u64>>());
        assert_eq!(camera.interruptions(), 2);
    }

    #[test]
    fn another_camera_in_its_place_is_refused() {
        let mut camera = Reconnecting::new(flaky(4, 0), Box::new(|| Ok(flaky(8, 3))));
        let refused = (0..9).find_map(|_| camera.next(Duration::from_secs(1)).err());
        assert!(matches!(refused, Some(CameraError::FrameSizeChanged { .. })), "{refused:?}");
    }

    #[test]
    fn a_camera_that_comes_back_with_another_trigger_is_refused() {
        let waits = || triggered(4, 0, Some("Line1 RisingEdge".to_owned()));
        let mut camera = Reconnecting::new(waits(), Box::new(|| Ok(flaky(4, 3))));
        let refused = (0..9).find_map(|_| camera.next(Duration::from_secs(1)).err());
        let told = refused.map(|error| error.to_string()).unwrap_or_default();
        assert!(told.contains("it was Line1 RisingEdge, and now is none"), "{told}");
    }
}
