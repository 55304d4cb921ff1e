//! A cell that is recorded, in words: camera, estimate, recording.

use std::fmt::Write;
use trueline_cell::{CameraCounts, CellState, Estimated, FinishedRecording, Progress};

/// The camera in half a line.
pub fn camera(counts: &CameraCounts) -> String {
    let CameraCounts { frames, unusable, missing, seams, .. } = counts;
    format!("{frames} pictures, {missing} missing, {unusable} incomplete, the seam found in {seams}")
}

/// What of the camera is missing or doubtful.
pub fn losses(counts: &CameraCounts) -> Vec<String> {
    let mut words = Vec::new();
    if counts.lost() > 0 {
        words.push(format!(
            "{} of {} pictures did not arrive or are incomplete: a lower frame rate, larger packets (jumbo frames) or a larger \
             receive buffer (net.core.rmem_max) may help",
            counts.lost(),
            counts.taken()
        ));
    }
    if counts.interruptions > 0 {
        words.push(format!(
            "the camera went away {} times and was waited for; the pictures of that time are missing",
            counts.interruptions
        ));
    }
    if counts.clock_set > 0 {
        words.push(format!(
            "the camera's clock was set {} times; with --stamp exposure the pictures around those moments may have wrong \
             stamps",
            counts.clock_set
        ));
    }
    words
}

/// The estimate in one line.
pub fn estimate(progress: &Progress) -> String {
    match progress {
        Progress::Waiting { seam_points, needed } => {
            format!("{seam_points} of {needed} seam points needed for a first estimate")
        }
        Progress::Refused { seam_points, why } => format!("{seam_points} seam points; {why}"),
        Progress::Estimated(estimated) => estimated_line(estimated),
    }
}

fn estimated_line(estimated: &Estimated) -> String {
    let mut line = match estimated.time_offset_s {
        Some([offset_s, sigma_s]) => {
            format!("time offset {:+.2} ± {:.2} ms", offset_s * 1e3, sigma_s * 1e3)
        }
        None => "time offset not determined yet".to_owned(),
    };
    let _ = match (estimated.translation_sigma_m, estimated.rotation_sigma_rad) {
        (Some(m), Some(rad)) => write!(line, ", hand-eye ± {:.2} mm ± {:.3}°", m * 1e3, rad.to_degrees()),
        _ => write!(line, ", hand-eye not fully determined yet"),
    };
    let _ = write!(line, ", {} seam points", estimated.seam_points);
    match estimated.is_enough {
        Some(true) => line.push_str(": ENOUGH"),
        Some(false) => line.push_str(": not yet what --want asks for"),
        None => {}
    }
    line
}

/// What cannot be determined yet, and the motion that would help.
pub fn advice(progress: &Progress) -> &[String] {
    match progress {
        Progress::Estimated(estimated) => &estimated.advice,
        Progress::Waiting { .. } | Progress::Refused { .. } => &[],
    }
}

/// What camera and estimate came to, in some lines.
pub fn lines(state: &CellState) -> Vec<String> {
    let mut lines = Vec::new();
    lines.extend(state.camera.as_ref().map(|counts| format!("camera: {}", camera(counts))));
    if let Some(progress) = &state.estimate {
        lines.push(format!("estimate: {}", estimate(progress)));
        lines.extend(advice(progress).iter().map(|advice| format!("not determined: {advice}")));
    }
    lines
}

/// What is missing in a recording.
pub fn recording_losses(finished: &FinishedRecording) -> Vec<String> {
    match &finished.failure {
        Some(error) => vec![format!("{error} ({})", error.hint())],
        None if finished.refused > 0 => {
            vec![format!("the disk was too slow: {} entries are missing", finished.refused)]
        }
        None => Vec::new(),
    }
}

/// What else happened during a recording.
pub fn recording_notes(finished: &FinishedRecording) -> Vec<String> {
    let mut notes = Vec::new();
    if finished.clock_steps > 0 {
        notes.push(format!(
            "this PC's clock was set {} times; the stamps in the recording are not affected",
            finished.clock_steps
        ));
    }
    if finished.rejected_not_kept > 0 {
        notes.push(format!(
            "{} datagrams that are not from the robot were counted but not kept",
            finished.rejected_not_kept
        ));
    }
    notes
}
