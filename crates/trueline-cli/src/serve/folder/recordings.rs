//! The recordings, newest first.

use super::contents::{Contents, RecordingFile};
use crate::serve::html::{block, escape};
use std::time::Duration;

/// Bytes in a megabyte.
const MB: f64 = 1e6;

/// The blocks of the page.
pub(super) fn blocks(contents: &Contents) -> String {
    if contents.recordings.is_empty() {
        return block("recordings", "<p class=\"state\">Nothing has been recorded yet.</p>");
    }
    let rows: String = contents.recordings.iter().map(row).collect();
    let head = "<tr><th>recording</th><th>state</th><th>size (MB)</th><th>last written</th></tr>";
    let live = "<p class=\"soft\">Picture, estimate and rates of a recording that is under way are on the page of <code>trueline \
                record --serve</code>.</p>";
    block("recordings", &format!("<table>{head}{rows}</table>{live}"))
}

fn row(recording: &RecordingFile) -> String {
    let state = if recording.is_under_way() { "being written" } else { "finished" };
    let written = recording.written_ago.map_or_else(|| "–".to_owned(), ago);
    format!(
        "<tr><th scope=\"row\">{}</th><td>{state}</td><td>{:.1}</td><td>{written}</td></tr>",
        escape(&recording.name),
        recording.bytes as f64 / MB
    )
}

/// How long ago, in the largest unit that fits.
fn ago(time: Duration) -> String {
    const UNITS: [(u64, &str); 4] = [(86_400, "d"), (3600, "h"), (60, "min"), (1, "s")];
    let seconds = time.as_secs();
    let (unit_s, unit) = UNITS.into_iter().find(|(unit_s, _)| seconds >= *unit_s).unwrap_or((1, "s"));
    format!("{} {unit} ago", seconds / unit_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_told_in_their_largest_unit() {
        for (seconds, told) in
            [(0, "0 s ago"), (59, "59 s ago"), (125, "2 min ago"), (7300, "2 h ago"), (200_000, "2 d ago")]
        {
            assert_eq!(ago(Duration::from_secs(seconds)), told);
        }
    }
}
