//! A recorded scan, given again as if it were live.

use crate::error::CameraError;
use crate::frame_source::{CameraFrame, FrameSource, FrameStatus, SourceAbout};
use std::path::Path;
use std::time::Duration;
use trueline_dataset::{FrameFile, FrameSignals, GrayImage, Pixels, gray_png, images};
use trueline_live::HostClock;

/// How fast a recording is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// As many times as fast as it was recorded; must be above zero.
    Times(f64),
    /// As fast as it can be read.
    Unpaced,
}

/// The pictures of a dataset folder.
pub struct Replay {
    frames: Vec<FrameFile>,
    about: SourceAbout,
    sixteen_bits: bool,
    pace: Pace,
    clock: HostClock,
    /// Steady time at which the first picture was due, ns, after the first request.
    start_ns: Option<i64>,
    position: usize,
    /// Read before its time comes, so that reading does not delay it.
    ready: Option<CameraFrame>,
}

impl Replay {
    /// Opens a dataset folder; time runs from the first call of `next`.
    ///
    /// # Errors
    /// [`CameraError::Recording`] if the index or the first picture cannot be read.
    pub fn open(dataset: &Path, pace: Pace, clock: HostClock) -> Result<Self, CameraError> {
        let frames = images::read_index(dataset)?;
        let first = gray_png::read(&frames[0].path, &mut Vec::new())?;
        let about = SourceAbout {
            name: format!("recording {}", dataset.display()),
            width: first.width,
            height: first.height,
            tick_hz: None,
            stamp_meaning: "device stamps as recorded; a picture is complete when its recorded stamp is due"
                .to_owned(),
            trigger: None,
        };
        let sixteen_bits = has_sixteen_bits(&first);
        Ok(Self { frames, about, sixteen_bits, pace, clock, start_ns: None, position: 0, ready: None })
    }

    /// Steady time at which a picture is due, ns.
    fn due_ns(&self, start_ns: i64, frame: &FrameFile) -> i64 {
        match self.pace {
            Pace::Unpaced => start_ns,
            Pace::Times(times) => {
                let since = (frame.stamp_ns - self.frames[0].stamp_ns) as f64 / times;
                // Upwards, so that none comes early.
                start_ns.saturating_add(since.ceil() as i64)
            }
        }
    }

    fn read(&mut self, start_ns: i64) -> Result<Option<CameraFrame>, CameraError> {
        let Some(frame) = self.frames.get(self.position) else {
            return Ok(None);
        };
        // An unreadable picture is reported once; the next call continues behind it.
        self.position += 1;
        let image = gray_png::read(&frame.path, &mut Vec::new())?;
        let status = self.status(&image);
        Ok(Some(CameraFrame {
            image: (status == FrameStatus::Complete).then_some(image),
            profiles: Vec::new(),
            frame: frame.frame,
            device_ns: frame.device_ns,
            first_packet_ns: None,
            complete_ns: self.due_ns(start_ns, frame),
            exposure_us: None,
            signals: FrameSignals::default(),
            status,
        }))
    }

    fn status(&self, image: &GrayImage) -> FrameStatus {
        if (image.width, image.height) != (self.about.width, self.about.height) {
            return FrameStatus::WrongSize { width: image.width as u32, height: image.height as u32 };
        }
        if has_sixteen_bits(image) != self.sixteen_bits {
            let bits = if self.sixteen_bits { 8 } else { 16 };
            return FrameStatus::WrongFormat { found: format!("{bits} bits") };
        }
        FrameStatus::Complete
    }
}

fn has_sixteen_bits(image: &GrayImage) -> bool {
    matches!(image.pixels, Pixels::Sixteen(_))
}

impl FrameSource for Replay {
    fn next(&mut self, timeout: Duration) -> Result<Option<CameraFrame>, CameraError> {
        let now_ns = self.clock.read().steady_ns;
        let start_ns = *self.start_ns.get_or_insert(now_ns);
        if self.ready.is_none() {
            self.ready = self.read(start_ns)?;
        }
        let until_ns = now_ns.saturating_add(i64::try_from(timeout.as_nanos()).unwrap_or(i64::MAX));
        let Some(due_ns) = self.ready.as_ref().map(|frame| frame.complete_ns) else {
            return Ok(None);
        };
        loop {
            let left_ns = due_ns.min(until_ns) - self.clock.read().steady_ns;
            match u64::try_from(left_ns) {
                Ok(left_ns) if left_ns > 0 => std::thread::sleep(Duration::from_nanos(left_ns)),
                _ => break,
            }
        }
        let mut frame = if due_ns <= until_ns { self.ready.take() } else { None };
        if let (Some(frame), Pace::Unpaced) = (&mut frame, self.pace) {
            frame.complete_ns = self.clock.read().steady_ns;
        }
        Ok(frame)
    }

    fn about(&self) -> &SourceAbout {
        &self.about
    }

    fn has_ended(&self) -> bool {
        self.ready.is_none() && self.position >= self.frames.len()
    }
}
