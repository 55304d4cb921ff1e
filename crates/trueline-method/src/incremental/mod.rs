//! A calibration of a stream that goes on: all samples at first, sums later.
//!
//! The first samples, and again whenever there are half as many more, are calibrated as a recording is. In between, and for
//! ever once the stream is longer than what is kept, new samples are linearised where that calibration ended and added to the
//! normal equations of all before: an update costs what is new, and memory is bounded. What the calibration decided (stamps,
//! drift, a bias of the features, noise) holds until the next; that the new samples still agree is tested.

mod bias;
mod block;
mod innovation;
mod past;
mod stream;
mod sums;

pub use innovation::Change;
pub use past::Estimate;
pub use stream::{Extent, Incremental, Work};
