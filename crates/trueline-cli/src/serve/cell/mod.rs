//! A scan that is being recorded, as a page that is drawn as it grows.

mod growth;
mod page;
mod picture;
mod shown;
mod site;

pub use site::CellSite;
