//! The camera's side of a recording: pictures with all their stamps into the file, seam points to the estimate.

use crate::camera_counts::CameraCounts;
use crate::camera_source::{self, CameraChoice, CameraSettings};
use crate::cell_listener::CellListener;
use crate::entries;
use crate::error::CellError;
use crate::frame_stamper::{FrameStamper, StampChoice};
use crate::live_estimate::LiveEstimate;
use crate::live_picture::LivePicture;
use crate::live_welds::LiveWelds;
use crate::seam_finder::SeamFinder;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use trueline_camera::{CameraError, CameraFrame, FrameSource};
use trueline_dataset::{Feature, FrameStamp, Sensor};
use trueline_live::HostClock;
use trueline_mcap::{Entry, RecorderHandle};
use trueline_vision::Joint;

/// Between looks at whether all is over.
const LOOK: Duration = Duration::from_millis(100);

/// Pictures on their way are still accepted for this time after the end.
const END_WITHIN: Duration = Duration::from_millis(500);

/// A camera that is recorded.
pub struct CameraRecorder {
    source: Box<dyn FrameSource>,
    stamper: FrameStamper,
    finder: Option<SeamFinder>,
    is_replay: bool,
    last: Option<u64>,
    /// Pictures that wait for the next exchange with the camera's clock.
    waiting: VecDeque<CameraFrame>,
    picture: Arc<LivePicture>,
}

impl CameraRecorder {
    /// Opens a camera. A camera that does not answer is tried again for some seconds, or until `give_up`
    /// returns true.
    ///
    /// # Errors
    /// A camera that cannot be used, does not suit the sensor, or has no clock although its stamp is wanted.
    pub fn open(
        settings: &CameraSettings,
        sensor: Option<&Sensor>,
        clock: HostClock,
        give_up: &dyn Fn() -> bool,
    ) -> Result<Self, CellError> {
        let source = camera_source::open(settings, sensor, clock, give_up)?;
        let is_replay = matches!(settings.choice, CameraChoice::Replay(_));
        Ok(Self { is_replay, ..Self::with_source(source, settings.stamp, settings.joint, sensor)? })
    }

    /// Records from a source that is open already: any camera for which somebody has written a [`FrameSource`]. The joint is as in
    /// [`CameraSettings`].
    ///
    /// # Errors
    /// A source that does not suit the sensor, or has no clock although its stamp is wanted.
    pub fn with_source(
        mut source: Box<dyn FrameSource>,
        stamp: StampChoice,
        joint: impl Into<Option<Joint>>,
        sensor: Option<&Sensor>,
    ) -> Result<Self, CellError> {
        let stamper = FrameStamper::new(stamp, source.as_mut())?;
        let finder = match sensor {
            Some(sensor) => SeamFinder::new(sensor, joint.into(), source.about())?,
            None => None,
        };
        Ok(Self {
            source,
            stamper,
            finder,
            is_replay: false,
            last: None,
            waiting: VecDeque::new(),
            picture: Arc::default(),
        })
    }

    /// The last picture, for observers.
    #[must_use]
    pub fn picture(&self) -> Arc<LivePicture> {
        Arc::clone(&self.picture)
    }

    /// Source of the pictures and meaning of their stamps, in the words of the recording.
    #[must_use]
    pub fn stamp_meaning(&self) -> String {
        let about = self.source.about();
        if self.is_replay {
            return format!(
                "{}: when a picture of the folder was due; the offset against a live robot is \
                meaningless",
                about.name
            );
        }
        let stamp = self.stamper.choice().meaning();
        let trigger = about.trigger.as_ref().map(|signal| format!("; each picture waits for {signal}"));
        let trigger = trigger.unwrap_or_default();
        format!("{}: {stamp}, by a steady clock; device: {}{trigger}", about.name, about.stamp_meaning)
    }

    /// Records until all is over, or the camera is.
    ///
    /// # Errors
    /// A camera that fails; earlier pictures are recorded.
    pub fn run(
        &mut self,
        handle: &RecorderHandle,
        goal: &SeamPoints<'_>,
        over: &AtomicBool,
    ) -> Result<(), CameraError> {
        let sink = Sink { handle, goal };
        let is_triggered = self.source.about().trigger.is_some();
        sink.count(|counts| counts.is_triggered = is_triggered);
        let mut seen = Ok(());
        while seen.is_ok() && !over.load(Ordering::SeqCst) && !self.source.has_ended() {
            seen = self.take(&sink, false);
        }
        if seen.is_ok() {
            // Waiting pictures are stamped by the clock's last state.
            seen = self.take(&sink, true);
        }
        self.record_waiting(&sink, false);
        sink.give_all(self.finder.as_mut().map_or_else(Vec::new, SeamFinder::finish));
        seen
    }

    fn take(&mut self, sink: &Sink<'_>, last: bool) -> Result<(), CameraError> {
        if last {
            // Pictures that came before the end and are not searched yet. A slow source must not delay the
            // end. Pictures of a replay stay in their folder.
            let start = Instant::now();
            while !self.is_replay
                && start.elapsed() < END_WITHIN
                && let Some(frame) = self.source.next(Duration::ZERO)?
            {
                self.waiting.push_back(frame);
            }
        } else {
            self.waiting.extend(self.source.next(LOOK)?);
        }
        let interruptions = self.source.interruptions();
        sink.count(|counts| counts.interruptions = interruptions);
        if !self.stamper.needs_exchanges() {
            self.record_waiting(sink, false);
            return Ok(());
        }
        let Some(exchange) = self.stamper.keep_up(self.source.as_mut(), last)? else { return Ok(()) };
        sink.count(|counts| counts.clock_set += u64::from(exchange.was_set));
        sink.record(entries::exchange(&exchange));
        self.record_waiting(sink, exchange.was_set);
        Ok(())
    }

    fn record_waiting(&mut self, sink: &Sink<'_>, was_set: bool) {
        while let Some(frame) = self.waiting.pop_front() {
            let stamp_ns = self.stamper.stamp_ns(&frame, was_set);
            self.record(&frame, stamp_ns, sink);
        }
    }

    fn record(&mut self, frame: &CameraFrame, stamp_ns: i64, sink: &Sink<'_>) {
        let last = self.last.replace(frame.frame);
        let missing = last.map_or(0, |last| frame.frame.saturating_sub(last).saturating_sub(1));
        let entry = entries::frame(frame, stamp_ns);
        let is_unusable = entry.png.is_empty() && frame.profiles.is_empty();
        sink.record(Entry::Frame(entry));
        self.record_profiles(frame, stamp_ns, sink);
        let stamp = FrameStamp { stamp_ns, frame: frame.frame, device_ns: frame.device_ns };
        let find = |finder: &mut SeamFinder| finder.find(frame.image.as_ref()?, &stamp);
        let seam = self.finder.as_mut().and_then(find);
        sink.count(|counts| {
            counts.frames += 1;
            counts.signals = frame.signals;
            counts.missing += missing;
            counts.unusable += u64::from(is_unusable);
            counts.seams += u64::from(seam.is_some());
        });
        if let Some(image) = &frame.image {
            let _nobody_looks = self.picture.offer(image, frame.frame, seam.as_ref());
        }
        sink.give(seam);
    }

    fn record_profiles(&mut self, frame: &CameraFrame, stamp_ns: i64, sink: &Sink<'_>) {
        for profile in entries::profiles(frame, stamp_ns, self.stamper.is_of_arrival()) {
            let seams = self.finder.as_mut().map_or_else(Vec::new, |finder| finder.in_profile(&profile));
            let no_return = profile.columns.iter().filter(|column| column.is_none()).count();
            sink.count(|counts| {
                counts.profiles += 1;
                counts.columns += profile.columns.len() as u64;
                counts.no_return += no_return as u64;
            });
            sink.record(Entry::Profile(profile));
            sink.give_all(seams);
        }
    }
}

/// Destination of seam points beside the recording.
pub struct SeamPoints<'a> {
    /// The estimate, if there is one.
    pub estimate: Option<&'a LiveEstimate>,
    /// Divider of the points into welds, if any.
    pub welds: Option<&'a LiveWelds>,
    /// Who hears of them, if anybody does.
    pub listener: Option<&'a dyn CellListener>,
    /// Pictures are counted there.
    pub counts: &'a Mutex<CameraCounts>,
}

/// Destination of pictures.
struct Sink<'a> {
    handle: &'a RecorderHandle,
    goal: &'a SeamPoints<'a>,
}

impl Sink<'_> {
    /// An entry without room is counted there, and reported at the end.
    fn record(&self, entry: Entry) {
        let _counted = self.handle.offer(entry);
    }

    /// Seam points of profiles, which are found after them.
    fn give_all(&self, seams: Vec<Feature>) {
        self.count(|counts| counts.seams += seams.len() as u64);
        seams.into_iter().for_each(|seam| self.give(Some(seam)));
    }

    fn give(&self, seam: Option<Feature>) {
        let Some(seam) = seam else { return };
        if let Some(listener) = self.goal.listener {
            listener.seam(&seam);
        }
        if let Some(estimate) = self.goal.estimate {
            estimate.add_feature(seam);
        }
        if let Some(welds) = self.goal.welds {
            welds.add_feature(seam);
        }
    }

    fn count(&self, add: impl FnOnce(&mut CameraCounts)) {
        add(&mut self.goal.counts.lock().unwrap_or_else(PoisonError::into_inner));
    }
}
