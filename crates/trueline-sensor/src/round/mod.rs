//! Time offset, hand-eye transform and a sphere or cylinder, from its arcs in profiles.
//!
//! ```text
//! points of a profile ──arc──▶ points of the target ──cut──▶ circle, or five points of an ellipse, with their covariance
//!                                                              │
//!              offsets × attitudes ──start──▶ starts ──problem─┴──▶ the best, its rival, what is hidden ([`estimate`])
//! ```
//!
//! The sheet cuts a sphere of radius R in a circle. The circle's centre is the projection of the sphere's centre onto the sheet.
//! Its radius ρ gives the distance of the sphere's centre from the sheet, √(R² − ρ²), but not the side. The residual of ρ is the
//! same for both sides, and the motion decides.
//!
//! The sheet cuts a cylinder in an ellipse. The ellipse gives the point where the axis pierces the sheet, and the angle between
//! axis and sheet. A [`target`] is a row of a table.
//!
//! Everything else is as for pose sightings ([`crate::board_hand_eye`]): chain, robot noise, unobservable directions.

pub mod arc;
mod conic;
pub mod cut;
pub mod estimate;
pub mod held_out;
mod look;
pub mod model;
pub(crate) mod problem;
mod start;
pub mod target;

pub use cut::Cut;
pub use estimate::{RoundFit, RoundOptions, calibrate};
pub use model::RoundState;
pub use target::RoundTarget;
