//! From an address to the receiver there.

use super::receiver::{Receiver, ReceiverError};
use std::time::Duration;

/// The receiver at an address: `http://…` and `https://…` receive messages by POST, `mqtt://HOST:PORT/TOPIC` by publishing; one try
/// takes no longer than `patience`.
///
/// # Errors
/// An address of no known kind, or half of one.
#[cfg_attr(
    not(any(feature = "webhook", feature = "mqtt")),
    expect(unused_variables, reason = "nobody can be told")
)]
pub fn at(address: &str, patience: Duration) -> Result<Box<dyn Receiver>, ReceiverError> {
    match address.split_once("://").map(|(scheme, _)| scheme) {
        #[cfg(feature = "webhook")]
        Some("http" | "https") => Ok(Box::new(super::webhook::Webhook::at(address, patience)?)),
        #[cfg(feature = "mqtt")]
        Some("mqtt") => Ok(Box::new(super::mqtt::Topic::at(address, patience)?)),
        _ => Err(ReceiverError::Kind),
    }
}
