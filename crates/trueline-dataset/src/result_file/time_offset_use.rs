//! Use of the time offset, so that a file explains itself.

use serde::{Deserialize, Serialize};

/// How to use the time offset, in words and as programs.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct TimeOffsetUse {
    /// The rule: `true exposure = stamp − 17.663 ms`.
    pub rule: String,
    /// Where to enter it, and what voids it.
    pub advice: Vec<String>,
    /// A seam point in base, in Python.
    pub python: String,
    /// The same in C++.
    pub cpp: String,
    /// The same in RAPID.
    pub rapid: String,
}
