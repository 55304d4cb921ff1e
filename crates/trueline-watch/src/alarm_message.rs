//! What is told of an alarm to whoever is not at the screen: one JSON object when it is raised, when it becomes another one, and when
//! it is over.

use crate::store::Standing;
use serde_json::{Value, json};

/// What happened to the alarm of a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// There was none before.
    Raised,
    /// It names another kind than before.
    Changed,
    /// It does not stand any more.
    Ended,
}

impl Event {
    /// What happened between two welds, if anything did, by the kinds of their alarms.
    #[must_use]
    pub(crate) fn between(before: Option<&Standing>, now: Option<&str>) -> Option<Self> {
        match (before, now) {
            (None, Some(_)) => Some(Self::Raised),
            (Some(before), Some(now)) if before.kind != now => Some(Self::Changed),
            (Some(_), None) => Some(Self::Ended),
            _ => None,
        }
    }

    /// The word in files.
    #[must_use]
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Raised => "raised",
            Self::Changed => "changed",
            Self::Ended => "ended",
        }
    }
}

/// The message about a weld, whose line is given as JSON. Its `text` is a sentence: chat programs show it as it is.
#[must_use]
pub(crate) fn body(event: Event, cell: &str, calibration: &str, watched_s: i64, line: &Value) -> Value {
    let (weld, alarm) = (line["weld"].as_str().unwrap_or_default(), &line["alarm"]);
    let kind = alarm["kind"].as_str().unwrap_or_default();
    let since = alarm["since"].as_str().unwrap_or_default();
    let text = match event {
        Event::Raised => format!("{cell}: {kind} has changed since {since}"),
        Event::Changed => format!("{cell}: it is rather {kind} that has changed, since {since}"),
        Event::Ended => format!("{cell}: the alarm is over since {weld}"),
    };
    json!({
        "event": event.name(), "text": text, "cell": cell, "calibration": calibration, "weld": weld,
        "watched_unix_s": watched_s, "alarm": alarm,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_difference_is_an_event() {
        let standing = Standing { kind: "timing".to_owned(), since: 3, inside_s: None };
        assert_eq!(Event::between(None, None), None);
        assert_eq!(Event::between(None, Some("timing")), Some(Event::Raised));
        assert_eq!(Event::between(Some(&standing), Some("timing")), None);
        assert_eq!(Event::between(Some(&standing), Some("bracket")), Some(Event::Changed));
        assert_eq!(Event::between(Some(&standing), None), Some(Event::Ended));
    }
}
