//! Calibration of a continuing stream: from all samples at first, then from sums.
//!
//! The first samples are calibrated like a recording, and again whenever their number has grown by half. In between, and always when the stream is
//! longer than the kept part, new samples are linearised at the result of that calibration and added to the normal equations. The cost of an update
//! is that of the new samples, and memory is bounded. The decisions of the calibration (stamps, drift, a bias of the features, noise) hold until the
//! next one, and the agreement of new samples is tested. A regular clock behind the stamps is followed through all of them, and samples in the sums
//! move with it.

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
