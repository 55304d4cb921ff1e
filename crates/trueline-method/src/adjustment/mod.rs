//! One adjustment of the unknowns and of every error that is not noise.
//!
//! | module | |
//! |---|---|
//! | `frames` | the scan's frames, whitened, with all that moves them |
//! | `neighbours` | what frames do beyond those near them along the seam |
//! | `form`, `blocks` | errors as columns with an amplitude |
//! | `columns`, `table` | the order of the columns, and the rows of all frames |
//! | `coloured` | noise that lasts, filtered out of the rows |
//! | `equations`, `amplitudes`, `weights` | solution, sizes of the blocks, what counts |
//! | `adjust` | the rounds |
//! | `axis_step` | what is said of external axes |
//! | `beyond_linear` | the second order where a rotation is hardly shown |

mod adjust;
mod amplitudes;
pub mod answer;
pub mod axis_step;
mod beyond_linear;
mod blocks;
pub mod coloured;
mod columns;
mod equations;
mod form;
mod frames;
mod neighbours;
mod table;
mod weights;

#[cfg(test)]
mod column_tests;
#[cfg(test)]
mod equations_tests;
#[cfg(test)]
mod second_order_tests;
