//! The camera's side of a recording: pictures with all their stamps into the file, seam points to the estimate.

use crate::args::{CameraArgs, StampName};
use crate::failure::Failure;
use crate::latched_clock::LatchedClock;
use crate::live_estimate::LiveEstimate;
use crate::pictures;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;
use trueline_camera::{CameraError, CameraFrame, FrameSource, FrameStatus, LatchSample, Pace, Replay};
use trueline_dataset::{Sensor, gray_png};
use trueline_live::HostClock;
use trueline_mcap::{Entry, FrameEntry, NoteEntry, NoteLevel, RecorderHandle};
use trueline_vision::{Detector, Joint, Lens};

/// Between looks at whether all is over.
const LOOK: Duration = Duration::from_millis(100);

/// A camera that is recorded.
pub struct LiveCamera {
    source: Box<dyn FrameSource>,
    stamp: StampName,
    clock: Option<LatchedClock>,
    detector: Option<(Detector, Joint)>,
    counts: Counts,
}

/// What came of it, for whoever displays.
#[derive(Default)]
pub struct Counts {
    /// Frames that came, whole or not.
    pub frames: AtomicU64,
    /// Those that are not whole, or not what was agreed.
    pub unusable: AtomicU64,
    /// Numbers of the camera's counter that never came.
    pub missing: AtomicU64,
    /// Whole pictures in which a seam was found.
    pub seams: AtomicU64,
}

impl Counts {
    /// In half a line.
    pub fn text(&self) -> String {
        let [frames, unusable, missing, seams] =
            [&self.frames, &self.unusable, &self.missing, &self.seams].map(|n| n.load(Ordering::Relaxed));
        format!("{frames} pictures, {missing} missing, {unusable} not whole, the seam in {seams}")
    }
}

impl LiveCamera {
    /// Opens what the user named, if anything.
    pub fn open(
        args: &CameraArgs,
        sensor: Option<&Sensor>,
        clock: HostClock,
    ) -> Result<Option<Self>, Failure> {
        let Some(mut source) = source(args, sensor, clock)? else { return Ok(None) };
        let latched = match args.stamp {
            StampName::Exposure => Some(LatchedClock::begin(source.as_mut())?),
            StampName::FirstPacket | StampName::Complete => None,
        };
        let detector = match sensor {
            Some(Sensor::CameraLaser { camera, laser_plane_in_camera }) => {
                let about = source.about();
                let [width, height] = camera.size.map(|n| n as usize);
                if [about.width, about.height] != [width, height] {
                    return Err(Failure::new(
                        format!(
                            "{} gives {} x {} px, and sensor.toml says {width} x {height}",
                            about.name, about.width, about.height
                        ),
                        "a region of interest moves cx and cy; scaled pictures need scaled intrinsics",
                    ));
                }
                let joint = super::commands::features::joint(args.joint).unwrap_or(Joint::Fillet);
                Some((Detector::new(Lens::new(*camera, *laser_plane_in_camera)), joint))
            }
            _ => None,
        };
        let counts = Counts::default();
        Ok(Some(Self { source, stamp: args.stamp, clock: latched, detector, counts }))
    }

    /// What gives the pictures and what their stamps are, in words.
    pub fn meaning(&self) -> String {
        let about = self.source.about();
        let stamp = match self.stamp {
            StampName::FirstPacket => "arrival of the first packet (kernel)",
            StampName::Complete => "arrival of the last packet",
            StampName::Exposure => "the camera's own stamp, mapped by asking it for its time",
        };
        format!("{}: {stamp}, by a steady clock; device: {}", about.name, about.stamp_meaning)
    }

    /// What came so far.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Splits what records from what is shown meanwhile.
    pub fn parts(&mut self) -> (Recording<'_>, &Counts) {
        let Self { source, stamp, clock, detector, counts } = self;
        let source = source.as_mut();
        (Recording { source, stamp: *stamp, clock, detector, counts, last: None }, counts)
    }
}

/// What records.
pub struct Recording<'a> {
    source: &'a mut dyn FrameSource,
    stamp: StampName,
    clock: &'a mut Option<LatchedClock>,
    detector: &'a mut Option<(Detector, Joint)>,
    counts: &'a Counts,
    last: Option<u64>,
}

impl Recording<'_> {
    /// Records until all is over, or the camera is.
    pub fn run(
        &mut self,
        handle: &RecorderHandle,
        estimate: Option<&LiveEstimate>,
        over: &AtomicBool,
    ) -> Result<(), CameraError> {
        while !over.load(Ordering::SeqCst) && !self.source.has_ended() {
            if let Some(frame) = self.source.next(LOOK)? {
                self.keep(frame, handle, estimate);
            }
            self.keep_clock(handle)?;
        }
        Ok(())
    }

    /// Every exchange is kept, so that the map can be made anew.
    fn keep_clock(&mut self, handle: &RecorderHandle) -> Result<(), CameraError> {
        let Some(clock) = self.clock else { return Ok(()) };
        let Some((sample, was_set)) = clock.keep_up(self.source)? else { return Ok(()) };
        let LatchSample { before_ns, device_ns, after_ns } = sample;
        let (level, told) = match was_set {
            true => (NoteLevel::Warning, "the camera's clock was set. "),
            false => (NoteLevel::Info, ""),
        };
        let text = format!("{told}latch: before_ns {before_ns}, device_ns {device_ns}, after_ns {after_ns}");
        let _counted = handle.offer(Entry::Note(NoteEntry { steady_ns: after_ns, level, text }));
        Ok(())
    }

    fn keep(&mut self, frame: CameraFrame, handle: &RecorderHandle, estimate: Option<&LiveEstimate>) {
        self.counts.frames.fetch_add(1, Ordering::Relaxed);
        if let Some(last) = self.last.replace(frame.frame) {
            let missing = frame.frame.saturating_sub(last).saturating_sub(1);
            self.counts.missing.fetch_add(missing, Ordering::Relaxed);
        }
        let stamp_ns = match self.stamp {
            StampName::FirstPacket => frame.first_packet_ns.unwrap_or(frame.complete_ns),
            StampName::Complete => frame.complete_ns,
            StampName::Exposure => match (frame.device_ns, &self.clock) {
                (Some(device_ns), Some(clock)) => clock.steady_ns(device_ns),
                _ => frame.complete_ns,
            },
        };
        let png = frame.image.as_ref().map(gray_png::encode_gray);
        let (png, status) = match png {
            Some(Ok(png)) => (png, status(&frame.status)),
            Some(Err(error)) => (Vec::new(), format!("not encoded: {error}")),
            None => (Vec::new(), status(&frame.status)),
        };
        if png.is_empty() {
            self.counts.unusable.fetch_add(1, Ordering::Relaxed);
        }
        // What finds no room is counted there, and told at the end.
        let _counted = handle.offer(Entry::Frame(FrameEntry {
            frame: frame.frame,
            stamp_ns,
            first_packet_ns: frame.first_packet_ns,
            complete_ns: Some(frame.complete_ns),
            device_ns: frame.device_ns,
            exposure_us: frame.exposure_us,
            status,
            png,
        }));
        let (Some(image), Some((detector, joint))) = (&frame.image, self.detector.as_mut()) else { return };
        if let Ok(seam) = pictures::seam(detector, image, *joint) {
            self.counts.seams.fetch_add(1, Ordering::Relaxed);
            if let Some(estimate) = estimate {
                estimate.add_feature(pictures::feature(stamp_ns, frame.frame, frame.device_ns, &seam));
            }
        }
    }
}

fn status(status: &FrameStatus) -> String {
    match status {
        FrameStatus::Complete => "complete".to_owned(),
        FrameStatus::Incomplete { missing } => format!("{missing} packets missing"),
        FrameStatus::WrongSize { width, height } => format!("of another size: {width} x {height} px"),
        FrameStatus::WrongFormat { found } => format!("of another format: {found}"),
    }
}

fn source(
    args: &CameraArgs,
    sensor: Option<&Sensor>,
    clock: HostClock,
) -> Result<Option<Box<dyn FrameSource>>, Failure> {
    if let Some(folder) = &args.replay {
        return Ok(Some(Box::new(Replay::open(folder, Pace::Times(1.0), clock)?)));
    }
    let Some(address) = args.camera else { return Ok(None) };
    gige(args, sensor, address, clock).map(Some)
}

#[cfg(feature = "gige")]
fn gige(
    args: &CameraArgs,
    sensor: Option<&Sensor>,
    address: std::net::Ipv4Addr,
    clock: HostClock,
) -> Result<Box<dyn FrameSource>, Failure> {
    use trueline_camera::{GigeCamera, GigeSettings};
    let mut settings = GigeSettings::at(address);
    if let Some(Sensor::CameraLaser { camera, .. }) = sensor {
        (settings.width, settings.height) = (Some(camera.size[0]), Some(camera.size[1]));
    }
    settings.exposure_us = args.exposure_us;
    settings.fps = args.fps;
    Ok(Box::new(GigeCamera::open(&settings, clock)?))
}

#[cfg(not(feature = "gige"))]
fn gige(
    _: &CameraArgs,
    _: Option<&Sensor>,
    address: std::net::Ipv4Addr,
    _: HostClock,
) -> Result<Box<dyn FrameSource>, Failure> {
    Err(Failure::new(
        format!("{address}: this program was built without GigE Vision"),
        "build it with the feature `gige`, or use --replay",
    ))
}

impl From<CameraError> for Failure {
    fn from(error: CameraError) -> Self {
        Self::new(error.to_string(), error.hint())
    }
}
