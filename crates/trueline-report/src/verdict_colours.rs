//! Colours of the lines of a summary that decide.

use crate::terminal_text::shown;
use anstyle::{AnsiColor, Style};

/// Marks the lines that decide: good ones green, bad ones red, doubtful ones yellow.
#[must_use]
pub fn coloured(text: &str) -> String {
    shown(text).lines().map(|line| coloured_line(line) + "\n").collect()
}

fn coloured_line(line: &str) -> String {
    let colour = if line.starts_with("Calibration accepted") {
        AnsiColor::Green
    } else if line.starts_with("Calibration NOT accepted")
        || line.contains("MISSED")
        || line.starts_with("  - ")
    {
        AnsiColor::Red
    } else if line.starts_with("  warning:") {
        AnsiColor::Yellow
    } else {
        return line.to_owned();
    };
    let style = Style::new().fg_color(Some(colour.into()));
    format!("{style}{line}{style:#}")
}
