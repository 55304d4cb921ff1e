//! Where a live view is served.

use super::serve::address;
use clap::Args;
use std::net::SocketAddr;

/// A view in Foxglove or Lichtblick.
#[derive(Args)]
pub(crate) struct FoxgloveArgs {
    /// Serve a live view for Foxglove and Lichtblick (Foxglove WebSocket), for example --foxglove 8765: ws://127.0.0.1:8765 on this PC
    /// alone. With an address of this PC (IP:PORT) everybody who can reach it may look; nobody can change anything
    #[arg(long, value_name = "[IP:]PORT", value_parser = address, group = "uses_calibration")]
    pub(crate) foxglove: Option<SocketAddr>,
}
