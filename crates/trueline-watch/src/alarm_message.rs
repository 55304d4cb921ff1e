//! Alarm messages: one JSON object when an alarm is raised, changes or clears.

use crate::store::Standing;
use crate::words::numbered;
use serde_json::{Value, json};

/// Event of a calibration's alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// There was none before.
    Raised,
    /// It is another change than before.
    Changed,
    /// A change within the tolerance: a new one, or one that was an alarm.
    WithinTolerance,
    /// Nothing stands any more.
    Ended,
}

impl Event {
    /// Event between two welds, if any: kind and first weld of the standing change, and whether it is within
    /// the tolerance.
    #[must_use]
    pub(crate) fn between(before: Option<&Standing>, now: Option<&Standing>) -> Option<Self> {
        match (before, now) {
            (None, None) => None,
            (Some(_), None) => Some(Self::Ended),
            (before, Some(now)) if now.is_within => {
                let is_same = before.is_some_and(|before| before.is_within && before.kind == now.kind);
                (!is_same).then_some(Self::WithinTolerance)
            }
            (None, Some(_)) => Some(Self::Raised),
            (Some(before), Some(_)) if before.is_within => Some(Self::Raised),
            (Some(before), Some(now)) => (before.kind != now.kind || now.is_another).then_some(Self::Changed),
        }
    }

    /// The word in files.
    #[must_use]
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Raised => "raised",
            Self::Changed => "changed",
            Self::WithinTolerance => "within-tolerance",
            Self::Ended => "ended",
        }
    }
}

/// The message about a weld, from its line of JSON. Its `text` is a sentence with the size and the remedy: chat programs
/// show it unchanged.
#[must_use]
pub(crate) fn body(event: Event, cell: &str, calibration: &str, watched_s: i64, line: &Value) -> Value {
    let weld = line["weld"].as_str().unwrap_or_default();
    let number = line["number"].as_i64().unwrap_or_default();
    let (alarm, within) = (&line["alarm"], &line["change_within_tolerance"]);
    let text = |of: &Value| of["text"].as_str().unwrap_or_default().to_owned();
    let text = match event {
        Event::Raised => format!("{cell}: ALARM. {}", text(alarm)),
        Event::Changed => format!("{cell}: The alarm has changed. {}", text(alarm)),
        Event::WithinTolerance => format!("{cell}: {}", text(within)),
        Event::Ended => match (line["good_since_number"].as_i64(), line["good_since"].as_str()) {
            (Some(good), Some(name)) => {
                format!("{cell}: The fault has been gone since {}.", numbered(good, name))
            }
            _ => format!(
                "{cell}: The alarm was cleared at {}: later welds do not confirm it.",
                numbered(number, weld)
            ),
        },
    };
    json!({
        "event": event.name(), "text": text, "cell": cell, "calibration": calibration, "weld": weld, "weld_number": number,
        "watched_unix_s": watched_s, "state": line["state"], "alarm": alarm, "change_within_tolerance": within,
    })
}

/// The message that a repair was reported: the next weld verifies it.
#[must_use]
pub(crate) fn repaired(cell: &str, calibration: &str, now_s: i64, before: i64) -> Value {
    let text = format!("{cell}: A repair before weld {before} is reported. The next welds will show it.");
    ended((cell, calibration), text, now_s, before)
}

/// The message that an alarm belongs to a calibration that is no longer in use.
#[must_use]
pub(crate) fn replaced(cell: &str, [old, new]: [&str; 2], now_s: i64, from: i64) -> Value {
    let text = format!("{cell}: {new} replaces {old} from weld {from} on. The alarm about {old} is closed.");
    ended((cell, new), text, now_s, from)
}

fn ended((cell, calibration): (&str, &str), text: String, now_s: i64, number: i64) -> Value {
    json!({
        "event": Event::Ended.name(), "text": text, "cell": cell, "calibration": calibration, "weld": null, "weld_number": number,
        "watched_unix_s": now_s, "state": "good", "alarm": null, "change_within_tolerance": null,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_difference_is_an_event() {
        let of = |kind: &str, is_within| Standing { kind: kind.to_owned(), is_within, is_another: false };
        let (timing, bracket, within) = (of("timing", false), of("bracket", false), of("timing", true));
        let again = Standing { is_another: true, ..timing.clone() };
        let between = |before: Option<&Standing>, now: Option<&Standing>| Event::between(before, now);
        assert_eq!(between(None, None), None);
        assert_eq!(between(None, Some(&timing)), Some(Event::Raised));
        assert_eq!(between(Some(&timing), Some(&timing)), None);
        assert_eq!(between(Some(&timing), Some(&again)), Some(Event::Changed));
        assert_eq!(between(Some(&timing), Some(&bracket)), Some(Event::Changed));
        assert_eq!(between(Some(&timing), Some(&within)), Some(Event::WithinTolerance));
        assert_eq!(between(None, Some(&within)), Some(Event::WithinTolerance));
        assert_eq!(between(Some(&within), Some(&within)), None);
        assert_eq!(between(Some(&within), Some(&timing)), Some(Event::Raised));
        assert_eq!(between(Some(&within), None), Some(Event::Ended));
    }
}
