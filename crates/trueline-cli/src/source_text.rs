//! What was heard from a robot of any make, for people and for programs.

use crate::args::ProtocolName;
use serde_json::{Value, json};
use std::fmt::Write;
use trueline_live::link_watch::Timing;
use trueline_live::robot_source::SourceAbout;
use trueline_live::source_watch::SourceReport;

/// The stream in some lines.
pub fn text(report: &SourceReport, about: &SourceAbout) -> String {
    let mut out = String::new();
    if let Some((from, pose)) = &report.robot {
        let _ = writeln!(out, "Robot at {from}: {}", about.protocol);
        if let Some(controller) = &about.controller {
            let _ = writeln!(out, "  software {controller}");
        }
        timing_lines(&mut out, report);
        let share = 100.0 * report.lost as f64 / (report.frames + report.lost).max(1) as f64;
        let gap_ms = report.longest_gap_s * 1e3;
        let _ = writeln!(
            out,
            "  lost     {} ({share:.2} %); overtaken {}; longest silence {gap_ms:.0} ms",
            report.lost, report.late
        );
        let _ = writeln!(out, "  state    {}", pose.status);
        let p = pose.base_from_tool.translation.vector * 1e3;
        let _ = writeln!(out, "  pose     x {:.2}  y {:.2}  z {:.2} mm: {}", p.x, p.y, p.z, about.pose);
    }
    if report.sessions > 1 {
        let _ = writeln!(out, "  warning: the stream began {} times", report.sessions);
    }
    for note in &about.notes {
        let _ = writeln!(out, "  note: {}", plain(note));
    }
    if !report.unused.is_empty() {
        let _ = writeln!(out, "Not used");
    }
    for ((reason, from), count) in &report.unused {
        let _ = writeln!(out, "  {count:>7} from {from}: {reason}");
    }
    if report.unlisted > 0 {
        let _ = writeln!(out, "  {:>7} from further senders", report.unlisted);
    }
    out
}

/// Words of a controller are a stranger's: without control characters.
fn plain(words: &str) -> String {
    words.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

fn timing_lines(out: &mut String, report: &SourceReport) {
    let Some(Timing { rate_hz, period_s, delay_s, drift_ppm }) = report.timing else {
        let _ = writeln!(out, "  poses    {}: too few to tell their rate", report.frames);
        return;
    };
    let _ = writeln!(
        out,
        "  poses    {}, {rate_hz:.1} a second, every {:.3} ms by its clock",
        report.frames,
        period_s * 1e3
    );
    let [median, most, worst] = delay_s.map(|s| s * 1e3);
    let _ = writeln!(
        out,
        "  delay    median {median:.2} ms, 99 % {most:.2} ms, worst {worst:.2} ms above the quickest"
    );
    let _ = writeln!(out, "  clock    {drift_ppm:+.0} ppm against this PC's");
}

/// The same for programs.
pub fn json(report: &SourceReport, about: &SourceAbout) -> Value {
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
        "poses": report.frames,
        "lost": report.lost,
        "overtaken": report.late,
        "sessions": report.sessions,
        "longest_silence_s": report.longest_gap_s,
        "rate_hz": report.timing.map(|t| t.rate_hz),
        "period_s": report.timing.map(|t| t.period_s),
        "drift_ppm": report.timing.map(|t| t.drift_ppm),
        "not_used": unused,
        "notes": about.notes,
    })
}

/// What to look at if nothing came.
pub fn nothing(protocol: ProtocolName) -> &'static str {
    match protocol {
        ProtocolName::UrRtde => {
            "No robot was heard. From PolyScope 5.10 on RTDE is off until it is enabled under Settings, Security, Services.\n"
        }
        ProtocolName::FanucStreamMotion => {
            "No robot was heard. Stream Motion needs option J519 (with R912, or S636), and no other PC may listen to it.\n"
        }
        ProtocolName::FanucHspo => {
            "No robot was heard. High Speed Position Output is an option; its system variables name this PC's address and port.\n"
        }
        ProtocolName::KukaRsi => {
            "No robot was heard. RSI sends between RSI_ON and RSI_OFF, to IP_NUMBER and PORT of its Ethernet XML; ONLYSEND must be \
             TRUE and DEF_RIst in SEND.\n"
        }
        ProtocolName::Egm => "No robot was heard.\n",
    }
}
