//! GenICam for all wires: features by name, how they are set, and the data of a picture.

mod attended;
mod automatic;
mod chunks;
mod configure;
mod features;
mod latch;
mod refusal;
mod scan3d;
mod session;
mod told;
mod trigger;

pub(crate) use attended::{Attended, next_picture, waiting_pictures};
pub(crate) use automatic::Watch;
pub use chunks::{Chunk, ChunkError, ChunkNames, ChunkOrder, chunks};
pub(crate) use features::{Features, exposure_us, size};
pub(crate) use latch::{Asked, Latch, Latched};
#[cfg(feature = "u3v")]
pub(crate) use refusal::RefusedBy;
pub(crate) use refusal::{Refusal, driver, is_silence};
pub(crate) use session::{Seen, Session, begin};
pub(crate) use told::Told;
