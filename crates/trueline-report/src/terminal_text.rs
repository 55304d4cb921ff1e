//! Text for a terminal.

use std::borrow::Cow;

/// Text without what a terminal would obey: names of files and topics are whatever strangers call them.
#[must_use]
pub fn shown(text: &str) -> Cow<'_, str> {
    let obeyed = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    if !text.contains(obeyed) {
        return Cow::Borrowed(text);
    }
    let escaped =
        text.chars().map(|c| if obeyed(c) { c.escape_default().to_string() } else { c.to_string() });
    Cow::Owned(escaped.collect())
}

#[cfg(test)]
mod tests {
    use super::shown;

    #[test]
    fn what_a_terminal_would_obey_is_written_out() {
        assert_eq!(shown("/a\x1b[2J\x07\u{9b}31m\r"), "/a\\u{1b}[2J\\u{7}\\u{9b}31m\\r");
        assert_eq!(shown("0.012 ± 0.003 mm\n\tµ"), "0.012 ± 0.003 mm\n\tµ");
    }
}
