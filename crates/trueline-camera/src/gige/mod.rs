//! A GigE Vision camera: any maker's that follows the standard.

mod automatic;
mod block_ids;
mod camera;
mod chunks;
mod configure;
mod discovery;
mod errors;
mod features;
mod latch;
mod picture;
mod ptp;
mod scan3d;
mod settings;
mod stamps;
mod trigger;

pub use camera::{GigeCamera, GigeCounts};
pub use chunks::{Chunk, ChunkError, ChunkNames, chunks};
pub use discovery::{Adapter, FoundCamera, discover};
pub use ptp::PtpState;
pub use settings::GigeSettings;
