//! Report on the stream of a robot of another make than ABB, for people and for programs.

use crate::link_report::timing_lines;
use crate::robot_source::SourceAbout;
use crate::source_watch::SourceReport;
use serde_json::{Value, json};
use std::fmt;

/// The stream in some lines.
pub(crate) fn text(f: &mut fmt::Formatter<'_>, report: &SourceReport, about: &SourceAbout) -> fmt::Result {
    let stream = &report.stream;
    if let Some((from, pose)) = &report.robot {
        writeln!(f, "Robot at {from}: {}", about.protocol)?;
        if let Some(controller) = &about.controller {
            writeln!(f, "  software {controller}")?;
        }
        timing_lines(f, "poses", stream.frames, stream.timing)?;
        let share = 100.0 * stream.lost_part();
        let gap_ms = stream.longest_gap_s * 1e3;
        let (lost, late) = (stream.lost, stream.late);
        writeln!(f, "  lost     {lost} ({share:.2} %); overtaken {late}; longest silence {gap_ms:.0} ms")?;
        writeln!(f, "  state    {}", pose.status)?;
        let p = pose.base_from_tool.translation.vector * 1e3;
        writeln!(f, "  pose     x {:.2}  y {:.2}  z {:.2} mm: {}", p.x, p.y, p.z, about.pose)?;
    }
    if stream.sessions > 1 {
        writeln!(f, "  warning: the stream began {} times", stream.sessions)?;
    }
    about.notes.iter().try_for_each(|note| writeln!(f, "  note: {}", plain(note)))?;
    if !report.unused.is_empty() {
        writeln!(f, "Not used")?;
    }
    for ((reason, from), count) in &report.unused {
        writeln!(f, "  {count:>7} from {from}: {reason}")?;
    }
    match report.unlisted {
        0 => Ok(()),
        unlisted => writeln!(f, "  {unlisted:>7} from further senders"),
    }
}

/// Words of a controller are a stranger's: without control characters.
fn plain(words: &str) -> String {
    words.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

/// The same for programs.
pub(crate) fn json(report: &SourceReport, about: &SourceAbout) -> Value {
    let stream = &report.stream;
    let robot = report.robot.map(|(from, pose)| {
        let p = pose.base_from_tool.translation.vector * 1e3;
        let q = pose.base_from_tool.rotation.quaternion();
        json!({
            "address": from.to_string(),
            "position_mm": [p.x, p.y, p.z],
            "rotation_wxyz": [q.w, q.i, q.j, q.k],
            "status": pose.status.to_string(),
        })
    });
    let unused: Vec<Value> = report
        .unused
        .iter()
        .map(|((reason, from), count)| json!({ "reason": reason, "from": from.to_string(), "count": count }))
        .collect();
    json!({
        "protocol": about.protocol,
        "pose": about.pose.to_string(),
        "controller": about.controller,
        "robot": robot,
        "poses": stream.frames,
        "lost": stream.lost,
        "overtaken": stream.late,
        "sessions": stream.sessions,
        "longest_silence_s": stream.longest_gap_s,
        "rate_hz": stream.timing.map(|t| t.rate_hz),
        "period_s": stream.timing.map(|t| t.period_s),
        "drift_ppm": stream.timing.map(|t| t.drift_ppm),
        "not_used": unused,
        "notes": about.notes,
    })
}
