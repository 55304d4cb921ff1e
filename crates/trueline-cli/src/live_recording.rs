//! What is heard and said live, into `recording.mcap`.

use crate::failure::Failure;
use crate::live_estimate::LiveEstimate;
use crate::planned_scan::read_text;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use trueline_dataset::RobotSample;
use trueline_live::guide::Answer;
use trueline_live::host_clock::{Reading, StepWatch};
use trueline_live::{Heard, HostClock, LinkWatch};
use trueline_mcap::{
    About, AnswerEntry, ClockEntry, Entry, NoteEntry, NoteLevel, Recorder, RecorderHandle, RejectedEntry,
    RobotEntry,
};

/// Name of the recording in its folder.
pub const RECORDING: &str = "recording.mcap";

/// Foreign datagrams that are kept byte for byte; more are counted.
const MOST_REJECTED: u64 = 1000;
/// Between readings of both clocks, ns.
const CLOCK_EVERY_NS: i64 = 1_000_000_000;

/// A recording that is under way.
pub struct LiveRecording {
    file: PathBuf,
    recorder: Recorder,
    handle: RecorderHandle,
    watch: LinkWatch,
    clock: HostClock,
    steps: StepWatch,
    clock_read_ns: i64,
    clock_steps: u32,
    rejected: u64,
    failed: bool,
    estimate: Option<Arc<LiveEstimate>>,
    poses: Vec<RobotSample>,
}

/// What a recording is made for.
pub struct Purpose<'a> {
    /// Its folder.
    pub out: &'a Path,
    /// The sensor's file, kept as it is.
    pub sensor: Option<&'a Path>,
    /// Name of the tool whose poses come.
    pub tool: &'a str,
    /// What gives pictures and what their stamps are, in words.
    pub camera: Option<String>,
    /// Who wants to have the poses as well.
    pub estimate: Option<Arc<LiveEstimate>>,
}

/// What became of it.
pub struct Finished {
    /// The file.
    pub file: PathBuf,
    /// The link.
    pub watch: LinkWatch,
    /// What is missing, in words.
    pub losses: Vec<String>,
    /// What happened besides.
    pub notes: Vec<String>,
}

impl LiveRecording {
    /// Begins a recording in a folder that has none.
    pub fn create(purpose: Purpose<'_>, clock: HostClock) -> Result<Self, Failure> {
        let Purpose { out, sensor, tool, camera, estimate } = purpose;
        std::fs::create_dir_all(out).map_err(|error| Failure::cannot_write(out, &error))?;
        let file = out.join(RECORDING);
        let robot = "robot: arrival at this PC (kernel), by a steady clock; device: the controller's";
        let about = About {
            sensor_toml: sensor.map(read_text).transpose()?,
            stamp_meaning: camera
                .map_or_else(|| robot.to_owned(), |camera| format!("{robot}. camera: {camera}")),
            command: crate::output::command_line(),
            tool: tool.to_owned(),
        };
        let recorder = Recorder::create(&file, &about)?;
        Ok(Self {
            file,
            handle: recorder.handle(),
            recorder,
            watch: LinkWatch::default(),
            clock,
            steps: StepWatch::default(),
            clock_read_ns: i64::MIN,
            clock_steps: 0,
            rejected: 0,
            failed: false,
            estimate,
            poses: Vec::new(),
        })
    }

    /// For others that record into the same file.
    pub fn handle(&self) -> RecorderHandle {
        self.handle.clone()
    }

    /// What finds no room is counted there, and told at the end; nothing here waits for a disk.
    fn keep(&self, entry: Entry) {
        let _counted = self.handle.offer(entry);
    }

    /// The link so far.
    pub fn watch(&self) -> &LinkWatch {
        &self.watch
    }

    /// Whether writing has stopped; looked at once a second.
    pub fn has_failed(&self) -> bool {
        self.failed
    }

    /// Keeps a datagram.
    pub fn heard(&mut self, heard: &Heard<'_>) {
        self.watch.note(heard);
        let datagram = &heard.datagram;
        let bytes = datagram.bytes.to_vec();
        let steady_ns = datagram.arrival.steady_ns;
        match heard.judged {
            Ok((frame, _)) => {
                self.keep(Entry::Robot(RobotEntry {
                    datagram: bytes,
                    from: datagram.from,
                    steady_ns,
                    kernel_wall_ns: datagram.arrival.kernel_wall_ns,
                    read_wall_ns: datagram.arrival.read.wall_ns,
                    sequence: frame.sequence,
                    device_ns: frame.device_ns,
                    ptp_ns: frame.ptp_ns,
                    base_from_tool: frame.base_from_tool,
                }));
                if self.estimate.is_some() {
                    let device_ns = Some(frame.device_ns);
                    let base_from_tool = frame.base_from_tool;
                    self.poses.push(RobotSample { stamp_ns: steady_ns, device_ns, base_from_tool });
                }
            }
            Err(reason) => {
                self.rejected += 1;
                if self.rejected <= MOST_REJECTED {
                    let reason = reason.to_string();
                    let entry = RejectedEntry { datagram: bytes, from: datagram.from, steady_ns, reason };
                    self.keep(Entry::Rejected(entry));
                }
            }
        }
    }

    /// Keeps an answer.
    pub fn answered(&mut self, answer: &Answer) {
        self.keep(Entry::Answer(AnswerEntry {
            datagram: answer.bytes.clone(),
            to: answer.to,
            steady_ns: answer.steady_ns,
            sequence: answer.sequence,
        }));
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
        let Reading { steady_ns, wall_ns } = self.clock.read();
        if let Some(step_ns) = self.steps.step_ns(Reading { steady_ns, wall_ns }) {
            self.clock_steps += 1;
            let text = format!("this PC's clock was set by {:+.3} s", step_ns as f64 * 1e-9);
            self.note(NoteLevel::Warning, text);
        } else if steady_ns < self.clock_read_ns.saturating_add(CLOCK_EVERY_NS) {
            return;
        }
        self.clock_read_ns = steady_ns;
        self.failed = self.handle.state().failure.is_some();
        self.keep(Entry::Clock(ClockEntry { steady_ns, wall_ns }));
    }

    /// Ends the recording.
    pub fn finish(self) -> Finished {
        for (reason, count) in self.watch.report().talkers.values().flat_map(|t| t.rejected.clone()) {
            self.note(NoteLevel::Info, format!("{count} datagrams not used: {reason}"));
        }
        let (mut losses, mut notes) = (Vec::new(), Vec::new());
        if self.clock_steps > 0 {
            notes.push(format!(
                "this PC's clock was set {} times; the recording's stamps go on evenly",
                self.clock_steps
            ));
        }
        if self.rejected > MOST_REJECTED {
            notes.push(format!(
                "{} datagrams that are not the robot's were counted only",
                self.rejected - MOST_REJECTED
            ));
        }
        let refused = self.handle.state().refused;
        match self.recorder.finish() {
            Ok(_) if refused > 0 => {
                losses.push(format!("the disk was too slow: {refused} entries are missing"));
            }
            Ok(_) => {}
            Err(error) => losses.push(format!("{error} ({})", error.hint())),
        }
        Finished { file: self.file, watch: self.watch, losses, notes }
    }
}

impl Finished {
    /// Says what is missing, and what happened besides.
    pub fn tell(&self, quiet: bool) {
        for loss in &self.losses {
            crate::output::words(&format!("warning: {loss}"));
        }
        for note in self.notes.iter().filter(|_| !quiet) {
            crate::output::words(&format!("note: {note}"));
        }
    }
}

impl From<trueline_mcap::RecordError> for Failure {
    fn from(error: trueline_mcap::RecordError) -> Self {
        Self::new(error.to_string(), error.hint())
    }
}
