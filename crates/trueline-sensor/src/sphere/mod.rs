//! Time offset, hand-eye transform and the centre of a sphere, from the arcs that it leaves in profiles.
//!
//! ```text
//! points of a profile ──arc──▶ points of the sphere ──cut──▶ circle: centre and radius in the sheet, with their covariance
//!                                                              │
//!              offsets × attitudes ──start──▶ starts ──problem─┴──▶ the best, its rival, what is hidden ([`estimate`])
//! ```
//!
//! The sheet cuts a sphere of radius R in a circle. Its centre is the sphere's, laid into the sheet. Its radius ρ gives the distance of the
//! sphere's centre from the sheet, √(R² − ρ²), but not the side. The residual of ρ holds for both sides, and the motion decides.
//! All else is that of pose sightings ([`crate::board_hand_eye`]): chain, robot noise, hidden directions.

pub mod arc;
pub mod cut;
pub mod estimate;
pub mod held_out;
pub mod model;
pub(crate) mod problem;
mod start;

pub use cut::Cut;
pub use estimate::{SphereFit, SphereOptions, calibrate};
pub use model::SphereState;
