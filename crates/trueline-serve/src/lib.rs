//! Live pages over HTTP: a production that is watched, a scan that is being recorded.
//!
//! ```text
//! state files ─▶ WatchSite ─┐
//!                           ├─▶ LiveServer ─▶ browsers, Prometheus
//! robot, camera ─▶ CellSite ┘
//! ```
//!
//! Read-only: a site is a function from a path to a reply, and nothing that a client sends is kept. A page is whole without a
//! script; the one script there is, a file of its own, replaces what has changed. Every reply forbids the browser to load anything
//! from elsewhere and to run anything that stands in the page. Requests that name another host are refused ([`http`]).

pub mod cell;
pub mod html;
pub mod http;
pub mod trend;
pub mod watch;

pub use cell::CellSite;
pub use http::{Limits, LiveServer, ServeError, Site};
pub use watch::WatchSite;
