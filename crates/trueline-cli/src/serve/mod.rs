//! Live pages over HTTP: a production that is watched, a scan that is being recorded, a cell's folder with its first scan step by step.
//!
//! ```text
//! state files ─▶ WatchSite ─────┐
//! robot, camera ─▶ CellSite ────┼─▶ LiveServer ─▶ browsers, Prometheus
//! cell's folder ─▶ FolderSite ──┘
//! ```
//!
//! Read-only: a site is a function from a path to a reply, and nothing that a client sends is kept. A page is complete
//! without a script. The one script, a file of its own, replaces the changed parts. Every reply forbids the browser to load
//! anything from elsewhere and to run scripts inside the page. Requests that name another host are refused ([`http`]).
//!
//! ```
//! use std::io::{Read, Write};
//! use std::net::TcpStream;
//! use std::sync::Arc;
//! use trueline_cli::serve::http::{Media, Reply};
//! use trueline_cli::serve::{Limits, LiveServer, Site};
//!
//! struct Gauge;
//!
//! impl Site for Gauge {
//!     fn paths(&self) -> &'static [&'static str] {
//!         &["/"]
//!     }
//!     fn reply(&self, _path: &str) -> Result<Reply, String> {
//!         Ok(Reply::text(Media::Html, "<p>12.00 ± 0.01 ms</p>"))
//!     }
//! }
//!
//! let server = LiveServer::start("127.0.0.1:0".parse()?, &[], Limits::default(), Arc::new(Gauge))?;
//! let mut browser = TcpStream::connect(server.address())?;
//! write!(browser, "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")?;
//! let mut reply = String::new();
//! browser.read_to_string(&mut reply)?;
//! assert!(reply.starts_with("HTTP/1.1 200") && reply.contains("12.00 ± 0.01 ms"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod cell;
pub mod folder;
pub mod html;
pub mod http;
pub mod trend;
pub mod watch;

pub use cell::CellSite;
pub use folder::FolderSite;
pub use http::{Limits, LiveServer, Prefix, ServeError, Site};
pub use watch::WatchSite;
