//! Report on an ABB robot's stream, for people and for programs.

use crate::RobotFrame;
use crate::egm::{MciState, MotorState, RapidState};
use crate::link_watch::{Brief, LinkReport};
use crate::stream_counts::Timing;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt;
use std::net::SocketAddr;

/// The link in some lines.
impl fmt::Display for LinkReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some((from, frame)) = &self.robot {
            writeln!(f, "Robot at {from}: {}", frame.generation)?;
            robot_lines(f, self, frame)?;
        }
        let reasons = by_reason(self);
        if !reasons.is_empty() {
            writeln!(f, "Not used")?;
        }
        for (reason, (count, senders)) in reasons {
            let others = match senders.len() {
                1 => String::new(),
                more => format!(" and {} more senders", more - 1),
            };
            writeln!(f, "  {count:>7} from {}{others}: {reason}", senders[0])?;
        }
        match self.unlisted {
            0 => Ok(()),
            unlisted => writeln!(f, "  {unlisted:>7} from further senders"),
        }
    }
}

/// Datagrams that were not used and who sent them, by reason.
fn by_reason(report: &LinkReport) -> BTreeMap<&str, (u64, Vec<SocketAddr>)> {
    let mut reasons: BTreeMap<&str, (u64, Vec<SocketAddr>)> = BTreeMap::new();
    for (from, talker) in &report.talkers {
        for (reason, count) in &talker.rejected {
            let entry = reasons.entry(reason.as_str()).or_default();
            entry.0 += count;
            entry.1.push(*from);
        }
    }
    reasons
}

fn robot_lines(f: &mut fmt::Formatter<'_>, report: &LinkReport, frame: &RobotFrame) -> fmt::Result {
    let stream = &report.stream;
    timing_lines(f, "frames", stream.frames, stream.timing)?;
    let share = 100.0 * stream.lost_part();
    writeln!(
        f,
        "  lost     {} ({share:.2} %); overtaken {}, repeated {}; longest silence {:.0} ms",
        stream.lost,
        stream.late,
        report.repeated,
        stream.longest_gap_s * 1e3
    )?;
    writeln!(f, "  state    {}", state(frame))?;
    let p = frame.base_from_tool.translation.vector * 1e3;
    writeln!(f, "  tool     x {:.2}  y {:.2}  z {:.2} mm", p.x, p.y, p.z)?;
    warnings(report, frame).iter().try_for_each(|warning| writeln!(f, "  warning: {warning}"))
}

/// Rate and delays of a robot's stream.
pub(crate) fn timing_lines(
    f: &mut fmt::Formatter<'_>,
    what: &str,
    count: u64,
    timing: Option<Timing>,
) -> fmt::Result {
    let Some(Timing { rate_hz, period_s, delay_s, drift_ppm }) = timing else {
        return writeln!(f, "{what:<8} {count}: too few to estimate their rate");
    };
    let period_ms = period_s * 1e3;
    writeln!(f, "  {what:<8} {count}, {rate_hz:.1} a second, every {period_ms:.3} ms by its clock")?;
    let [median, most, worst] = delay_s.map(|s| s * 1e3);
    writeln!(
        f,
        "  delay    median {median:.2} ms, 99 % {most:.2} ms, worst {worst:.2} ms above the quickest"
    )?;
    writeln!(f, "  clock    {drift_ppm:+.0} ppm against this PC's")
}

/// The link in half a line.
impl fmt::Display for Brief {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some((_, frame)) = &self.robot else { return f.write_str("no robot yet") };
        let p = frame.base_from_tool.translation.vector * 1e3;
        let Self { frames, lost, .. } = self;
        write!(
            f,
            "{frames} frames, {lost} lost, x {:.1}  y {:.1}  z {:.1} mm; {}",
            p.x,
            p.y,
            p.z,
            state(frame)
        )
    }
}

/// The controller's states in words.
fn state(frame: &RobotFrame) -> String {
    let motors = match frame.motors {
        MotorState::On => "motors on",
        MotorState::Off => "motors OFF",
        MotorState::Undefined => "motors unknown",
    };
    let rapid = match frame.rapid {
        RapidState::Running => "RAPID running",
        RapidState::Stopped => "RAPID STOPPED",
        RapidState::Undefined => "RAPID unknown",
    };
    let mci = match frame.mci {
        MciState::Running => "guided by the PC",
        MciState::Stopped => "streaming only (not guided)",
        MciState::Error => "EGM in ERROR",
        MciState::Undefined => "guidance unknown",
    };
    let utilization = frame.utilization_percent.map(|u| format!(", {u:.0} % utilised")).unwrap_or_default();
    format!("{motors}, {rapid}, {mci}{utilization}")
}

/// Warnings for the user.
fn warnings(report: &LinkReport, frame: &RobotFrame) -> Vec<String> {
    let stream = &report.stream;
    let mut warnings = Vec::new();
    let mut warn = |when: bool, text: String| {
        if when {
            warnings.push(text);
        }
    };
    warn(
        stream.sessions > 1,
        format!("the stream began {} times: the controller was restarted, or fell silent", stream.sessions),
    );
    warn(
        report.contradictions > 0,
        format!(
            "in {} frames quaternion and Euler angles contradict each other; Euler angles count",
            report.contradictions
        ),
    );
    warn(
        report.dropped_by_kernel > 0,
        format!("this PC dropped {} datagrams: its receive buffer is full", report.dropped_by_kernel),
    );
    warn(
        report.without_kernel_stamp > 0,
        format!("{} datagrams have no stamp of the kernel, but of this program", report.without_kernel_stamp),
    );
    warn(
        frame.utilization_percent.is_some_and(|u| u > 90.0),
        "the robot is near its limits; above 100 % it cannot follow".to_owned(),
    );
    warn(frame.collided, "the controller has detected a collision".to_owned());
    warnings
}

/// The link as JSON.
pub(crate) fn json(report: &LinkReport) -> Value {
    let stream = &report.stream;
    let talkers: Vec<Value> = report
        .talkers
        .iter()
        .map(|(from, talker)| {
            json!({
                "address": from.to_string(),
                "datagrams": talker.datagrams,
                "accepted": talker.accepted,
                "rejected": talker.rejected,
            })
        })
        .collect();
    let robot = report.robot.as_ref().map(|(from, frame)| {
        let p = frame.base_from_tool.translation.vector * 1e3;
        let q = frame.base_from_tool.rotation.quaternion();
        json!({
            "address": from.to_string(),
            "robotware": frame.generation.to_string(),
            "frames": stream.frames,
            "lost": stream.lost,
            "overtaken": stream.late,
            "repeated": report.repeated,
            "sessions": stream.sessions,
            "longest_silence_s": stream.longest_gap_s,
            "rate_hz": stream.timing.map(|t| t.rate_hz),
            "period_s": stream.timing.map(|t| t.period_s),
            "delay_above_quickest_s": stream.timing.map(|t| json!({
                "median": t.delay_s[0], "p99": t.delay_s[1], "max": t.delay_s[2],
            })),
            "clock_drift_ppm": stream.timing.map(|t| t.drift_ppm),
            "state": state(frame),
            "position_mm": [p.x, p.y, p.z],
            "rotation_wxyz": [q.w, q.i, q.j, q.k],
            "warnings": warnings(report, frame),
        })
    });
    json!({ "robot": robot, "senders": talkers, "datagrams_dropped_by_this_pc": report.dropped_by_kernel })
}
