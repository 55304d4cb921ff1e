//! Answers to a robot that waits for them.

use std::net::SocketAddr;

/// An answer that was sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotAnswer {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// To whom.
    pub to: SocketAddr,
    /// When, on the steady clock, ns.
    pub steady_ns: i64,
}
