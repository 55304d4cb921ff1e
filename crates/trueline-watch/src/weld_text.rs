//! What is told of a weld, for the person who welds.

use crate::detect::Change;
use crate::detect::sensor_axes::AXES;
use crate::parameters::Kind;
use crate::store::ReceiverRow;
use crate::weld_line::{HistoryOf, Learning, Told, WeldLine};
use std::cmp::Ordering;

/// What is told of a weld.
#[must_use]
pub fn of(line: &WeldLine) -> String {
    let weld = numbered(line.number, &line.weld);
    if line.told_before.is_some() {
        let state = if line.is_alarm() { "an alarm stood" } else { "no change was seen" };
        return format!("{weld}: watched before; {state}; blind to: {}\n", hidden(&line.blind_to));
    }
    let mut text = history_text(line);
    text += &match (&line.alarm, line.event) {
        (None, event) => {
            let over = if event.is_some() { "the alarm is over; " } else { "" };
            let points = line.used;
            format!(
                "{weld}: {over}no change seen in {points} seam points; blind to: {}\n",
                hidden(&line.blind_to)
            )
        }
        (Some(told), None) => standing_text(&weld, told),
        (Some(told), Some(_)) => alarm_text(&weld, told),
    };
    // While an alarm stands nothing is learnt.
    let learns = line.alarm.is_none() || line.event.is_some();
    text += &line.learning.filter(|_| learns).map(learning_text).unwrap_or_default();
    if line.blindness_is_news {
        text += &blindness_text(&line.blind_to);
    }
    if !line.stamps_treated_alike {
        text +=
            "  warning: this weld's stamps are too uneven to be treated as those of the calibration were\n";
    }
    if line.sensor_file_differs == Some(true) && line.event.is_some() && line.is_alarm() {
        text += &format!("  warning: {OTHER_SENSOR}\n");
    }
    text
}

/// Which history begins or goes on, where that is news.
fn history_text(line: &WeldLine) -> String {
    let own = &line.calibration;
    match &line.history {
        HistoryOf::Same | HistoryOf::New(None) => String::new(),
        HistoryOf::New(Some(before)) => format!(
            "A new history begins: {own} is in use from weld {} on, after {before}. Earlier welds are not compared with it.\n",
            line.number
        ),
        HistoryOf::Resumed(before) => {
            format!("The history of {own} goes on at weld {}, after welds with {before}.\n", line.number)
        }
    }
}

/// What a difference between the files of the sensor does.
pub const OTHER_SENSOR: &str = "sensor.toml is not the file that the calibration was made with: where the two differ, welds look \
                                as if the bracket or the sensor had changed";

/// A weld by its number and name.
#[must_use]
pub fn numbered(number: i64, name: &str) -> String {
    format!("weld {number} ({name})")
}

/// What welds would not show, in words.
#[must_use]
pub fn hidden(blind_to: &[String]) -> String {
    if blind_to.is_empty() { "nothing".to_owned() } else { blind_to.join(", ") }
}

fn learning_text(learning: Learning) -> String {
    let Learning { pieces, needed } = learning;
    match pieces.cmp(&needed) {
        Ordering::Less => format!(
            "  the fixture is being learnt: {pieces} of {needed} pieces; until then a part that lies elsewhere raises no alarm\n"
        ),
        Ordering::Equal => {
            format!(
                "  the fixture has been learnt from {pieces} pieces; from the next one on it is watched\n"
            )
        }
        Ordering::Greater => {
            format!(
                "  the fixture could not be learnt from {pieces} pieces; a part that lies elsewhere raises no alarm\n"
            )
        }
    }
}

fn blindness_text(blind_to: &[String]) -> String {
    if blind_to.is_empty() {
        return String::new();
    }
    // Where a part lies is the fixture's, and no scan of an edge shows it.
    if blind_to.iter().all(|what| what == Kind::Seam.name()) {
        return "  seam: these welds would not show where the part lies\n".to_owned();
    }
    format!(
        "  blind to {}: welds like these would not show that, however many; a scan of 5 s over a fixed edge shows timing, bracket and \
         sensor: `trueline plan cell.toml --calibration RESULT --duration-s 5 --out check-scan`, to be watched with a --state of its own\n",
        blind_to.join(", ")
    )
}

fn since_text(told: &Told) -> String {
    let since = numbered(told.since_number, &told.since);
    match told.alarm.since.inside_s {
        Some(at_s) => format!("since {at_s:.1} s into {since}"),
        None => format!("since {since}"),
    }
}

/// An alarm that was told in full at an earlier weld.
fn standing_text(weld: &str, told: &Told) -> String {
    let change = &told.alarm.change;
    let amount =
        told.seam_point.iter().map(seam_point_text).chain(numbers(change)).next().unwrap_or_default();
    format!("{weld}: {} {}: {amount}\n", what_changed(change.kind), since_text(told))
}

fn alarm_text(weld: &str, told: &Told) -> String {
    let Told { alarm, seam_point, .. } = told;
    let (what, when) = (what_changed(alarm.change.kind), since_text(told));
    let mut text =
        format!("{weld}: ALARM: {what}, {when}\n  look at: {}\n", where_to_look(alarm.change.kind));
    for part in seam_point.iter().map(seam_point_text).chain(numbers(&alarm.change)) {
        text += &format!("  {part}\n");
    }
    text += &format!("  without a change this comes {}\n", how_rarely(alarm.change.p_log10));
    if !alarm.not_told_apart.is_empty() {
        let others: Vec<&str> = alarm.not_told_apart.iter().map(|kind| noun(*kind)).collect();
        text += &format!(
            "  it may also be the {}: these welds do not tell them apart; a scan of 5 s over a fixed edge does\n",
            others.join(" or the ")
        );
    }
    if alarm.change.kind != Kind::Seam {
        text += "  repair it or calibrate again: `trueline calibrate`\n";
    }
    text
}

/// What is told of a receiver that could not be told of alarms.
#[must_use]
pub fn not_told(receiver: &ReceiverRow) -> String {
    format!(
        "warning: {} has not been told {} messages about alarms ({}); they are kept, and told by the next program with the same \
         --state and --tell",
        receiver.name,
        receiver.waiting,
        receiver.error.as_deref().unwrap_or("no try yet")
    )
}

/// How far a bracket has moved a seam point.
fn seam_point_text(moved: &[Option<[f64; 2]>; 3]) -> String {
    let one = |(name, axis): (&&str, &Option<[f64; 2]>)| match axis {
        Some([value, sigma]) => format!("{name} {:+.3} ± {:.3} mm", value * 1e3, sigma * 1e3),
        None => format!("{name} not shown"),
    };
    let all: Vec<String> = AXES.iter().zip(moved).map(one).collect();
    format!("a seam point moves with it (along the stripe, along the seam, in depth): {}", all.join(", "))
}

/// What has changed.
#[must_use]
pub fn what_changed(kind: Kind) -> &'static str {
    match kind {
        Kind::Timing => "the camera's time offset has changed",
        Kind::Bracket => "the sensor has moved on the robot",
        Kind::Sensor => "the sensor itself has changed",
        Kind::Seam => "the part lies elsewhere",
    }
}

/// Where to look then.
#[must_use]
pub fn where_to_look(kind: Kind) -> &'static str {
    match kind {
        Kind::Timing => "exposure, driver, network, and who set a clock",
        Kind::Bracket => {
            "the sensor's bracket, the torch or tool, and the sensor's camera and laser, for one that has shifted inside looks the same"
        }
        Kind::Sensor => "the sensor's window, camera and laser, and its temperature",
        Kind::Seam => "the fixture; the calibration is still good",
    }
}

/// Beyond this log₁₀ the tail of the distribution is a figure of the model, and not of any cell.
const RAREST_LOG10: f64 = -12.0;

/// A probability in words.
#[must_use]
pub fn how_rarely(p_log10: f64) -> String {
    if p_log10 < RAREST_LOG10 {
        return format!("less than once in {:.0e} welds", 10f64.powf(-RAREST_LOG10));
    }
    format!("once in {:.0e} welds", 10f64.powf(-p_log10))
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
        (Some(value), Some(sigma)) => format!("{:+.3} ± {:.3} {unit}", value * factor, sigma * factor),
        _ => format!("not shown ({unit})"),
    };
    let is_shown = |first: usize| (first..first + 3).any(|k| change.value[k].is_some());
    let three = |first: usize, factor: f64, unit: &str| {
        if !is_shown(first) {
            return "by itself not shown by these welds".to_owned();
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
