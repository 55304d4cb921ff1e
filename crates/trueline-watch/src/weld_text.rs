//! What is told of a weld, for the person who welds.

use crate::detect::{Alarm, Change};
use crate::parameters::Kind;
use crate::weld_line::WeldLine;

/// What is told of a weld.
#[must_use]
pub fn of(line: &WeldLine) -> String {
    if line.told_before.is_some() {
        let state = if line.is_alarm() { "an alarm stood" } else { "nothing had changed" };
        return format!("{}: watched before; {state}\n", line.weld);
    }
    let mut text = match &line.alarm {
        None => format!("{}: nothing has changed ({} seam points)\n", line.weld, line.used),
        Some((alarm, since)) => alarm_text(&line.weld, alarm, since),
    };
    if let Some(learning) = line.learning {
        text += &format!(
            "  the fixture is being learnt: {} of {} pieces; until then a part that lies elsewhere raises no alarm\n",
            learning.pieces.min(learning.needed),
            learning.needed
        );
    }
    if !line.blind_to.is_empty() {
        text += &format!(
            "  these welds would not show: {}; a scan of 5 s over a fixed edge shows all of it: \
             `trueline plan cell.toml --calibration RESULT --duration-s 5 --out check-scan`\n",
            line.blind_to.join(", ")
        );
    }
    if !line.stamps_treated_alike {
        text +=
            "  warning: this weld's stamps are too uneven to be treated as those of the calibration were\n";
    }
    text
}

fn alarm_text(weld: &str, alarm: &Alarm, since: &str) -> String {
    let what = what_changed(alarm.change.kind);
    let when = match alarm.since.inside_s {
        Some(at_s) => format!("since {at_s:.1} s into {since}"),
        None => format!("since {since}"),
    };
    let mut text = format!("{weld}: ALARM: {what}, {when}\n");
    for part in numbers(&alarm.change) {
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

/// What has changed, and where to look.
pub(crate) fn what_changed(kind: Kind) -> &'static str {
    match kind {
        Kind::Timing => "the camera's time offset has changed",
        Kind::Bracket => {
            "the sensor has moved on the robot: look at its bracket, and whether the torch or tool was changed"
        }
        Kind::Sensor => "the sensor itself has changed: look at its window, camera and laser",
        Kind::Seam => "the part lies elsewhere: look at the fixture; the calibration is still good",
    }
}

/// Beyond this log₁₀ the tail of the distribution is a figure of the model, and not of any cell.
const RAREST_LOG10: f64 = -12.0;

/// A probability in words.
pub(crate) fn how_rarely(p_log10: f64) -> String {
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
    let three = |first: usize, factor: f64, unit: &str| {
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
