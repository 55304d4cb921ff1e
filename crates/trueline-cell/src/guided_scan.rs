//! Guides a robot along a path and records it, with camera and estimate beside it.

use crate::cell::{Cell, CellOutcome, CellState};
use crate::cell_recording::CellRecording;
use crate::robot_brief::RobotBrief;
use std::fmt;
use std::io;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use trueline_camera::CameraError;
use trueline_live::guide::{Answer, Observer, Outcome};
use trueline_live::motion::{EndReason, GateState, OperatorCommand, Phase};
use trueline_live::{Guide, Received, ReplyTimes, priority};

/// How a scan is doing; its `Display` is half a line.
#[derive(Clone, Copy, Debug, Default)]
pub struct ScanState {
    /// The robot.
    pub robot: RobotBrief,
    /// Phase of the guidance.
    pub phase: Phase,
}

impl fmt::Display for ScanState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.phase, self.robot)
    }
}

/// A scan that is over.
pub struct EndedScan {
    /// How the guidance went.
    pub guidance: io::Result<Outcome>,
    /// Whether the operator requested its end.
    pub was_asked: bool,
    /// Delays of the answers.
    pub replies: ReplyTimes,
    /// The recording, still to be finished.
    pub recording: CellRecording,
    /// Whether the guiding thread had real-time priority.
    pub had_priority: bool,
    /// Why the camera ended early, if it did.
    pub camera: Result<(), CameraError>,
    /// The estimate panicked; the recording is not touched by that.
    pub estimate_panicked: bool,
}

/// Guides the robot while camera and estimate run. `command` returns the operator's command, before every step. A scan that
/// is not visible or not recorded any more is stopped as well. `observe` is called in this thread five times a second.
/// `None` if the guiding thread panicked: the controller then stops by its timeout.
pub fn guide_scan(
    cell: &mut Cell,
    mut guide: Guide,
    recording: CellRecording,
    command: impl Fn() -> OperatorCommand + Sync,
    mut observe: impl FnMut(&ScanState, &CellState),
) -> Option<EndedScan> {
    let shown = Mutex::new(ScanState::default());
    let (handle, unrecorded) = (recording.handle(), AtomicBool::new(false));
    let mut watching =
        Watching { recording, replies: ReplyTimes::default(), shown: &shown, unrecorded: &unrecorded };
    let outcome = cell.run(
        &handle,
        |blind| {
            let had_priority = priority::request_real_time();
            let mut was_asked = false;
            let guidance =
                guide.run(|| wanted(&command, [blind, &unrecorded], &mut was_asked), &mut watching);
            (guidance, was_asked, had_priority)
        },
        |state| observe(&shown.lock().map(|shown| *shown).unwrap_or_default(), state),
    );
    let CellOutcome { robot, camera, estimate_panicked } = outcome;
    let (guidance, was_asked, had_priority) = robot?;
    let Watching { recording, replies, .. } = watching;
    Some(EndedScan { guidance, was_asked, replies, recording, had_priority, camera, estimate_panicked })
}

fn wanted(
    command: &impl Fn() -> OperatorCommand,
    failures: [&AtomicBool; 2],
    was_asked: &mut bool,
) -> OperatorCommand {
    let asked = command();
    *was_asked |= asked != OperatorCommand::Go;
    match asked {
        OperatorCommand::Go if failures.iter().any(|failed| failed.load(Ordering::SeqCst)) => {
            OperatorCommand::Stop
        }
        asked => asked,
    }
}

struct Watching<'a> {
    recording: CellRecording,
    replies: ReplyTimes,
    shown: &'a Mutex<ScanState>,
    unrecorded: &'a AtomicBool,
}

impl Observer for Watching<'_> {
    fn received(&mut self, received: &Received<'_>) {
        self.recording.packet(&received.into());
    }

    fn answered(&mut self, answer: &Answer) {
        self.recording.answer(answer);
        if let Some(took_ns) = answer.since_frame_ns {
            self.replies.add(took_ns);
        }
    }

    fn stepped(&mut self, state: &GateState) {
        self.recording.tick();
        if self.recording.has_failed() {
            self.unrecorded.store(true, Ordering::SeqCst);
        }
        // Never waits for the display.
        if let Ok(mut shown) = self.shown.try_lock() {
            *shown = ScanState { robot: self.recording.brief(), phase: state.phase };
        }
    }
}

impl EndedScan {
    /// Whether the path was travelled and the camera saw it to its end (`is_seen`).
    #[must_use]
    pub fn is_well(&self, is_seen: bool) -> bool {
        let travelled =
            |outcome: &Outcome| outcome.end_reason == EndReason::Travelled && !outcome.observer_panicked;
        is_seen && self.guidance.as_ref().is_ok_and(travelled)
    }

    /// Why it ended, in a sentence. `is_seen`: the camera saw it to its end.
    #[must_use]
    pub fn end(&self, is_seen: bool) -> String {
        match &self.guidance {
            Ok(outcome) => self.end_of(outcome, is_seen),
            Err(error) => format!("the socket failed: {error}"),
        }
    }

    fn end_of(&self, outcome: &Outcome, is_seen: bool) -> String {
        let mut text = match outcome.end_reason {
            EndReason::Stopped if !self.was_asked && !is_seen => "stopped because the camera failed".to_owned(),
            EndReason::Stopped if !self.was_asked => "stopped because it is not recorded any more".to_owned(),
            EndReason::RobotSilent { .. } if outcome.was_converged => {
                "the controller ended the guidance: the robot was at its reference for \\CondTime (a slow path, or a rest on it; \
                 `trueline robot-program abb` writes a window that suits the path and its pace)"
                    .to_owned()
            }
            end_reason => end_reason.to_string(),
        };
        let counts = [
            (u64::from(outcome.pauses), "pauses because frames came late or not at all"),
            (u64::from(outcome.jumps), "frames not believed, the robot cannot have moved so far"),
            (outcome.unsent, "answers that could not be sent"),
        ];
        for (count, what) in counts.into_iter().filter(|(count, _)| *count > 0) {
            text.push_str(&format!("; {what}: {count}"));
        }
        if outcome.observer_panicked {
            text.push_str("; a part of this program beside the guiding loop failed");
        }
        text
    }
}
