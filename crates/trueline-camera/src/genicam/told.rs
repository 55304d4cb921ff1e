//! Statements of a picture's chunks.

use super::chunks::{Chunk, ChunkNames};
use trueline_dataset::FrameSignals;

/// Statements of a picture's chunks.
#[derive(Default)]
pub(crate) struct Told {
    /// The camera's clock, which stands before that of the leader.
    pub ticks: Option<u64>,
    /// Exposure time, µs.
    pub exposure_us: Option<f64>,
    /// Encoder, lines, counter and number.
    pub signals: FrameSignals,
}

impl Told {
    /// Of chunks, by the camera's description of them.
    pub(crate) fn by(names: &ChunkNames, chunks: &[Chunk<'_>]) -> Self {
        Self {
            ticks: names.whole("ChunkTimestamp", chunks),
            exposure_us: names.number("ChunkExposureTime", chunks),
            signals: FrameSignals {
                encoder: names.signed("ChunkEncoderValue", chunks),
                lines: names.whole("ChunkLineStatusAll", chunks),
                counter: names.signed("ChunkCounterValue", chunks),
                camera_frame: names.whole("ChunkFrameID", chunks),
            },
        }
    }
}
