//! External axes: their places, estimated with time offset, hand-eye transform and lines, from one scan and without a
//! guess.
//!
//! | module | |
//! |---|---|
//! | `start` | attitudes, offsets and directions on a grid, with a linear problem each |
//! | `refine` | all unknowns of the best of them, robustly |
//! | `finding` | what is said of an axis |
//!
//! [`crate::calibrate`] calibrates about these, and again until the axes stay where they are.

pub mod finding;
pub(crate) mod refine;
pub(crate) mod scan;
pub(crate) mod start;
pub(crate) mod state;
