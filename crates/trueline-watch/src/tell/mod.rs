//! Sends alarms: to a [`Receiver`], without losses by the [`Courier`].

mod address;
pub mod courier;
#[cfg(feature = "mqtt")]
mod mqtt;
pub mod pace;
pub mod receiver;
#[cfg(feature = "mqtt")]
mod topic_address;
#[cfg(feature = "webhook")]
mod webhook;

pub use address::at;
pub use courier::Courier;
pub use pace::Pace;
pub use receiver::{Receiver, ReceiverError};
