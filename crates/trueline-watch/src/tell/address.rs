//! From an address to the receiver there.

use super::receiver::{Receiver, ReceiverError};
use std::time::Duration;

/// The receiver at an address. `http://…` and `https://…` receive a POST, `mqtt://[USER@]HOST[:PORT]/TOPIC` and
/// `mqtts://…` a publication. One try takes no longer than `patience`. Keys of a topic follow a `?`:
/// `password-file=FILE` or `password-env=NAME`, and `ca=FILE`, the certificates to trust.
///
/// # Errors
/// An address of no known kind, or half of one; a password or a certificate that cannot be read.
#[cfg_attr(not(any(feature = "webhook", feature = "mqtt")), expect(unused_variables, reason = "no receiver"))]
pub fn at(address: &str, patience: Duration) -> Result<Box<dyn Receiver>, ReceiverError> {
    match address.split_once("://").map(|(scheme, _)| scheme) {
        #[cfg(feature = "webhook")]
        Some("http" | "https") => Ok(Box::new(super::webhook::Webhook::at(address, patience)?)),
        #[cfg(feature = "mqtt")]
        Some("mqtt" | "mqtts") => Ok(Box::new(super::mqtt::Topic::at(address, patience)?)),
        _ => Err(ReceiverError::Kind),
    }
}
