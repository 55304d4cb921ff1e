//! The input that Stream Motion 3 and 4 are asked to report, as FANUC's own driver asks (fanuc_driver 2.2.0); never tried on a
//! controller.

use super::stream_motion_packets::{SIGNALS, words};
use std::fmt;
use std::str::FromStr;

/// Entries of a request for signals.
const ENTRIES: usize = 32;
/// Words of an entry: action, type, first number, count.
const WORDS: usize = 4;
/// To report states, in place of taking commands.
const STATE: u32 = 2;

/// One digital input of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signal {
    kind: Kind,
    /// Counted from 1.
    number: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// `DI`: of the controller.
    Digital,
    /// `RI`: at the arm.
    Robot,
}

/// Not the name of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an input of FANUC is DI or RI and its number, for example DI101")]
pub struct NoSignal;

impl Signal {
    /// Asks a controller of a version to report this input, alone, in the lowest bit.
    #[must_use]
    pub(crate) fn request(self, version: u32) -> Vec<u8> {
        let kind = match self.kind {
            Kind::Digital => 1,
            Kind::Robot => 3,
        };
        let mut request = vec![SIGNALS, version, STATE, kind, self.number, 1];
        // Unused entries start at 1 and have no length.
        request.extend([0, 0, 1, 0].repeat(ENTRIES - 1));
        debug_assert_eq!(request.len(), 2 + ENTRIES * WORDS);
        words(&request)
    }
}

impl FromStr for Signal {
    type Err = NoSignal;

    fn from_str(text: &str) -> Result<Self, NoSignal> {
        let (kind, number) = text.split_at_checked(2).ok_or(NoSignal)?;
        let kind = match kind {
            "DI" | "di" => Kind::Digital,
            "RI" | "ri" => Kind::Robot,
            _ => return Err(NoSignal),
        };
        let is_plain = number.bytes().all(|byte| byte.is_ascii_digit());
        let number = number.parse().ok().filter(|number| *number > 0 && is_plain).ok_or(NoSignal)?;
        Ok(Self { kind, number })
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            Kind::Digital => "DI",
            Kind::Robot => "RI",
        };
        write!(f, "{kind}[{}]", self.number)
    }
}
