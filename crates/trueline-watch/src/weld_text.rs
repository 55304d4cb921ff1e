//! Report on a weld as text for the operator.

use crate::detect::sensor_axes::AXES;
use crate::detect::{Change, Link, SeamError};
use crate::headline::headline;
use crate::parameters::Kind;
use crate::store::ReceiverRow;
use crate::told::{State, Told};
use crate::weld_line::{HistoryOf, Learning, WeldLine};
use crate::words::{false_alarm, numbered, what_changed, where_to_look};
use std::cmp::Ordering;
use trueline_report::number::change_with_sigma;

/// Report on a weld.
#[must_use]
pub fn of(line: &WeldLine) -> String {
    let weld = numbered(line.number, &line.weld);
    if line.told_before.is_some() {
        let state = match line.state() {
            State::Alarm => "an alarm was active",
            State::WithinTolerance => "a change within the tolerance was active",
            State::Good => "no change was seen",
        };
        return format!("{weld}: already watched; {state}\n");
    }
    let mut text = history_text(line);
    text += &match (&line.alarm, line.event) {
        (None, event) => {
            let over = event.map(|_| over_text(line)).unwrap_or_default();
            format!("{weld}: {over}no change seen in {} seam points\n", line.used)
        }
        (Some(told), None) => standing_text(&weld, told),
        (Some(told), Some(_)) => alarm_text(&weld, told),
    };
    // During a change nothing is learnt.
    let learning = line.learning.filter(|_| line.alarm.is_none());
    let is_done = |learning: &Learning| learning.pieces >= learning.needed;
    text += &learning.filter(|l| line.blindness_is_news || is_done(l)).map(learning_text).unwrap_or_default();
    if line.blindness_is_news {
        text += &blindness_text(&line.blind_to);
    }
    if !line.stamps_treated_alike {
        text +=
            "  warning: this weld's stamps are too irregular to be smoothed like those of the calibration\n";
    }
    if line.sensor_file_differs == Some(true) && line.event.is_some() && line.is_alarm() {
        text += &format!("  warning: {OTHER_SENSOR}\n");
    }
    text
}

/// The history that begins or continues, if that is new.
fn history_text(line: &WeldLine) -> String {
    let own = &line.calibration;
    match &line.history {
        HistoryOf::Same | HistoryOf::New(None) => String::new(),
        HistoryOf::New(Some(before)) => format!(
            "A new history begins: {own} replaces {before} from weld {} on. Earlier welds are not compared \
            with it.\n",
            line.number
        ),
        HistoryOf::Resumed(before) => {
            format!("The history of {own} continues at weld {}, after welds with {before}.\n", line.number)
        }
    }
}

/// Effect of a difference between the sensor files.
pub const OTHER_SENSOR: &str = "sensor.toml differs from the file of the calibration: the difference appears \
                                as a change of the bracket or the sensor. Use one file for both";

/// Reason for the end of a change.
fn over_text(line: &WeldLine) -> String {
    match &line.good_since {
        Some((number, name)) => format!("The fault has been gone since {}; ", numbered(*number, name)),
        None => "The alarm is cleared, because later welds do not confirm it; ".to_owned(),
    }
}

fn learning_text(learning: Learning) -> String {
    let Learning { pieces, needed } = learning;
    match pieces.cmp(&needed) {
        Ordering::Less => {
            format!("  Learning the fixture: {pieces} of {needed} parts. No fixture alarms until then.\n")
        }
        Ordering::Equal => {
            format!("  Learnt the fixture from {pieces} parts. It is watched from the next part on.\n")
        }
        Ordering::Greater => {
            format!(
                "  Learning the fixture failed: its scatter over {pieces} parts is too large. No fixture \
                alarms.\n"
            )
        }
    }
}

fn blindness_text(blind_to: &[String]) -> String {
    if blind_to.is_empty() {
        return String::new();
    }
    // A part's place is the fixture's. No scan of an edge determines it.
    if blind_to.iter().all(|what| what == Kind::Seam.name()) {
        return "  blind to seam: these welds cannot detect a moved part\n".to_owned();
    }
    format!(
        "  blind to {}: welds like these cannot detect that change, however many. A 5 s scan over a fixed \
         edge detects timing, bracket and sensor: plan it with `trueline plan cell.toml --calibration RESULT \
         --duration-s 5 --out check-scan`, and watch it with its own --state{}\n",
        blind_to.join(", "),
        advice(blind_to)
    )
}

/// Advice for the weld program. Seams that are welded at one attitude to themselves determine the same two numbers, and a weave
/// determines the time offset.
fn advice(blind_to: &[String]) -> &'static str {
    let is_blind = |kind: Kind| blind_to.iter().any(|what| what.starts_with(kind.name()));
    match (is_blind(Kind::Timing), is_blind(Kind::Bracket)) {
        (true, _) => ". A weave detects timing",
        (false, true) => {
            ". Welds detect more of the bracket if one seam of the part is welded with 10° more push angle"
        }
        (false, false) => "",
    }
}

/// A change that was reported in full at an earlier weld.
fn standing_text(weld: &str, told: &Told) -> String {
    let word = if told.is_within { "changed within the tolerance" } else { "alarm" };
    format!("{weld}: {word}: {}\n", headline(told))
}

fn alarm_text(weld: &str, told: &Told) -> String {
    let Told { alarm, seam_error, .. } = told;
    let kind = alarm.change.kind;
    let (cause, check) = if told.is_of_axis() { OF_AXIS } else { (what_changed(kind), where_to_look(kind)) };
    let word = if told.is_within { "CHANGED WITHIN THE TOLERANCE" } else { "ALARM" };
    let mut text = format!("{weld}: {word}: {}\n", headline(told));
    if told.was_claimed {
        text += "  The repair reported before this weld did not clear it.\n";
    }
    text += &format!("  cause: {cause}\n  check: {check}\n");
    let moved = (kind != Kind::Seam).then(|| seam_error_text(seam_error));
    for part in moved.into_iter().chain(numbers(&alarm.change)) {
        text += &format!("  {part}\n");
    }
    text += &format!("  false-alarm probability: {}\n", false_alarm(alarm.change.p_log10));
    if alarm.links.contains(&Link::Axis) {
        text += &axis_text(told);
    }
    if !alarm.not_told_apart.is_empty() {
        let others: Vec<&str> = alarm.not_told_apart.iter().map(|kind| noun(*kind)).collect();
        text += &format!(
            "  it may also be the {}: these welds cannot separate them, a 5 s scan over a fixed edge can\n",
            others.join(" or the ")
        );
    }
    text + "  after a repair: `trueline watch --repaired`; after a new calibration: --calibration with its \
        file\n"
}

/// Cause and remedy of a moved axis.
const OF_AXIS: (&str, &str) = (
    "the axis that carries the part has moved",
    "the foot and the bearing of the axis, and the zero of its encoder; then calibrate it again",
);

/// The links that may have moved, the axis among them.
fn axis_text(told: &Told) -> String {
    let links = told.links().join(" or ");
    if told.is_of_axis() {
        return format!("  link: {links}. The parts are displaced in base, and not on the axis\n");
    }
    format!(
        "  link: {links}. More welds, at three or more angles of the axis, can separate fixture and axis\n"
    )
}

/// Warning about a receiver that did not receive alarms.
#[must_use]
pub fn not_told(receiver: &ReceiverRow) -> String {
    format!(
        "warning: {} has not received {} alarm {} ({}). They are kept; the next program with the same --state \
         and --tell sends them",
        receiver.name,
        receiver.waiting,
        if receiver.waiting == 1 { "message" } else { "messages" },
        receiver.error.as_deref().unwrap_or("not sent yet")
    )
}

/// Displacement of seam points by a change.
fn seam_error_text(error: &SeamError) -> String {
    let one = |(name, axis): (&&str, &Option<[f64; 2]>)| match axis {
        Some([value, sigma]) => format!("{name} {}", change_with_sigma(value * 1e3, sigma * 1e3, "mm")),
        None => format!("{name} cannot be determined"),
    };
    let all: Vec<String> = AXES.iter().zip(&error.by_axis).map(one).collect();
    format!("seam points move (along the stripe, along the seam, in depth): {}", all.join(", "))
}

fn noun(kind: Kind) -> &'static str {
    match kind {
        Kind::Timing => "time offset",
        Kind::Bracket => "bracket",
        Kind::Sensor => "sensor",
        Kind::Seam => "fixture",
    }
}

/// Every number with its ±.
fn numbers(change: &Change) -> Vec<String> {
    let one = |k: usize, factor: f64, unit: &str| match (change.value[k], change.sigma[k]) {
        (Some(value), Some(sigma)) => change_with_sigma(value * factor, sigma * factor, unit),
        _ => "cannot be determined".to_owned(),
    };
    let is_shown = |first: usize| (first..first + 3).any(|k| change.value[k].is_some());
    let three = |first: usize, factor: f64, unit: &str| {
        if !is_shown(first) {
            return "cannot be determined alone from these welds".to_owned();
        }
        ["x", "y", "z"]
            .iter()
            .enumerate()
            .map(|(k, axis)| format!("{axis} {}", one(first + k, factor, unit)))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let degrees = 1f64.to_degrees();
    match change.kind {
        Kind::Timing => vec![format!("time offset {}", one(0, 1e3, "ms"))],
        Kind::Bracket => vec![
            format!("shift (tool axes): {}", three(3, 1e3, "mm")),
            format!("turn (tool axes): {}", three(0, degrees, "°")),
        ],
        Kind::Seam => vec![
            format!("shift (base axes): {}", three(0, 1e3, "mm")),
            format!("turn (base axes): {}", three(3, degrees, "°")),
        ],
        Kind::Sensor => ["widths", "depths", "shear"]
            .iter()
            .enumerate()
            .map(|(k, name)| format!("{name} {}", one(k, 100.0, "%")))
            .chain((3..5).map(|k| format!("keystone {} {}", k - 2, one(k, 1e-1, "% per mm"))))
            .collect(),
    }
}
