//! A GigE Vision camera: any maker's that follows the standard.

mod block_ids;
mod camera;
mod discovery;
mod errors;
mod features;
mod latch;
mod picture;
mod ptp;
mod settings;
mod stamps;

pub use camera::{GigeCamera, GigeCounts};
pub use discovery::{Adapter, FoundCamera, discover};
pub use ptp::PtpState;
pub use settings::GigeSettings;
