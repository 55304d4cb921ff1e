//! Text for a terminal.

use std::borrow::Cow;

/// Whether a character controls a terminal, or changes the order of its neighbours.
fn obeyed(c: char) -> bool {
    let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    turns || c.is_control() && !matches!(c, '\n' | '\t')
}

/// Text without control characters: names of files and topics are chosen by strangers.
#[must_use]
pub fn shown(text: &str) -> Cow<'_, str> {
    if !text.contains(obeyed) {
        return Cow::Borrowed(text);
    }
    let escaped =
        text.chars().map(|c| if obeyed(c) { c.escape_default().to_string() } else { c.to_string() });
    Cow::Owned(escaped.collect())
}

/// JSON of the same meaning without such characters. They occur only in its texts, which can hold each as a number.
#[must_use]
pub fn json_shown(json: &str) -> Cow<'_, str> {
    if !json.contains(obeyed) {
        return Cow::Borrowed(json);
    }
    // All of them are in the first plane.
    let numbered = |c: char| if obeyed(c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    Cow::Owned(json.chars().map(numbered).collect())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::{json_shown, shown};

    #[test]
    fn what_a_terminal_would_obey_is_written_out() {
        assert_eq!(shown("/a\x1b[2J\x07\u{9b}31m\r"), "/a\\u{1b}[2J\\u{7}\\u{9b}31m\\r");
        assert_eq!(shown("scan\u{202e}gnp.exe"), "scan\\u{202e}gnp.exe");
        assert_eq!(shown("0.012 ± 0.003 mm\n\tµ"), "0.012 ± 0.003 mm\n\tµ");
    }

    #[test]
    fn json_keeps_its_meaning() {
        let value = serde_json::json!({ "name": "a\u{9b}31m\u{7f}\u{202e}\n\u{1b}µ", "n": [1, 2] });
        let pretty = serde_json::to_string_pretty(&value).unwrap();
        let shown = json_shown(&pretty);
        assert!(!shown.contains(|c: char| c.is_control() && c != '\n') && !shown.contains('\u{202e}'));
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).unwrap(), value);
    }
}
