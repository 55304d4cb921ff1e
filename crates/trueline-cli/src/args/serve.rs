//! Address of a live page.

use clap::Args;
use std::net::{Ipv4Addr, SocketAddr};

/// A page in the browser.
#[derive(Args)]
pub(crate) struct ServeArgs {
    /// Serve a live page, for example --serve 8080: http://127.0.0.1:8080/ on this PC alone. With an address of this PC
    /// (IP:PORT) everybody who can reach it may read; nobody can change anything
    #[arg(long, value_name = "[IP:]PORT", value_parser = address)]
    pub(crate) serve: Option<SocketAddr>,
    /// A name by which browsers may ask for the page, beside literal addresses and localhost; may be repeated
    #[arg(long, value_name = "NAME", requires = "serve")]
    pub(crate) serve_name: Vec<String>,
}

/// A port of this PC alone, or an address and a port.
pub(super) fn address(text: &str) -> Result<SocketAddr, String> {
    if let Ok(port) = text.parse::<u16>() {
        return Ok(SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
    }
    text.parse().map_err(|_| "expected a port (8080: this PC alone) or IP:PORT (192.168.1.7:8080)".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_alone_is_this_pc_alone() {
        assert!(address("8080").is_ok_and(|a| a.ip().is_loopback() && a.port() == 8080));
        assert!(address("192.168.1.7:80").is_ok_and(|a| !a.ip().is_loopback()));
        assert!(address("[::1]:80").is_ok_and(|a| a.ip().is_loopback()));
        for wrong in ["", "cell-pc:80", "192.168.1.7", "70000", "http://1.2.3.4:80"] {
            assert!(address(wrong).is_err(), "{wrong}");
        }
    }
}
