//! Why there is no live view.

use std::net::SocketAddr;

/// Why viewers cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum LiveViewError {
    /// The address is not this PC's, or another program has it.
    #[error("cannot listen at {address}: {why}")]
    Bind {
        /// The address.
        address: SocketAddr,
        /// In the words of the operating system.
        why: String,
    },
    /// There is no thread to be had.
    #[error("no thread can be started: {0}")]
    Thread(#[from] std::io::Error),
    /// The foxglove crate refused a channel.
    #[error("no channel `{topic}`: {why}")]
    Channel {
        /// Its topic.
        topic: String,
        /// In the words of the foxglove crate.
        why: String,
    },
}

impl LiveViewError {
    /// Remedy.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Bind { .. } => "name an address of this PC and a port that no other program uses",
            Self::Thread(_) => "end other programs",
            Self::Channel { .. } => "please report this",
        }
    }
}
