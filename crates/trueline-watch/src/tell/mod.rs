//! Tells others of alarms: who is told ([`Receiver`]), and how nothing of it is lost ([`Courier`]).

pub mod courier;
#[cfg(feature = "mqtt")]
mod mqtt;
pub mod receiver;
#[cfg(feature = "webhook")]
mod webhook;

pub use courier::Courier;
pub use receiver::{Receiver, ReceiverError};
