//! External axes: where they are, beside time offset, hand-eye transform and lines, from one scan and without a guess.
//!
//! | module | |
//! |---|---|
//! | `start` | attitudes, offsets and directions on a grid, with a linear problem each |
//! | `refine` | all unknowns of the best of them, robustly |
//! | `estimate` | the calibration about these, repeated until the axes stay where they are |
//! | `finding` | what is said of an axis |

pub(crate) mod estimate;
pub mod finding;
mod refine;
mod scan;
mod start;
mod state;
