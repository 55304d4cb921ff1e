//! The history as a page: control charts of possible changes, of the noise, and of the improbability of it all.

use crate::detect::history::ALARM_P_LOG10;
use crate::history_table::column;
use crate::parameters::{CALIBRATION, Kind, ROTATION, SHAPE, TIME_OFFSET, TRANSLATION};
use crate::store::{AlarmRow, HistoryRow};
use crate::told::State;
use crate::words::{RAREST_SHOWN, hidden, how_rarely, numbered, what_changed};
use std::ops::Range;
use trueline_report::number::with_sigma;
use trueline_report::page::render::render;
use trueline_report::page::{
    Axis, Block, Chart, Colour, Columns, Drawn, Mark, Page, Section, Series, Table, TableRow, Tone, Verdict,
};

/// Control limits, in standard deviations of a single weld.
const LIMITS: f64 = 3.0;
/// Values less rare than this (eight welds in ten) are drawn at the foot of its logarithmic axis.
const LEAST_SHOWN: f64 = 0.1;
/// Alarms in the table.
const MOST_ALARMS: usize = 50;

/// Renders the page; `repaired` is the number of the weld before which a repair was reported, if no weld has verified it since.
#[must_use]
pub fn html(history: &[HistoryRow], repaired: Option<i64>, title: &str, command: &str) -> String {
    let mut page = Page { title: title.to_owned(), verdict: verdict(history, repaired), ..Page::default() };
    let columns = &mut page.columns;
    let charts = vec![
        probabilities(history, columns),
        control(history, columns, ("time-offset", "Time offset"), TIME_OFFSET..ROTATION),
        control(history, columns, ("translation", "Bracket: shift, tool axes"), TRANSLATION..SHAPE),
        control(history, columns, ("rotation", "Bracket: turn, tool axes"), ROTATION..TRANSLATION),
        control(history, columns, ("shape", "Sensor: width, depth and shear"), SHAPE..SHAPE + 3),
        control(history, columns, ("keystone", "Sensor: keystone"), SHAPE + 3..CALIBRATION),
        noise(history, columns),
    ];
    page.sections = vec![
        Section {
            id: "alarms",
            heading: "Alarms",
            folded: false,
            blocks: vec![Block::Table(alarms(history))],
        },
        Section { id: "charts", heading: "Control charts", folded: false, blocks: charts },
        Section {
            id: "made",
            heading: "How this was made",
            folded: false,
            blocks: vec![Block::Text(command.to_owned())],
        },
    ];
    render(&page)
}

fn verdict(history: &[HistoryRow], repaired: Option<i64>) -> Verdict {
    let Some(last) = history.last() else {
        return Verdict { text: "No weld has been watched yet.".to_owned(), tone: Tone::Plain };
    };
    let blind = format!("These welds are blind to: {}.", hidden(&last.blind_to));
    if let Some(before) = repaired {
        let text = format!("A repair before weld {before} is reported. The next welds will show it. {blind}");
        return Verdict { text, tone: Tone::Doubtful };
    }
    let words = last.alarm.as_ref().map(|alarm| words(history, alarm)).unwrap_or_default();
    match last.state() {
        State::Good => Verdict {
            text: format!(
                "{} welds up to {}: no change seen. {blind}",
                history.len(),
                numbered(last.number, &last.name)
            ),
            tone: Tone::Good,
        },
        State::WithinTolerance => {
            Verdict { text: format!("Changed within the tolerance. {words} {blind}"), tone: Tone::Doubtful }
        }
        State::Alarm => Verdict { text: format!("ALARM. {words} {blind}"), tone: Tone::Bad },
    }
}

/// The change, its size and the remedy; older rows may lack them.
fn words(history: &[HistoryRow], alarm: &AlarmRow) -> String {
    alarm.text.clone().unwrap_or_else(|| {
        let since = numbered(alarm.since, name_of(history, alarm.since));
        let size = alarm.seam_error.map_or_else(String::new, |[value, sigma]| {
            format!(", seam points are {} off", with_sigma(value * 1e3, Some(sigma * 1e3), "mm"))
        });
        format!("Since {since}: {}{size}.", said(&alarm.kind))
    })
}

fn name_of(history: &[HistoryRow], number: i64) -> &str {
    history.iter().find(|row| row.number == number).map_or("before this page", |row| &row.name)
}

/// Words for a kind of change; an unknown kind stays unchanged.
fn said(kind: &str) -> &str {
    Kind::ALL.into_iter().find(|known| known.name() == kind).map_or(kind, |known| what_changed(known))
}

/// Each change that stood, as its last weld has it.
fn alarms(history: &[HistoryRow]) -> Table {
    let mut rows = Vec::new();
    let kind = |row: &HistoryRow| row.alarm.as_ref().map(|alarm| (alarm.kind.clone(), alarm.is_within));
    for stretch in history.chunk_by(|a, b| kind(a) == kind(b)) {
        let (Some(first), Some(last)) = (stretch.first(), stretch.last()) else { continue };
        let Some(alarm) = &last.alarm else { continue };
        let after = history.iter().find(|row| row.number > last.number);
        let until = match after.map(|row| (row, row.alarm.is_none())) {
            Some((row, true)) => format!("cleared at {}", numbered(row.number, &row.name)),
            Some((row, false)) => format!("replaced at {}", numbered(row.number, &row.name)),
            None => "active".to_owned(),
        };
        let size = alarm.seam_error.map_or_else(
            || "not determined".to_owned(),
            |[value, sigma]| with_sigma(value * 1e3, Some(sigma * 1e3), "mm"),
        );
        rows.push(TableRow::plain(vec![
            numbered(first.number, &first.name),
            last.state().name().to_owned(),
            words(history, alarm),
            size,
            until,
            how_rarely(alarm.p_log10),
        ]));
    }
    let first = rows.len().saturating_sub(MOST_ALARMS);
    Table {
        head: [
            "found at",
            "state",
            "what changed, and the remedy",
            "seam points off",
            "until",
            "false-alarm rate",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows: rows.split_off(first),
    }
}

fn welds(history: &[HistoryRow]) -> impl Iterator<Item = f64> + '_ {
    history.iter().map(|row| row.number as f64)
}

/// `translation_x_mm` as in a legend: the unit is at the axis.
fn in_words(column: &str) -> String {
    let units = ["_percent_per_mm", "_percent", "_ms", "_mm", "_deg"];
    let stem = units.iter().find_map(|unit| column.strip_suffix(unit)).unwrap_or(column);
    stem.replace('_', " ")
}

/// Estimate of a column from a weld: the change with its standard deviation, and whether the weld alone determines it.
struct Said {
    value: f64,
    sigma: f64,
    is_shown: bool,
}

/// Of a column, in the unit of files. While a change of another kind is active, it causes the estimate of this kind.
fn said_of(row: &HistoryRow, k: usize) -> Option<Said> {
    let factor = column(k).1;
    let other_stands = row.alarm.as_ref().is_some_and(|alarm| {
        Kind::ALL.into_iter().any(|kind| kind.name() == alarm.kind && !kind.columns().contains(&k))
    });
    let of = |place: usize| row.estimates.get(place).copied().flatten();
    let (alone, by_itself) = (of(k), of(CALIBRATION + k));
    // Older rows do not state whether it is shown independently.
    let is_shown = !other_stands && (by_itself.is_some() || row.estimates.len() <= CALIBRATION);
    let [value, sigma] = by_itself.filter(|_| is_shown).or(alone)?;
    Some(Said { value: value * factor, sigma: sigma * factor, is_shown })
}

/// Estimates of some columns from each weld alone, with limits at three standard deviations.
fn control(
    history: &[HistoryRow],
    columns: &mut Columns,
    (id, title): (&'static str, &'static str),
    range: Range<usize>,
) -> Block {
    let name = column(range.start).0;
    let per_mm = name.ends_with("percent_per_mm").then_some("percent per mm");
    let unit = per_mm.or_else(|| name.rsplit('_').next()).unwrap_or_default();
    let all: Vec<Vec<Option<Said>>> =
        range.clone().map(|k| history.iter().map(|row| said_of(row, k)).collect()).collect();
    let widest = all.iter().map(|own| median_sigma(own, true)).fold(0.0, f64::max);
    let is_shown = widest > 0.0;
    // If nothing is shown independently, the picture is as large as chance.
    let alone = all.iter().map(|own| median_sigma(own, false)).fold(0.0, f64::max);
    let limit = LIMITS * if is_shown { widest } else { alone };
    let every = all.iter().flatten().flatten();
    let farthest = every.filter(|said| said.is_shown).map(|said| said.value.abs()).fold(0.0, f64::max);
    // Both limits are always in view. Values that are not determined independently do not widen the range.
    let half = (1.05 * farthest.max(limit)).max(f64::MIN_POSITIVE);
    let x = columns.add(welds(history));
    let mut series = Vec::new();
    for (colour, (k, own)) in range.zip(&all).enumerate() {
        if is_shown_by(own) || !all.iter().any(|own| own.iter().any(Option::is_some)) {
            let y = own.iter().map(|said| said.as_ref().filter(|s| s.is_shown).map_or(f64::NAN, |s| s.value));
            let y = columns.add(y);
            series.push(Series::points(&in_words(column(k).0), x, y, Colour::of(colour)));
        }
    }
    let grey = hidden_points(history, &all, limit);
    if !grey.is_empty() {
        let [x, y] = [0, 1].map(|k| columns.add(grey.iter().map(|point| point[k])));
        series.push(Series::points("not determined alone", x, y, Colour::Soft));
    }
    let mark = |at: f64, name: &str| Mark { name: name.to_owned(), at, upright: false };
    let marks = [1.0, -1.0].map(|sign| mark(sign * limit, "± 3 σ"));
    Block::Chart(Chart {
        id,
        title,
        explanation: EXPLANATION.to_owned(),
        alternative: format!("{title} against the stored calibration in {unit} by weld"),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("weld"),
            y: Axis::of(&format!("change ({unit})")).between(-half, half),
            series,
            marks: if is_shown { marks.into() } else { Vec::new() },
        },
    })
}

const EXPLANATION: &str = "Estimate from each weld, assuming that nothing of another kind has changed; the lines are 3 σ of one weld. \
     Grey values are no evidence: the weld alone does not determine them, or another change causes them. They are drawn within the limits.";

fn is_shown_by(own: &[Option<Said>]) -> bool {
    own.iter().flatten().any(|said| said.is_shown)
}

/// Values that a weld does not determine alone: weld and value, within limits.
fn hidden_points(history: &[HistoryRow], all: &[Vec<Option<Said>>], limit: f64) -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    for own in all {
        for (weld, said) in welds(history).zip(own) {
            if let Some(said) = said.as_ref().filter(|said| !said.is_shown) {
                points.push([weld, said.value.clamp(-limit, limit)]);
            }
        }
    }
    points
}

fn median_sigma(own: &[Option<Said>], is_shown: bool) -> f64 {
    let mut sigmas: Vec<f64> =
        own.iter().flatten().filter(|said| said.is_shown == is_shown).map(|said| said.sigma).collect();
    sigmas.sort_by(f64::total_cmp);
    sigmas.get(sigmas.len() / 2).copied().unwrap_or(0.0)
}

fn probabilities(history: &[HistoryRow], columns: &mut Columns) -> Block {
    let x = columns.add(welds(history));
    let series = Kind::ALL.iter().enumerate().map(|(k, kind)| {
        let of =
            |row: &HistoryRow| row.p_log10.get(k).map_or(f64::NAN, |p| (-p).clamp(LEAST_SHOWN, RAREST_SHOWN));
        let y = columns.add(history.iter().map(of));
        Series::points(kind.name(), x, y, Colour::of(k))
    });
    let series = series.collect();
    let most = history.iter().flat_map(|row| &row.p_log10).map(|p| -p).fold(0.0, f64::max).min(RAREST_SHOWN);
    Block::Chart(Chart {
        id: "improbable",
        title: "Evidence for a change",
        explanation:
            "How rare such a weld is if nothing has changed. Above the line is an alarm; the line is set for \
                      one false alarm in 100,000 pieces. Rarer values than 1 in 10²⁰ are drawn there."
                .to_owned(),
        alternative: "How rare each weld is without a change, by kind of change".to_owned(),
        wide: true,
        drawn: Drawn::Plot {
            x: Axis::of("weld"),
            y: Axis::rarity("without a change").between(LEAST_SHOWN, most.max(10.0)),
            series,
            marks: vec![Mark { name: "alarm".to_owned(), at: -ALARM_P_LOG10, upright: false }],
        },
    })
}

fn noise(history: &[HistoryRow], columns: &mut Columns) -> Block {
    let x = columns.add(welds(history));
    let y = columns.add(history.iter().map(|row| row.noise_factor));
    Block::Chart(Chart {
        id: "noise",
        title: "Noise",
        explanation: "Residuals, divided by the noise expected of features, robot and stamps.".to_owned(),
        alternative: "Noise factor by weld".to_owned(),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("weld"),
            y: Axis::of("residuals over expected"),
            series: vec![Series::points("noise", x, y, Colour::A)],
            marks: Vec::new(),
        },
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn row(number: i64, kind: Option<&str>) -> HistoryRow {
        // A shift along x of 5 of its own ± as if nothing else had changed, which the weld does not show independently, and
        // a time offset.
        let mut estimates = vec![None; 2 * CALIBRATION];
        estimates[TRANSLATION] = Some([5e-4, 1e-4]);
        estimates[TIME_OFFSET] = Some([1e-4, 1e-5]);
        estimates[CALIBRATION + TIME_OFFSET] = Some([1e-4, 1e-5]);
        let alarm = kind.map(|kind| AlarmRow {
            kind: kind.to_owned(),
            since: number,
            p_log10: -464.0,
            is_within: false,
            text: None,
            seam_error: None,
        });
        HistoryRow {
            number,
            name: format!("weld-{number}"),
            part: 1,
            watched_s: 0,
            used: 100,
            outliers: 0,
            noise_factor: 1.0,
            estimates,
            p_log10: vec![-464.0, -1.0, -1.0, -1.0],
            blind_to: Vec::new(),
            alarm,
        }
    }

    #[test]
    fn what_a_weld_does_not_show_by_itself_is_no_evidence() {
        let [shift, offset] = [TRANSLATION, TIME_OFFSET].map(|k| said_of(&row(0, None), k).unwrap());
        assert!(!shift.is_shown && offset.is_shown && (offset.value - 0.1).abs() < 1e-12);
        // While the sensor has moved, a time offset of a weld may be that.
        assert!(!said_of(&row(0, Some("bracket")), TIME_OFFSET).unwrap().is_shown);
        assert!(said_of(&row(0, Some("timing")), TIME_OFFSET).unwrap().is_shown);
        let all = vec![vec![said_of(&row(3, None), TRANSLATION)]];
        assert_eq!(hidden_points(&[row(3, None)], &all, 0.3), [[3.0, 0.3]], "within the limits");
        // Rows of older states have no second half.
        let old = HistoryRow { estimates: row(0, None).estimates[..CALIBRATION].to_vec(), ..row(0, None) };
        assert!(said_of(&old, TRANSLATION).unwrap().is_shown);
    }

    #[test]
    fn a_page_stops_at_the_rarest_that_means_anything_and_says_how_alarms_ended() {
        let history = [row(0, None), row(1, Some("timing")), row(2, None)];
        let page = html(&history, None, "cell", "trueline history");
        assert!(page.contains("\"limits\":[0.1,20.0]"), "no 1 in 10 to the 464");
        assert!(page.contains("cleared at weld 2 (weld-2)"));
        assert!(html(&history[..2], Some(2), "cell", "").contains("A repair before weld 2 is reported"));
    }
}
