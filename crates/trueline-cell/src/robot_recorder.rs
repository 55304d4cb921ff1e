//! Records a robot that its own program drives.

use crate::cell_recording::CellRecording;
use crate::robot_brief::RobotBrief;
use std::sync::Mutex;
use std::thread;
use std::time::{Duration, Instant};
use trueline_live::robot_source::SourceError;
use trueline_live::{RobotLink, RobotPacket, SequenceStatus};
use trueline_mcap::NoteLevel;

/// A robot that sends nothing for so long has ended its program.
const SILENCE: Duration = Duration::from_secs(5);
/// Longest wait for a packet, and between calls of a robot that went away.
const WAIT: Duration = Duration::from_millis(20);

/// When a recording ends.
pub struct Until<'a> {
    /// After so long; without it, when the robot has ended its program.
    pub longest: Option<Duration>,
    /// Returns true to stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

/// Records the messages of a link. A lost connection is made anew, and is a note in the recording. `shown` is the state to
/// display meanwhile. Returns why the robot cannot be recorded, if it cannot.
pub fn record_robot(
    link: &mut RobotLink,
    recording: &mut CellRecording,
    until: &Until<'_>,
    shown: &Mutex<RobotBrief>,
) -> Option<SourceError> {
    if link.prepare_to_answer() == Some(false) {
        let told = "no real-time priority was granted to the thread that answers the robot";
        recording.note(NoteLevel::Warning, told.to_owned());
    }
    let start = Instant::now();
    let (mut frames, mut changed, mut is_lost) = (0, start, false);
    while until.longest.is_none_or(|longest| start.elapsed() < longest)
        && !(until.stop)()
        && !recording.has_failed()
    {
        let received = link.receive(WAIT, &mut |packet| keep(packet, recording));
        link.take_answers().into_iter().for_each(|answer| recording.robot_answer(answer));
        recording.tick();
        let brief = recording.brief();
        let came = recording.watch().frames();
        if came > frames {
            (frames, changed, is_lost) = (came, Instant::now(), false);
        }
        // A display may hold it; then the next update will do.
        if let Ok(mut shown) = shown.try_lock() {
            *shown = brief;
        }
        match received {
            Ok(()) => {}
            Err(error @ SourceError::Refused { .. }) => return Some(error),
            Err(error) => {
                if !std::mem::replace(&mut is_lost, true) {
                    recording.note(NoteLevel::Warning, error.to_string());
                }
                thread::sleep(WAIT);
            }
        }
        if frames > 0 && until.longest.is_none() && changed.elapsed() > SILENCE {
            break;
        }
    }
    note_what_it_was(link, recording);
    None
}

fn keep(packet: &RobotPacket<'_>, recording: &mut CellRecording) {
    if packet.egm.is_none()
        && let Ok((_, SequenceStatus::First)) = packet.judged
    {
        recording.note(NoteLevel::Info, format!("the stream of {} begins", packet.from));
    }
    recording.packet(packet);
}

/// An ABB robot's own datagrams are in the recording. For other makes a note states the recorded protocol.
fn note_what_it_was(link: &RobotLink, recording: &CellRecording) {
    if let RobotLink::Other(source) = link {
        let about = source.about();
        let controller = about.controller.as_deref().unwrap_or("controller unknown");
        let mut text =
            format!("robot: {}, {controller}; poses: {}; clock: {}", about.protocol, about.pose, about.clock);
        for note in &about.notes {
            text.push_str("; ");
            text.push_str(note);
        }
        recording.note(NoteLevel::Info, text);
    }
}
