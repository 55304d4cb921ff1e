//! Decides whether a calibration can be accepted. Each fact has a code, values and a sentence.

mod hidden_axis;
mod limits;
pub(crate) mod mistake;
mod quantity;
mod reason;
mod reason_words;
mod reject;
mod sensor_words;
pub(crate) mod stepped_stretch;
mod stream_name;
mod usable;
mod warn;
mod warning;
mod warning_words;

pub use hidden_axis::hidden_of_axis;
pub(crate) use limits::NOISE_FACTOR;
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

/// The verdict on the findings.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Reasons against acceptance. Empty if the result is accepted.
    pub reasons: Vec<Reason>,
    /// Warnings.
    pub warnings: Vec<Warning>,
}

impl Verdict {
    /// The status: accepted without reasons against it.
    #[must_use]
    pub fn status(&self) -> Status {
        if self.reasons.is_empty() { Status::Accepted } else { Status::NotAccepted }
    }
}

/// Judges the findings.
#[must_use]
pub fn of(findings: &Findings) -> Verdict {
    Verdict { reasons: reject::reasons(findings), warnings: warn::warnings(findings) }
}
