//! Universal Robots' RTDE: the PC connects to port 30004, asks for fields by name, and gets them at up to 500 Hz.
//!
//! [`session`] is the PC's side as a function of bytes, [`source`] puts it on a socket. [`controller`] and [`server`] are the
//! other side, simulated.

pub mod controller;
pub mod server;
pub mod session;
pub mod source;
pub mod variables;
pub mod wire;

pub use server::{RtdeServer, ServerSettings};
pub use source::RtdeSource;

/// Port of controllers.
pub const PORT: u16 = 30004;
