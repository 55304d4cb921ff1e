//! A cell's folder as pages under one address: a guided first scan, the recordings, the watch, and its history.

mod contents;
mod first_scan;
mod history;
mod recordings;
mod site;
mod step;

pub use site::FolderSite;
