//! External axes: their places, estimated with time offset, hand-eye transform and lines, from one scan and without a
//! guess.
//!
//! | module | |
//! |---|---|
//! | `start` | attitudes, offsets and directions on a grid, with a linear problem each |
//! | `refine` | all unknowns of the best of them, by a robust fit |
//! | `finding` | the estimate of an axis |
//!
//! [`crate::calibrate()`] calibrates about these axes, and repeats until they no longer move.

pub mod finding;
pub(crate) mod refine;
pub(crate) mod scan;
pub(crate) mod start;
pub(crate) mod state;

pub use scan::runs_evenly;
