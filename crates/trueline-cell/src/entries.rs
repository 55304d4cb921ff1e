//! Events of a cell as entries of a recording: all that another recorder needs to write the same file.

use crate::camera_clock::Exchange;
use trueline_camera::{CameraFrame, FrameStatus, LatchSample};
use trueline_dataset::{RobotSample, gray_png};
use trueline_live::guide::Answer;
use trueline_live::host_clock::Reading;
use trueline_live::{RobotAnswer, RobotPacket, RobotPose};
use trueline_mcap::{
    AnswerEntry, COMPLETE, ClockEntry, Entry, FrameEntry, NoteEntry, NoteLevel, ProfileEntry, RejectedEntry,
    RobotEntry,
};

/// A packet of a robot, used or not.
#[must_use]
pub fn packet(packet: &RobotPacket<'_>) -> Entry {
    let RobotPacket { bytes, from, arrival, judged, egm } = *packet;
    let (datagram, steady_ns) = (bytes.to_vec(), arrival.steady_ns);
    match judged {
        Ok((pose, _)) => Entry::Robot(RobotEntry {
            is_egm: egm.is_some(),
            datagram,
            from,
            steady_ns,
            kernel_wall_ns: arrival.kernel_wall_ns,
            read_wall_ns: arrival.read.wall_ns,
            sequence: pose.sequence,
            device_ns: pose.device_ns,
            ptp_ns: egm.and_then(|received| received.judged.ok()).and_then(|(frame, _)| frame.ptp_ns),
            base_from_tool: pose.base_from_tool,
        }),
        Err(reason) => {
            Entry::Rejected(RejectedEntry { datagram, from, steady_ns, reason: reason.to_string() })
        }
    }
}

/// A good packet of a robot as a sample of a recording, stamped by its arrival.
#[must_use]
pub(crate) fn robot_sample(packet: &RobotPacket<'_>) -> Option<RobotSample> {
    let (RobotPose { device_ns, base_from_tool, .. }, _) = packet.judged.ok()?;
    Some(RobotSample { stamp_ns: packet.arrival.steady_ns, device_ns: Some(device_ns), base_from_tool })
}

/// An answer to the robot.
#[must_use]
pub fn answer(answer: &Answer) -> Entry {
    Entry::Answer(AnswerEntry {
        datagram: answer.bytes.clone(),
        to: answer.to,
        steady_ns: answer.steady_ns,
        sequence: answer.sequence,
    })
}

/// An answer to a robot that waits for answers.
#[must_use]
pub fn robot_answer(answer: RobotAnswer, number: u32) -> Entry {
    let RobotAnswer { bytes: datagram, to, steady_ns } = answer;
    Entry::Answer(AnswerEntry { datagram, to, steady_ns, sequence: number })
}

/// A reading of both clocks of this PC.
#[must_use]
pub fn clock(reading: Reading) -> Entry {
    Entry::Clock(ClockEntry { steady_ns: reading.steady_ns, wall_ns: reading.wall_ns })
}

/// A picture under the stamp that calibration uses; the entry has no picture if it did not come whole or cannot be encoded.
#[must_use]
pub fn frame(frame: &CameraFrame, stamp_ns: i64) -> FrameEntry {
    let (png, status) = match frame.image.as_ref().map(gray_png::encode_gray) {
        Some(Ok(png)) => (png, status(&frame.status)),
        Some(Err(error)) => (Vec::new(), format!("not encoded: {error}")),
        None => (Vec::new(), status(&frame.status)),
    };
    FrameEntry {
        frame: frame.frame,
        stamp_ns,
        first_packet_ns: frame.first_packet_ns,
        complete_ns: Some(frame.complete_ns),
        device_ns: frame.device_ns,
        exposure_us: frame.exposure_us,
        signals: frame.signals,
        status,
        png,
    }
}

/// The profiles of a frame under the stamp that calibration uses. `is_of_last`: that is the last profile's, because it was made when the
/// frame came; else the first one's.
pub fn profiles(frame: &CameraFrame, stamp_ns: i64, is_of_last: bool) -> impl Iterator<Item = ProfileEntry> {
    let rows = frame.profiles.len() as u64;
    let stamped_ns = match frame.profiles.last() {
        Some(last) if is_of_last => last.after_first_ns,
        _ => 0,
    };
    frame.profiles.iter().zip(0..).map(move |(profile, row)| ProfileEntry {
        profile: frame.frame * rows + row,
        stamp_ns: stamp_ns + profile.after_first_ns - stamped_ns,
        columns: profile.columns.clone(),
    })
}

/// A reading of the camera's clock: every one is kept, so that another map can be made.
#[must_use]
pub fn exchange(exchange: &Exchange) -> Entry {
    let LatchSample { before_ns, device_ns, after_ns } = exchange.sample;
    let (level, told) = match exchange.was_set {
        true => (NoteLevel::Warning, "the camera's clock was set. "),
        false => (NoteLevel::Info, ""),
    };
    let text = format!("{told}latch: before_ns {before_ns}, device_ns {device_ns}, after_ns {after_ns}");
    Entry::Note(NoteEntry { steady_ns: after_ns, level, text })
}

fn status(status: &FrameStatus) -> String {
    match status {
        FrameStatus::Complete => COMPLETE.to_owned(),
        FrameStatus::Incomplete { missing } => format!("{missing} packets missing"),
        FrameStatus::WrongSize { width, height } => format!("of another size: {width} x {height} px"),
        FrameStatus::WrongFormat { found } => format!("of another format: {found}"),
    }
}
