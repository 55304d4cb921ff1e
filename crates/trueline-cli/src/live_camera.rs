//! The camera's side of a recording: pictures with all their stamps into the file, seam points to the estimate.

use crate::args::{CameraArgs, StampName};
use crate::failure::Failure;
use crate::interrupt;
use crate::latched_clock::{Exchange, LatchedClock};
use crate::live_estimate::LiveEstimate;
use crate::pictures;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
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
    is_replay: bool,
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
    /// How often the camera's clock was set.
    pub clock_set: AtomicU64,
}

/// More pictures than this share that did not come are a loss to be told with the exit code.
const MUCH: f64 = 0.1;

impl Counts {
    /// In half a line.
    pub fn text(&self) -> String {
        let [frames, unusable, missing, seams] =
            [&self.frames, &self.unusable, &self.missing, &self.seams].map(|n| n.load(Ordering::Relaxed));
        format!("{frames} pictures, {missing} missing, {unusable} not whole, the seam in {seams}")
    }

    /// What is missing or doubtful, in words; and whether it is much.
    pub fn losses(&self) -> (Vec<String>, bool) {
        let [frames, unusable, missing, clock_set] =
            [&self.frames, &self.unusable, &self.missing, &self.clock_set].map(|n| n.load(Ordering::Relaxed));
        let lost = missing + unusable;
        let mut words = Vec::new();
        if lost > 0 {
            words.push(format!(
                "{lost} of {} pictures did not come, or not whole: a slower rate, larger packets (jumbo frames) or a larger \
                 receive buffer (net.core.rmem_max) may help",
                frames + missing
            ));
        }
        if clock_set > 0 {
            words.push(format!(
                "the camera's clock was set {clock_set} times; with --stamp exposure pictures about those moments may be \
                 stamped wrongly"
            ));
        }
        (words, lost as f64 > MUCH * (frames + missing) as f64 || clock_set > 0)
    }
}

impl LiveCamera {
    /// Opens what the user named, if anything.
    pub fn open(
        args: &CameraArgs,
        sensor: Option<&Sensor>,
        clock: HostClock,
    ) -> Result<Option<Self>, Failure> {
        let Some(mut source) = patiently(|| source(args, sensor, clock))? else { return Ok(None) };
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
        let is_replay = args.replay.is_some();
        Ok(Some(Self { source, stamp: args.stamp, clock: latched, detector, is_replay, counts }))
    }

    /// What gives the pictures and what their stamps are, in words.
    pub fn meaning(&self) -> String {
        let about = self.source.about();
        if self.is_replay {
            return format!(
                "{}: when a picture of the folder was due; the offset against a live robot means nothing",
                about.name
            );
        }
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
        let Self { source, stamp, clock, detector, counts, .. } = self;
        let source = source.as_mut();
        let (held, usual_ns) = (VecDeque::new(), None);
        (Recording { source, stamp: *stamp, clock, detector, counts, last: None, held, usual_ns }, counts)
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
    /// Pictures that wait for the next exchange with the camera's clock.
    held: VecDeque<CameraFrame>,
    /// How long pictures usually take from their stamp to their arrival, ns.
    usual_ns: Option<i64>,
}

impl Recording<'_> {
    /// Records until all is over, or the camera is.
    pub fn run(
        &mut self,
        handle: &RecorderHandle,
        estimate: Option<&LiveEstimate>,
        over: &AtomicBool,
    ) -> Result<(), CameraError> {
        let mut seen = Ok(());
        while seen.is_ok() && !over.load(Ordering::SeqCst) && !self.source.has_ended() {
            seen = self.take(handle, estimate, false);
        }
        if seen.is_ok() {
            // Those that wait are stamped by what the clock says at the end.
            seen = self.take(handle, estimate, true);
        }
        self.let_go(handle, estimate, false);
        seen
    }

    fn take(
        &mut self,
        handle: &RecorderHandle,
        estimate: Option<&LiveEstimate>,
        last: bool,
    ) -> Result<(), CameraError> {
        let wait = if last { Duration::ZERO } else { LOOK };
        while let Some(frame) = self.source.next(wait)? {
            self.held.push_back(frame);
            if !last {
                break;
            }
        }
        let Some(clock) = self.clock else {
            self.let_go(handle, estimate, false);
            return Ok(());
        };
        let Some(Exchange { sample, was_set }) = clock.keep_up(self.source, last)? else { return Ok(()) };
        self.counts.clock_set.fetch_add(u64::from(was_set), Ordering::Relaxed);
        note(handle, sample, was_set);
        self.let_go(handle, estimate, was_set);
        Ok(())
    }

    /// Keeps the pictures that waited.
    fn let_go(&mut self, handle: &RecorderHandle, estimate: Option<&LiveEstimate>, was_set: bool) {
        while let Some(frame) = self.held.pop_front() {
            let stamp_ns = self.stamp_ns(&frame, was_set);
            self.keep(frame, stamp_ns, handle, estimate);
        }
    }

    fn stamp_ns(&mut self, frame: &CameraFrame, was_set: bool) -> i64 {
        let arrival_ns = frame.first_packet_ns.unwrap_or(frame.complete_ns);
        match (self.stamp, frame.device_ns, &self.clock) {
            (StampName::Exposure, Some(device_ns), Some(clock)) if was_set => {
                clock.likely_steady_ns(device_ns, arrival_ns, self.usual_ns)
            }
            (StampName::Exposure, Some(device_ns), Some(clock)) => {
                let stamp_ns = clock.steady_ns(device_ns);
                self.usual_ns = Some(arrival_ns - stamp_ns);
                stamp_ns
            }
            (StampName::Complete | StampName::Exposure, ..) => frame.complete_ns,
            (StampName::FirstPacket, ..) => arrival_ns,
        }
    }

    fn keep(
        &mut self,
        frame: CameraFrame,
        stamp_ns: i64,
        handle: &RecorderHandle,
        estimate: Option<&LiveEstimate>,
    ) {
        self.counts.frames.fetch_add(1, Ordering::Relaxed);
        if let Some(last) = self.last.replace(frame.frame) {
            let missing = frame.frame.saturating_sub(last).saturating_sub(1);
            self.counts.missing.fetch_add(missing, Ordering::Relaxed);
        }
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

/// Every exchange is kept, so that another map can be made.
fn note(handle: &RecorderHandle, sample: LatchSample, was_set: bool) {
    let LatchSample { before_ns, device_ns, after_ns } = sample;
    let (level, told) = match was_set {
        true => (NoteLevel::Warning, "the camera's clock was set. "),
        false => (NoteLevel::Info, ""),
    };
    let text = format!("{told}latch: before_ns {before_ns}, device_ns {device_ns}, after_ns {after_ns}");
    let _counted = handle.offer(Entry::Note(NoteEntry { steady_ns: after_ns, level, text }));
}

/// A camera may just be waking up: it is looked for again until it answers, time is up, or the user has enough.
fn patiently<T>(mut open: impl FnMut() -> Result<T, Opening>) -> Result<T, Failure> {
    let start = Instant::now();
    loop {
        match open() {
            Err(Opening::NotFound(_)) if start.elapsed() < PATIENCE && interrupt::times() == 0 => {}
            Err(Opening::NotFound(failure) | Opening::Failed(failure)) => return Err(failure),
            Ok(opened) => return Ok(opened),
        }
    }
}

/// How long a camera is looked for.
const PATIENCE: Duration = Duration::from_secs(8);

/// Why there is no camera.
enum Opening {
    NotFound(Failure),
    Failed(Failure),
}

impl From<CameraError> for Opening {
    fn from(error: CameraError) -> Self {
        match error {
            CameraError::NotFound { .. } => Self::NotFound(error.into()),
            other => Self::Failed(other.into()),
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
) -> Result<Option<Box<dyn FrameSource>>, Opening> {
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
) -> Result<Box<dyn FrameSource>, Opening> {
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
) -> Result<Box<dyn FrameSource>, Opening> {
    Err(Opening::Failed(Failure::new(
        format!("{address}: this program was built without GigE Vision"),
        "build it with the feature `gige`, or use --replay",
    )))
}

impl From<CameraError> for Failure {
    fn from(error: CameraError) -> Self {
        Self::new(error.to_string(), error.hint())
    }
}
