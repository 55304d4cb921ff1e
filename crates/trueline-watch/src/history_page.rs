//! The history as a page: control charts of what may change, of the noise, and of how improbable it all is.

use crate::detect::history::ALARM_P_LOG10;
use crate::history_table::column;
use crate::parameters::{CALIBRATION, Kind, ROTATION, SHAPE, TIME_OFFSET, TRANSLATION};
use crate::store::HistoryRow;
use crate::weld_text::{hidden, how_rarely, numbered, what_changed};
use std::ops::Range;
use trueline_report::page::render::render;
use trueline_report::page::{
    Axis, Block, Chart, Colour, Columns, Drawn, Mark, Page, Section, Series, Table, TableRow, Tone, Verdict,
};

/// Control limits, in standard deviations of a single weld.
const LIMITS: f64 = 3.0;
/// What is less improbable than this (eight welds in ten) is drawn at the foot of its logarithmic axis.
const LEAST_SHOWN: f64 = 0.1;
/// Alarms in the table.
const MOST_ALARMS: usize = 50;

/// Renders the page.
#[must_use]
pub fn html(history: &[HistoryRow], title: &str, command: &str) -> String {
    let mut page = Page { title: title.to_owned(), verdict: verdict(history), ..Page::default() };
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

fn verdict(history: &[HistoryRow]) -> Verdict {
    let Some(last) = history.last() else {
        return Verdict { text: "No weld has been watched yet.".to_owned(), tone: Tone::Plain };
    };
    match &last.alarm {
        None => Verdict {
            text: format!(
                "{} welds up to {}: no change seen. These welds are blind to: {}.",
                history.len(),
                numbered(last.number, &last.name),
                hidden(&last.blind_to)
            ),
            tone: Tone::Good,
        },
        Some(alarm) => Verdict {
            text: format!(
                "Since {}: {}. These welds are blind to: {}.",
                numbered(alarm.since, name_of(history, alarm.since)),
                said(&alarm.kind),
                hidden(&last.blind_to)
            ),
            tone: Tone::Bad,
        },
    }
}

fn name_of(history: &[HistoryRow], number: i64) -> &str {
    history.iter().find(|row| row.number == number).map_or("before this page", |row| &row.name)
}

/// A kind of change as a person would say it; a word of another version stays as it is.
fn said(kind: &str) -> &str {
    Kind::ALL.into_iter().find(|known| known.name() == kind).map_or(kind, |known| what_changed(known))
}

/// The first weld of each alarm that stood.
fn alarms(history: &[HistoryRow]) -> Table {
    let mut rows = Vec::new();
    let mut before: Option<&str> = None;
    for row in history {
        let now = row.alarm.as_ref().map(|alarm| alarm.kind.as_str());
        if let Some(alarm) = row.alarm.as_ref().filter(|_| now != before) {
            rows.push(TableRow::plain(vec![
                row.number.to_string(),
                row.name.clone(),
                said(&alarm.kind).to_owned(),
                numbered(alarm.since, name_of(history, alarm.since)),
                how_rarely(alarm.p_log10),
            ]));
        }
        before = now;
    }
    let first = rows.len().saturating_sub(MOST_ALARMS);
    Table {
        head: ["weld", "name", "what changed", "since", "without a change"].map(str::to_owned).to_vec(),
        rows: rows.split_off(first),
    }
}

fn welds(history: &[HistoryRow]) -> impl Iterator<Item = f64> + '_ {
    history.iter().map(|row| row.number as f64)
}

/// `translation_x_mm` as a legend has it: the unit stands at the axis.
fn in_words(column: &str) -> String {
    let units = ["_percent_per_mm", "_percent", "_ms", "_mm", "_deg"];
    let stem = units.iter().find_map(|unit| column.strip_suffix(unit)).unwrap_or(column);
    stem.replace('_', " ")
}

/// What each weld says of some columns by itself, with limits at three of its standard deviations.
fn control(
    history: &[HistoryRow],
    columns: &mut Columns,
    (id, title): (&'static str, &'static str),
    range: Range<usize>,
) -> Block {
    let name = column(range.start).0;
    let per_mm = name.ends_with("percent_per_mm").then_some("percent per mm");
    let unit = per_mm.or_else(|| name.rsplit('_').next()).unwrap_or_default();
    let x = columns.add(welds(history));
    let mut series = Vec::new();
    let (mut widest, mut farthest) = (0.0_f64, 0.0_f64);
    for (colour, k) in range.clone().enumerate() {
        let (name, factor) = column(k);
        let of = |row: &HistoryRow| row.estimates.get(k).copied().flatten();
        let y = columns.add(history.iter().map(|row| of(row).map_or(f64::NAN, |[value, _]| value * factor)));
        series.push(Series::points(&in_words(name), x, y, Colour::of(colour)));
        farthest =
            history.iter().filter_map(of).map(|[value, _]| (value * factor).abs()).fold(farthest, f64::max);
        let mut sigmas: Vec<f64> = history.iter().filter_map(of).map(|[_, sigma]| sigma * factor).collect();
        sigmas.sort_by(f64::total_cmp);
        widest = widest.max(sigmas.get(sigmas.len() / 2).copied().unwrap_or(0.0));
    }
    // Both limits are always in view.
    let half = (1.05 * farthest.max(LIMITS * widest)).max(f64::MIN_POSITIVE);
    let mark = |at: f64, name: &str| Mark { name: name.to_owned(), at, upright: false };
    Block::Chart(Chart {
        id,
        title,
        explanation:
            "What each weld says by itself, as if nothing else had changed; the lines are three standard \
                      deviations of one weld. The detector adds many welds up and sees far less than that."
                .to_owned(),
        alternative: format!("{title} against the stored calibration in {unit} by weld"),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("weld"),
            y: Axis::of(&format!("change ({unit})")).between(-half, half),
            series,
            marks: [1.0, -1.0].map(|sign| mark(sign * LIMITS * widest, "± 3 σ")).into(),
        },
    })
}

fn probabilities(history: &[HistoryRow], columns: &mut Columns) -> Block {
    let x = columns.add(welds(history));
    let series = Kind::ALL.iter().enumerate().map(|(k, kind)| {
        let of = |row: &HistoryRow| row.p_log10.get(k).map_or(f64::NAN, |p| (-p).max(LEAST_SHOWN));
        let y = columns.add(history.iter().map(of));
        Series::points(kind.name(), x, y, Colour::of(k))
    });
    let series = series.collect();
    let most = history.iter().flat_map(|row| &row.p_log10).map(|p| -p).fold(0.0, f64::max);
    Block::Chart(Chart {
        id: "improbable",
        title: "How improbable without a change",
        explanation: "How rarely welds look like these if nothing has changed. Above the line is an alarm; the line is set for \
                      one false alarm in 100,000 pieces."
            .to_owned(),
        alternative: "In how many welds it comes once without a change, by weld and kind of change".to_owned(),
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
        explanation: "How much larger the residuals are than features, robot and stamps let expect."
            .to_owned(),
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
