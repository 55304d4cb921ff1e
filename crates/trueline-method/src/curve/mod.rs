//! Curved seams from nothing: time offset, hand-eye transform and an unknown curve in base, estimated together.
//!
//! ```text
//! Observations ─readings─▶ windows (each with a parabola of its own) ─order─▶ spline ─fit─▶ answer
//! ```
//!
//! The curve is a uniform cubic B-spline. Every control point is free in its two normal directions. Restricted maximum likelihood
//! determines the size of the prior on third differences. The prior would add information that the data do not contain, so rank
//! and ± are those of `seen`, never those of the posterior.
//!
//! If stripes on the surfaces beside the seam are recorded, `with_plates` begins at that answer and reads their support points instead of the seam
//! points. `unbent` explains how far those are off.

pub(crate) mod answer;
pub(crate) mod arrow;
pub(crate) mod cad;
pub(crate) mod clamped;
pub(crate) mod considered;
pub(crate) mod drift;
pub(crate) mod equations;
pub mod estimate;
pub(crate) mod fit;
pub(crate) mod graph;
pub(crate) mod improved;
pub(crate) mod joint;
pub(crate) mod knots;
pub(crate) mod motion;
pub(crate) mod moved;
pub(crate) mod order;
pub(crate) mod part;
pub(crate) mod passes;
pub(crate) mod placed;
pub(crate) mod plate_sight;
pub(crate) mod plates;
pub(crate) mod readings;
pub mod registration;
pub(crate) mod rivals;
pub(crate) mod robot;
pub(crate) mod rows;
pub(crate) mod seen;
pub(crate) mod sight;
pub(crate) mod smoothness;
pub(crate) mod solve;
pub(crate) mod spline;
pub(crate) mod starts;
#[cfg(test)]
mod tests;
pub(crate) mod unbent;
pub(crate) mod windows;
pub(crate) mod with_plates;
