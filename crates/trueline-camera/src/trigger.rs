//! Trigger of an exposure: the camera's own clock, or a signal on one of its inputs.

use std::str::FromStr;

/// Trigger of an exposure.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Trigger {
    /// The camera's own clock: all of its triggers are turned off.
    #[default]
    Off,
    /// The camera's present setting.
    AsSet,
    /// A signal on one of its inputs, a picture each; all other triggers are turned off.
    Input {
        /// The input by the camera's name for it: `Line1`, `Encoder0`, ….
        source: String,
        /// Which change of the signal; `None` leaves it as the camera is set.
        edge: Option<TriggerEdge>,
    },
}

/// A change of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TriggerEdge {
    /// It switches on.
    Rising,
    /// It goes off.
    Falling,
    /// Both.
    Any,
}

impl TriggerEdge {
    /// Name in the standard features naming convention.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Rising => "RisingEdge",
            Self::Falling => "FallingEdge",
            Self::Any => "AnyEdge",
        }
    }
}

/// Words that are not a trigger.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected off, as-set, or the camera's name of an input and, behind a colon, rising, falling or any")]
pub struct NotATrigger;

/// `off`, `as-set`, or the camera's name of an input and which change of it: `Line1`, `Line1:falling`.
impl FromStr for Trigger {
    type Err = NotATrigger;

    fn from_str(text: &str) -> Result<Self, NotATrigger> {
        let (source, edge) = match text.split_once(':') {
            Some((source, edge)) => (source, Some(edge.parse()?)),
            None => (text, None),
        };
        match (source, edge) {
            ("off", None) => Ok(Self::Off),
            ("as-set", None) => Ok(Self::AsSet),
            ("" | "off" | "as-set", _) => Err(NotATrigger),
            (source, edge) => Ok(Self::Input { source: source.to_owned(), edge }),
        }
    }
}

impl FromStr for TriggerEdge {
    type Err = NotATrigger;

    fn from_str(text: &str) -> Result<Self, NotATrigger> {
        match text {
            "rising" => Ok(Self::Rising),
            "falling" => Ok(Self::Falling),
            "any" => Ok(Self::Any),
            _ => Err(NotATrigger),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trigger_is_a_word_or_an_input_with_its_change() {
        let input = |edge| Trigger::Input { source: "Line1".to_owned(), edge };
        for (text, expected) in [
            ("off", Trigger::Off),
            ("as-set", Trigger::AsSet),
            ("Line1", input(None)),
            ("Line1:rising", input(Some(TriggerEdge::Rising))),
            ("Line1:falling", input(Some(TriggerEdge::Falling))),
            ("Line1:any", input(Some(TriggerEdge::Any))),
        ] {
            assert_eq!(text.parse(), Ok(expected), "{text}");
        }
        for wrong in ["", ":rising", "off:rising", "as-set:any", "Line1:", "Line1:up"] {
            assert_eq!(wrong.parse::<Trigger>(), Err(NotATrigger), "{wrong}");
        }
    }
}
