//! The last welds of every cell that is watched, a row a weld.

use crate::serve::html::{block, escape};
use crate::serve::watch::CellView;
use std::path::PathBuf;
use trueline_watch::State;
use trueline_watch::store::HistoryRow;

/// Welds that are shown, the newest first.
const WELDS: usize = 50;

/// The blocks of the page.
pub(super) fn blocks(states: &[PathBuf]) -> String {
    if states.is_empty() {
        return block("history", "<p class=\"state\">No weld has been watched yet.</p>");
    }
    let of = |(k, state): (usize, &PathBuf)| {
        let name = state.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let inside = match CellView::read(state) {
            Ok(cell) => table(&cell.history),
            Err(why) => {
                format!("<p class=\"state mind\">cannot be read</p><p>{}</p>", escape(&why.to_string()))
            }
        };
        block(&format!("history-{k}"), &format!("<h2>{}</h2>{inside}", escape(&name)))
    };
    states.iter().enumerate().map(of).collect()
}

fn table(history: &[HistoryRow]) -> String {
    let rows: String = history.iter().rev().take(WELDS).map(row).collect();
    let head = "<tr><th>weld</th><th>name</th><th>state</th><th>points used</th><th>outliers</th><th>noise over expected</th></tr>";
    format!("<table>{head}{rows}</table>")
}

fn row(weld: &HistoryRow) -> String {
    let kind = weld.alarm.as_ref().map_or("", |alarm| alarm.kind.as_str());
    let state = match weld.state() {
        State::Good => "no change seen".to_owned(),
        State::WithinTolerance => format!("{kind}: within the tolerance"),
        State::Alarm => format!("ALARM: {kind}"),
    };
    format!(
        "<tr><td>{}</td><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{:.2}</td></tr>",
        weld.number,
        escape(&weld.name),
        escape(&state),
        weld.used,
        weld.outliers,
        weld.noise_factor
    )
}
