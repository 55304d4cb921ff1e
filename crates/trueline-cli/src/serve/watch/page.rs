//! Cells as a page: state, trend, the last alarm with its evidence.

use super::evidence;
use super::view::{CellView, change_of};
use crate::serve::html::{block, card, escape, facts, list};
use crate::serve::trend::{Series, Trend};
use serde_json::Value;
use std::cmp::Ordering;
use trueline_watch::detect::history::ALARM_P_LOG10;
use trueline_watch::history_table::column;
use trueline_watch::parameters::{CALIBRATION, ROTATION, SHAPE, TIME_OFFSET, TRANSLATION};
use trueline_watch::store::HistoryRow;
use trueline_watch::weld_text::OTHER_SENSOR;
use trueline_watch::words::{RAREST_SHOWN, hidden, how_rarely, numbered};
use trueline_watch::{Kind, State};

/// The blocks of all cells; `Err` replaces a cell that cannot be read.
#[must_use]
pub(super) fn blocks(cells: &[(String, Result<CellView, String>)], now_s: i64) -> String {
    let of = |(k, (name, cell)): (usize, &(String, Result<CellView, String>))| {
        let inside = match cell {
            Ok(cell) => inside(cell, now_s),
            Err(why) => format!("<p class=\"state mind\">cannot be read</p><p>{}</p>", escape(why)),
        };
        block(&format!("cell-{k}"), &format!("<h2>{}</h2>{inside}", escape(name)))
    };
    cells.iter().enumerate().map(of).collect()
}

fn inside(cell: &CellView, now_s: i64) -> String {
    let Some(last) = cell.history.last() else {
        return "<p class=\"state\">No weld has been watched yet.</p>".to_owned();
    };
    let blind = escape(&hidden(&last.blind_to));
    let state = format!("{}<p>These welds are blind to: {blind}.</p>", state(cell));
    let mut cards = card("Now", "", &now(cell, last, now_s));
    if let Some((line, at_s)) = &cell.last_alarm {
        cards += &alarm_card(line, *at_s, now_s, cell.state());
    }
    cards += &card("Evidence for a change", "", &(improbable(&cell.history).svg() + IMPROBABLE));
    let charts = [
        ("Time offset: change (ms)", TIME_OFFSET..ROTATION, ["change", "", ""]),
        ("Bracket: shift, tool axes (mm)", TRANSLATION..SHAPE, ["x", "y", "z"]),
        ("Bracket: turn, tool axes (°)", ROTATION..TRANSLATION, ["x", "y", "z"]),
        ("Sensor: scale (%)", SHAPE..SHAPE + 3, ["width", "depth", "shear"]),
    ];
    for (heading, range, names) in charts {
        let trend = by_weld(&cell.history, range, names, heading);
        let shows = trend.series.iter().flat_map(|series| &series.points).any(|[_, y]| y.is_finite());
        let not_shown = "<p class=\"soft\">Not determined alone by these welds.</p>".to_owned();
        cards += &card(heading, "", &if shows { trend.svg() } else { not_shown });
    }
    cards += &card("Noise: residuals over expected", "", &noise(&cell.history).svg());
    format!("{state}<div class=\"blocks\">{cards}</div>")
}

/// The standing change, with its size and the remedy.
fn state(cell: &CellView) -> String {
    if let Some(before) = cell.repaired {
        return format!(
            "<p class=\"state mind\">A repair before weld {before} is reported. The next welds will show it.</p>"
        );
    }
    let Some(change) = cell.change() else { return "<p class=\"state good\">No change seen.</p>".to_owned() };
    let (class, word) = match cell.state() {
        State::WithinTolerance => ("mind", "Changed within the tolerance"),
        State::Alarm | State::Good => ("bad", "ALARM"),
    };
    format!("<p class=\"state {class}\">{word}: {}</p>", escape(&evidence::text(change)))
}

/// How the chart above it is read.
const IMPROBABLE: &str = "<p class=\"soft\">3 means once in 1,000 welds, 6 once in a million, 20 at most \
     once in 10²⁰. Above the dashed line is an alarm.</p>";

fn now(cell: &CellView, last: &HistoryRow, now_s: i64) -> String {
    let line = cell.last.as_ref().unwrap_or(&Value::Null);
    let calibration = cell.calibration.as_ref();
    let mut rows = vec![
        ("last weld", numbered(last.number, &last.name)),
        ("watched", ago(now_s - last.watched_s)),
        ("welds", calibration.map_or(0, |c| c.welds).to_string()),
        ("calibration", calibration.map_or_else(String::new, |c| c.name.clone())),
        ("seam points", format!("{} used, {} outliers", last.used, last.outliers)),
    ];
    if let (Some(seen), Some(needed)) =
        (line["learning"]["pieces"].as_u64(), line["learning"]["needed"].as_u64())
    {
        rows.push(("fixture", learning(seen, needed)));
    }
    rows.push(("blind to", hidden(&last.blind_to)));
    if line["sensor_file_differs"].as_bool() == Some(true) {
        rows.push(("sensor", OTHER_SENSOR.to_owned()));
    }
    for receiver in &cell.receivers {
        let waiting = match (receiver.waiting, &receiver.error) {
            (0, _) => "has received everything".to_owned(),
            (1, None) => "1 message waiting".to_owned(),
            (n, None) => format!("{n} messages waiting"),
            (1, Some(why)) => format!("1 message waiting: {why}"),
            (n, Some(why)) => format!("{n} messages waiting: {why}"),
        };
        rows.push(("alarms to", format!("{}: {waiting}", receiver.name)));
    }
    let mut out = facts(rows);
    // A part's place is the fixture's, and no scan of an edge shows it.
    if last.blind_to.iter().any(|what| what != Kind::Seam.name()) {
        out += "<p class=\"soft\">A 5 s scan over a fixed edge, with motion and tilt, detects timing, \
            bracket and sensor.</p>";
    }
    out
}

fn learning(pieces: u64, needed: u64) -> String {
    match pieces.cmp(&needed) {
        Ordering::Less => format!("learning: {pieces} of {needed} parts"),
        Ordering::Equal => format!("learnt from {pieces} parts"),
        Ordering::Greater => format!("learning failed after {pieces} parts"),
    }
}

fn alarm_card(line: &Value, at_s: i64, now_s: i64, state: State) -> String {
    let alarm = change_of(line);
    let p = alarm["p_log10"].as_f64().unwrap_or(0.0);
    let [what, look_at] = evidence::what(alarm);
    let mut rows = vec![
        ("cause", what.to_owned()),
        ("summary", evidence::text(alarm)),
        ("check", look_at.to_owned()),
        ("since", evidence::since(alarm)),
        ("reported at", format!("{}, {}", evidence::weld(line, "number", "weld"), ago(now_s - at_s))),
        ("false-alarm rate", how_rarely(p)),
    ];
    rows.extend(evidence::numbers(alarm));
    let others = evidence::words(&alarm["not_told_apart"]);
    let others =
        others.into_iter().map(|kind| format!("it may also be the {kind}: these welds cannot separate them"));
    let (heading, class) = match state {
        State::Alarm => ("Active alarm", "alarm"),
        State::WithinTolerance => ("Change within the tolerance", ""),
        State::Good => ("Last alarm (cleared)", ""),
    };
    card(heading, class, &(facts(rows) + &list(others)))
}

fn improbable(history: &[HistoryRow]) -> Trend {
    let of = |(k, kind): (usize, Kind)| Series {
        name: kind.name(),
        points: history
            .iter()
            .map(|row| [row.number as f64, row.p_log10.get(k).map_or(f64::NAN, |p| (-p).min(RAREST_SHOWN))])
            .collect(),
        ..Series::default()
    };
    Trend {
        alternative: "How rare each weld is without a change (powers of ten), by kind".to_owned(),
        along: "weld",
        series: Kind::ALL.into_iter().enumerate().map(of).collect(),
        limits: vec![-ALARM_P_LOG10],
    }
}

fn by_weld(
    history: &[HistoryRow],
    range: std::ops::Range<usize>,
    names: [&'static str; 3],
    alternative: &str,
) -> Trend {
    let series = range.zip(names).map(|(k, name)| {
        let factor = column(k).1;
        // A quantity that a weld does not show independently is no point; older rows do not state it.
        let value = |row: &HistoryRow| {
            let by_itself = row.estimates.get(CALIBRATION + k).or_else(|| row.estimates.get(k));
            by_itself.copied().flatten().map_or(f64::NAN, |[value, _]| value * factor)
        };
        let points = history.iter().map(|row| [row.number as f64, value(row)]).collect();
        Series { name, points, dotted: true, ..Series::default() }
    });
    Trend {
        alternative: format!("{alternative} by weld"),
        along: "weld",
        series: series.collect(),
        limits: Vec::new(),
    }
}

fn noise(history: &[HistoryRow]) -> Trend {
    let points = history.iter().map(|row| [row.number as f64, row.noise_factor]).collect();
    let series = vec![Series { name: "noise", points, dotted: true, ..Series::default() }];
    Trend { alternative: "Noise factor by weld".to_owned(), along: "weld", series, limits: Vec::new() }
}

/// A time that has passed, in the unit that suits it.
fn ago(s: i64) -> String {
    match s {
        ..60 => format!("{} s ago", s.max(0)),
        60..7200 => format!("{} min ago", s / 60),
        7200..172_800 => format!("{} h ago", s / 3600),
        _ => format!("{} days ago", s / 86_400),
    }
}
