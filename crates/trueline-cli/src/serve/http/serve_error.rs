//! Why nothing can be served.

use std::net::SocketAddr;

/// Why nothing can be served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address cannot be listened at.
    #[error("{address}: the web server cannot listen there: {source}")]
    Address {
        /// The address.
        address: SocketAddr,
        /// An error of the operating system.
        source: std::io::Error,
    },
    /// A thread or its event loop cannot be started.
    #[error("the web server cannot be started: {0}")]
    Start(std::io::Error),
    /// A name that no browser could send.
    #[error("{0:?} is not a host name (letters, digits, dots and hyphens, without a port)")]
    HostName(String),
}

impl ServeError {
    /// The remedy.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Address { .. } => {
                "name an address of this PC and a free port, for example 127.0.0.1:8080; port 0 takes a free one"
            }
            Self::Start(_) => "are there too many processes or open files?",
            Self::HostName(_) => "give the name of the PC in the page's address, for example cell-pc.example",
        }
    }
}
