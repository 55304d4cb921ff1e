//! FANUC: High Speed Position Output, which a controller sends by itself, and Stream Motion, which it sends on
//! request.
//!
//! Both are only listened to. [`hspo`] and [`stream_motion`] read the packets; [`hspo_sim`] and [`stream_motion_sim`] are the
//! controller's side, simulated.

pub mod hspo;
pub mod hspo_sim;
pub mod signal;
pub mod stream_motion;
pub mod stream_motion_packets;
pub mod stream_motion_sim;
pub(crate) mod wrapping_clock;

pub use hspo::Hspo;
pub use signal::Signal;
pub use stream_motion::StreamMotion;

/// Port of Stream Motion controllers.
pub(crate) const STREAM_MOTION_PORT: u16 = 60015;
