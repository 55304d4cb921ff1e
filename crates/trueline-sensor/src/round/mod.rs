//! Time offset, hand-eye transform and a sphere or cylinder, from the arcs that it leaves in profiles.
//!
//! ```text
//! points of a profile ──arc──▶ points of the target ──cut──▶ points with their noise, polynomials along them
//!                                                              │
//!              offsets × attitudes ──start──▶ starts ──problem─┴──▶ the best, its rival, what is hidden ([`estimate`])
//! ```
//!
//! A point is off by its distance from the sphere's centre or the cylinder's axis, less the radius. No circle or ellipse is fitted in between: a short
//! arc knows its own numbers badly, and their errors are not normal. Circles only lead to the starts.
//!
//! The sheet may lie on either side of a sphere's centre, and may lean against a cylinder's axis to either side. Each profile alone looks the same; both
//! are tried, and the motion decides. A [`target`] is a row of a table.
//!
//! All else is that of pose sightings ([`crate::board_hand_eye`]): chain, robot noise, hidden directions.

pub mod arc;
pub mod cut;
pub mod estimate;
pub mod held_out;
mod look;
pub mod model;
pub(crate) mod problem;
pub mod sheet_frame;
mod start;
mod stop_noise;
pub mod target;

pub use cut::Cut;
pub use estimate::{RoundFit, RoundOptions, calibrate};
pub use model::RoundState;
pub use target::RoundTarget;
