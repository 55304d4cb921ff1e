//! Adjusts the unknowns and every systematic error together.
//!
//! | module | |
//! |---|---|
//! | `frames` | the whitened frames of the scan with their Jacobians |
//! | `neighbours` | motion of frames relative to their neighbours along the seam |
//! | `form`, `blocks` | errors as columns with an amplitude |
//! | `clamped` | the place of the part in each pass |
//! | `columns`, `table` | the order of the columns, and the rows of all frames |
//! | `coloured` | correlated noise, whitened by a filter |
//! | `noise_search` | the likeliest noise of a grid |
//! | `error_sizes` | the sizes of all errors, as a result states them |
//! | `equations`, `amplitudes`, `weights` | solution, sizes of the blocks, weights of the frames |
//! | `adjust` | the rounds |
//! | `axis_step` | corrections of the external axes |
//! | `beyond_linear` | second-order uncertainty of a weak rotation |

mod adjust;
mod amplitudes;
pub mod answer;
pub mod axis_step;
mod beyond_linear;
mod blocks;
pub mod clamped;
pub mod coloured;
mod columns;
mod equations;
pub mod error_sizes;
pub(crate) mod form;
mod frames;
mod neighbours;
mod noise_search;
mod table;
mod weights;

#[cfg(test)]
mod column_tests;
#[cfg(test)]
mod equations_tests;
#[cfg(test)]
mod second_order_tests;
