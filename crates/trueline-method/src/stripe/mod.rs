//! Whole stripes: both plates of the joint instead of the point where they meet.
//!
//! A straight stripe on a plate is two numbers: the offsets of two support points, measured perpendicular to the stripe. A frame has four such
//! residuals. If the plates do not meet, the edge point is a fifth. The seam is the intersection of the plates.
//!
//! ```text
//! Recording::stripes ─frames─▶ StripeFrame ─problem─▶ StripeProblem ─fit─▶ StripeFit ─plate_sights─▶ adjustment ─as_seam─▶ Parameters of the seam
//! ```
//!
//! Seam error, verdict and report follow as for seam points.

pub mod agreement;
pub(crate) mod as_seam;
pub(crate) mod blocks;
pub mod corners;
pub mod estimate;
pub mod fit;
pub mod flat_rank;
pub mod frame_residual;
pub(crate) mod frame_sums;
pub mod frames;
pub mod freed;
pub mod motion_information;
pub mod outcome;
pub mod outlier_counts;
pub mod planes;
pub(crate) mod plate_sights;
pub mod problem;
pub(crate) mod seam_of_straight_lines;
pub(crate) mod shown;
pub mod start;
pub mod state;
pub mod target;
pub mod unknowns;
pub mod weighed_frame;
pub mod whitening;

#[cfg(test)]
mod sight_tests;
