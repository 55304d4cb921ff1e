//! Whether a calibration can be accepted: facts with a code, values and a sentence each.

mod limits;
pub(crate) mod mistake;
mod quantity;
mod reason;
mod reason_words;
mod reject;
mod sensor_words;
mod stepped_stretch;
mod stream_name;
mod warn;
mod warning;
mod warning_words;

pub(crate) use mistake::residuals_are_too_large;
pub use quantity::{Axis, Quantity};
pub use reason::{Answer, Reason};
pub use stream_name::StreamName;
pub use warning::Warning;

use crate::findings::Findings;

/// Whether the result can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Yes.
    Accepted,
    /// There is a result, but see the reasons.
    NotAccepted,
}

/// The verdict on what was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Why the result cannot be accepted; empty if it can.
    pub reasons: Vec<Reason>,
    /// Warnings.
    pub warnings: Vec<Warning>,
}

impl Verdict {
    /// Whether it can be accepted: nothing speaks against it.
    #[must_use]
    pub fn status(&self) -> Status {
        if self.reasons.is_empty() { Status::Accepted } else { Status::NotAccepted }
    }
}

/// Judges what was found.
#[must_use]
pub fn of(findings: &Findings) -> Verdict {
    Verdict { reasons: reject::reasons(findings), warnings: warn::warnings(findings) }
}
