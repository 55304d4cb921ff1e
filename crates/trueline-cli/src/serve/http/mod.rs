//! A small read-only web server.

mod guard;
mod headers;
mod prefix;
mod reply;
mod serve_error;
mod server;

pub use prefix::Prefix;
pub use reply::{Media, Reply, Site};
pub use serve_error::ServeError;
pub use server::{Limits, LiveServer};
