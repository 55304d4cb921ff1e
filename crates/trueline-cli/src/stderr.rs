//! Words on stderr.

use std::io::Write;
use terminal_size::{Width, terminal_size_of};
use trueline_report::terminal_text::shown;
use trueline_report::wrapped::wrapped_to;

/// Words for a person. Lines are broken for a terminal only: piped output is searched line by line.
pub(crate) fn words(text: &str) {
    let text = shown(text.trim_end());
    let text = columns().map_or_else(|| text.to_string(), |columns| wrapped_to(&text, columns));
    // If stderr is closed the message is dropped.
    let _ = writeln!(std::io::stderr().lock(), "{}", text.trim_end());
}

/// Columns of the terminal with the messages, or the value of COLUMNS.
pub(crate) fn columns() -> Option<usize> {
    let said = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    said.or_else(|| terminal_size_of(std::io::stderr()).map(|(Width(columns), _)| columns.into()))
}
