//! From an address to the receiver there.

use super::receiver::{Receiver, ReceiverError};

/// The receiver at an address: `http://…` and `https://…` are told by POST, `mqtt://HOST:PORT/TOPIC` by publishing.
///
/// # Errors
/// An address of no known kind, or half of one.
pub fn at(address: &str) -> Result<Box<dyn Receiver>, ReceiverError> {
    match address.split_once("://").map(|(scheme, _)| scheme) {
        #[cfg(feature = "webhook")]
        Some("http" | "https") => Ok(Box::new(super::webhook::Webhook::at(address)?)),
        #[cfg(feature = "mqtt")]
        Some("mqtt") => Ok(Box::new(super::mqtt::Topic::at(address)?)),
        _ => Err(ReceiverError::Kind),
    }
}
