//! Adjusts the unknowns and every systematic error together.
//!
//! | module | |
//! |---|---|
//! | `sights`, `seam_points` | what is asked of the sights of a scan: whitened frames with their Jacobians; the same for seam points |
//! | `neighbours` | motion of frames relative to their neighbours along the seam |
//! | `form`, `blocks` | errors as columns with an amplitude |
//! | `settings`, `expected` | the errors that are expected, as blocks and as consider parameters |
//! | `clamped` | the place of the part in each pass |
//! | `columns`, `table` | the order of the columns, and the rows of all frames |
//! | `coloured` | correlated noise, whitened by a filter |
//! | `noise_search` | the likeliest noise of a grid |
//! | `error_sizes` | the sizes of all errors, as a result states them |
//! | `known_before` | priors |
//! | `equations`, `amplitudes`, `weights` | solution, sizes of the blocks, weights of the frames |
//! | `adjust` | the rounds |
//! | `pose_noise` | the covariance by the information of the motion alone |
//! | `axis_step` | corrections of the external axes |
//! | `beyond_linear` | second-order uncertainty of a weak rotation |

pub(crate) mod adjust;
mod amplitudes;
pub mod answer;
pub mod axis_step;
mod beyond_linear;
mod blocks;
pub mod clamped;
pub mod coloured;
pub(crate) mod columns;
mod equations;
pub mod error_sizes;
pub(crate) mod expected;
pub(crate) mod form;
mod known_before;
mod neighbours;
mod noise_search;
pub(crate) mod pose_noise;
pub(crate) mod seam_points;
pub(crate) mod settings;
pub(crate) mod sights;
mod table;
pub(crate) mod weights;

#[cfg(test)]
mod column_tests;
#[cfg(test)]
mod equations_tests;
#[cfg(test)]
mod second_order_tests;
