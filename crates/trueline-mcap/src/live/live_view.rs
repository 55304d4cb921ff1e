//! The server of a live view.

use super::channels::LiveChannels;
use super::live_view_error::LiveViewError;
use foxglove::{Context, FoxgloveError, WebSocketServerHandle};
use std::net::SocketAddr;
use tokio::runtime::{Builder, Runtime};

/// Messages that wait for a viewer at most. A picture has a megabyte or two, so a viewer that stalls takes some 100 MB.
const BACKLOG: usize = 64;

/// Serves viewers as long as it lives, in one thread of its own.
pub struct LiveView {
    address: SocketAddr,
    channels: LiveChannels,
    server: Option<WebSocketServerHandle>,
    // The last field: what it runs ends first.
    _runtime: Runtime,
}

impl LiveView {
    /// Listens at one address, and nowhere else; port 0 takes one that is free. `name` is what viewers show.
    ///
    /// # Errors
    /// An address that cannot be listened at, or no thread to be had.
    pub fn start(address: SocketAddr, name: &str) -> Result<Self, LiveViewError> {
        let runtime =
            Builder::new_multi_thread().worker_threads(1).thread_name("live-view").enable_all().build()?;
        let context = Context::new();
        let channels = LiveChannels::of(context.clone())?;
        let host = match address {
            SocketAddr::V4(v4) => v4.ip().to_string(),
            SocketAddr::V6(v6) => format!("[{}]", v6.ip()),
        };
        let start = async {
            // Within the runtime, which the server takes then.
            let server = context.websocket_server().name(name).capabilities([]);
            server.message_backlog_size(BACKLOG).bind(host, address.port()).start().await
        };
        let server = runtime.block_on(start).map_err(|error| {
            let why = match error {
                FoxgloveError::Bind(error) => error.to_string(),
                other => other.to_string(),
            };
            LiveViewError::Bind { address, why }
        })?;
        let address = SocketAddr::new(address.ip(), server.port());
        Ok(Self { address, channels, server: Some(server), _runtime: runtime })
    }

    /// Where it listens.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Viewers that are connected.
    #[must_use]
    pub fn viewers(&self) -> usize {
        self.server.as_ref().map_or(0, WebSocketServerHandle::client_count)
    }

    /// Where messages are published.
    #[must_use]
    pub fn channels(&self) -> LiveChannels {
        self.channels.clone()
    }
}

impl Drop for LiveView {
    fn drop(&mut self) {
        // Viewers that do not answer are not waited for.
        if let Some(server) = self.server.take() {
            drop(server.stop());
        }
    }
}
