//! Writes the robot's messages, the answers and the clocks of this PC into `recording.mcap`.

use crate::cell_listener::CellListener;
use crate::entries;
use crate::error::CellError;
use crate::input_watch::InputWatch;
use crate::live_estimate::LiveEstimate;
use crate::live_welds::LiveWelds;
use crate::robot_brief::RobotBrief;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use trueline_dataset::RobotSample;
use trueline_live::guide::Answer;
use trueline_live::host_clock::StepWatch;
use trueline_live::{HostClock, RobotAnswer, RobotPacket, StreamWatch};
use trueline_mcap::{About, Entry, Listener, NoteEntry, NoteLevel, RecordError, Recorder, RecorderHandle};

/// Name of the recording in its folder.
pub const RECORDING: &str = "recording.mcap";

/// The stamp of a datagram.
pub const ARRIVAL: &str = "arrival at this PC (kernel)";
/// The stamp of a package that came over TCP, which the kernel does not stamp.
pub const READING: &str = "reading at this PC (TCP)";

/// Foreign datagrams that are kept byte for byte; more are counted.
const MOST_REJECTED: u64 = 1000;
/// Between readings of both clocks, ns.
const CLOCK_EVERY_NS: i64 = 1_000_000_000;

/// A recording that is under way.
pub struct CellRecording {
    file: PathBuf,
    recorder: Recorder,
    handle: RecorderHandle,
    watch: StreamWatch,
    clock: HostClock,
    steps: StepWatch,
    clock_read_ns: i64,
    clock_steps: u32,
    rejected: u64,
    has_failed: bool,
    estimate: Option<Arc<LiveEstimate>>,
    poses: Vec<RobotSample>,
    welds: Option<Arc<LiveWelds>>,
    poses_of_welds: Vec<RobotSample>,
    last: Option<RobotSample>,
    inputs: InputWatch,
    answered: u32,
}

/// Purpose of a recording.
#[derive(Clone)]
pub struct RecordingSettings<'a> {
    /// Its folder; made if it is not there.
    pub folder: &'a Path,
    /// The text of the sensor's file, unchanged.
    pub sensor_toml: Option<String>,
    /// Name of the tool of the poses.
    pub tool: &'a str,
    /// Kind of the robot's stamps: [`ARRIVAL`] or [`READING`].
    pub robot: &'a str,
    /// The command that records.
    pub command: String,
    /// Source of the pictures and meaning of their stamps:
    /// [`CameraRecorder::stamp_meaning`](crate::CameraRecorder::stamp_meaning).
    pub camera: Option<String>,
    /// The live estimate, which is given every pose as well.
    pub estimate: Option<Arc<LiveEstimate>>,
    /// The watch, which divides them into welds.
    pub welds: Option<Arc<LiveWelds>>,
    /// Who hears of everything that is recorded.
    pub listener: Option<Arc<dyn CellListener>>,
}

/// Result of a recording.
pub struct FinishedRecording {
    /// The file.
    pub file: PathBuf,
    /// Whether it was removed again: nothing of the cell came that it could hold.
    pub is_removed: bool,
    /// The robot's stream.
    pub watch: StreamWatch,
    /// Why writing stopped, if it did.
    pub failure: Option<RecordError>,
    /// Entries that are missing because the disk was too slow.
    pub refused: u64,
    /// How often this PC's clock was set; the stamps go on evenly.
    pub clock_steps: u32,
    /// Datagrams that are not the robot's, beyond those kept byte for byte.
    pub rejected_not_kept: u64,
}

impl FinishedRecording {
    /// Whether all given data are in the file.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.failure.is_none() && self.refused == 0
    }

    /// Missing data, a sentence each.
    #[must_use]
    pub fn losses(&self) -> Vec<String> {
        match &self.failure {
            Some(error) => vec![format!("{error} ({})", error.hint())],
            None if self.refused > 0 => {
                vec![format!("the disk was too slow: {} entries are missing", self.refused)]
            }
            None => Vec::new(),
        }
    }

    /// Other events, a sentence each.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.is_removed {
            notes.push(format!("nothing arrived, so there is no {}", self.file.display()));
        }
        if self.clock_steps > 0 {
            notes.push(format!(
                "this PC's clock was set {} times; the stamps in the recording are not affected",
                self.clock_steps
            ));
        }
        if self.rejected_not_kept > 0 {
            notes.push(format!(
                "{} datagrams that could not be used were counted but not kept",
                self.rejected_not_kept
            ));
        }
        notes
    }
}

impl CellRecording {
    /// Begins a recording in a folder that has none.
    ///
    /// # Errors
    /// A folder or file that cannot be written, or a recording that already exists.
    pub fn create(settings: RecordingSettings<'_>, clock: HostClock) -> Result<Self, CellError> {
        let RecordingSettings {
            folder,
            sensor_toml,
            tool,
            robot,
            command,
            camera,
            estimate,
            welds,
            listener,
        } = settings;
        fs::create_dir_all(folder).map_err(|why| CellError::Folder { folder: folder.to_owned(), why })?;
        let file = folder.join(RECORDING);
        let robot = format!("robot: {robot}, by a steady clock; device: the controller's");
        let stamp_meaning =
            camera.map_or_else(|| robot.clone(), |camera| format!("{robot}. camera: {camera}"));
        let about = About { sensor_toml, stamp_meaning, command, tool: tool.to_owned() };
        let listener = listener.map(|listener| -> Arc<dyn Listener> { listener });
        let recorder = Recorder::create_heard(&file, &about, listener)?;
        Ok(Self {
            file,
            handle: recorder.handle(),
            recorder,
            watch: StreamWatch::default(),
            clock,
            steps: StepWatch::default(),
            clock_read_ns: i64::MIN,
            clock_steps: 0,
            rejected: 0,
            has_failed: false,
            estimate,
            poses: Vec::new(),
            welds,
            poses_of_welds: Vec::new(),
            last: None,
            inputs: InputWatch::default(),
            answered: 0,
        })
    }

    /// For others that record into the same file.
    #[must_use]
    pub fn handle(&self) -> RecorderHandle {
        self.handle.clone()
    }

    /// The robot's stream so far.
    #[must_use]
    pub fn watch(&self) -> &StreamWatch {
        &self.watch
    }

    /// The robot in short.
    #[must_use]
    pub fn brief(&self) -> RobotBrief {
        RobotBrief {
            link: self.watch.brief(),
            poses: self.watch.frames(),
            base_from_tool: self.last.map(|sample| sample.base_from_tool),
        }
    }

    /// Whether writing has stopped; checked once a second.
    #[must_use]
    pub(crate) fn has_failed(&self) -> bool {
        self.has_failed
    }

    /// An entry without room is counted there, and reported at the end; nothing here waits for a disk.
    fn keep(&self, entry: Entry) {
        let _counted = self.handle.offer(entry);
    }

    /// Keeps a packet.
    pub fn packet(&mut self, packet: &RobotPacket<'_>) {
        self.watch.note(packet);
        // Nothing is wrong with what the robot sends beside its poses, and some come of it (static transforms): it is kept however much
        // there is. What strangers send is bounded.
        let is_needless =
            packet.judged.is_err_and(|why| why.is_needless()) && self.watch.other.is_robot(packet.from);
        let sample = entries::robot_sample(packet);
        self.rejected += u64::from(sample.is_none() && !is_needless);
        self.last = sample.or(self.last);
        if let Some(change) = self.inputs.change(packet) {
            self.keep(Entry::Inputs(change));
        }
        let is_kept = sample.is_some() || is_needless || self.rejected <= MOST_REJECTED;
        if self.estimate.is_some() {
            self.poses.extend(sample);
        }
        if self.welds.is_some() {
            self.poses_of_welds.extend(sample);
        }
        if is_kept {
            self.keep(entries::packet(packet));
        }
    }

    /// Keeps an answer.
    pub fn answer(&mut self, answer: &Answer) {
        self.keep(entries::answer(answer));
    }

    /// Keeps the answers to a robot that waits for them.
    pub(crate) fn robot_answer(&mut self, answer: RobotAnswer) {
        self.answered = self.answered.wrapping_add(1);
        self.keep(entries::robot_answer(answer, self.answered));
    }

    /// Keeps some words.
    pub fn note(&self, level: NoteLevel, text: String) {
        let steady_ns = self.clock.read().steady_ns;
        self.keep(Entry::Note(NoteEntry { steady_ns, level, text }));
    }

    /// Looks at the clocks; cheap enough for every step.
    pub fn tick(&mut self) {
        if let Some(estimate) = &self.estimate {
            estimate.offer_poses(&mut self.poses);
        }
        if let Some(welds) = &self.welds {
            welds.offer_poses(&mut self.poses_of_welds);
        }
        let reading = self.clock.read();
        if let Some(step_ns) = self.steps.step_ns(reading) {
            self.clock_steps += 1;
            let text = format!("this PC's clock was set by {:+.3} s", step_ns as f64 * 1e-9);
            self.note(NoteLevel::Warning, text);
        } else if reading.steady_ns < self.clock_read_ns.saturating_add(CLOCK_EVERY_NS) {
            return;
        }
        self.clock_read_ns = reading.steady_ns;
        self.has_failed = self.handle.state().failure.is_some();
        self.keep(entries::clock(reading));
    }

    /// Ends the recording.
    #[must_use]
    pub fn finish(self) -> FinishedRecording {
        for (reason, count) in self.watch.egm.report().talkers.values().flat_map(|t| t.rejected.clone()) {
            self.note(NoteLevel::Info, format!("{count} datagrams not used: {reason}"));
        }
        let refused = self.handle.state().refused;
        let recorded = self.recorder.finish();
        let holds_nothing = recorded.as_ref().is_ok_and(|recorded| recorded.of_cell == 0);
        FinishedRecording {
            // The same command can then be tried again.
            is_removed: holds_nothing && fs::remove_file(&self.file).is_ok(),
            file: self.file,
            watch: self.watch,
            failure: recorded.err(),
            refused,
            clock_steps: self.clock_steps,
            rejected_not_kept: self.rejected.saturating_sub(MOST_REJECTED),
        }
    }
}
