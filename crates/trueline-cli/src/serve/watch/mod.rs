//! Productions that are watched, as a page and as numbers for Prometheus.

mod evidence;
mod metrics;
mod page;
mod site;
mod view;

pub use site::WatchSite;
pub use view::CellView;
