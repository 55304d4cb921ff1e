//! A calibration of a stream that goes on: all samples at first, sums later.
//!
//! The first samples, and again whenever there are half as many more, are calibrated as a recording is. In between, and for
//! ever once the stream is longer than what is kept, new samples are linearised where that calibration ended and added to the
//! normal equations of all before: an update costs what is new, and memory is bounded. What the calibration decided (which stamps
//! to believe, drift, a bias of the features, noise) holds until the next; that the new samples still agree is tested. An even clock
//! behind the stamps is followed through all of them, and samples in the sums move with it.

mod bias;
mod block;
mod clocks;
mod even_clock;
mod innovation;
mod past;
mod stream;
mod sums;

pub use innovation::Change;
pub use past::Estimate;
pub use stream::{Extent, Incremental, Work};
