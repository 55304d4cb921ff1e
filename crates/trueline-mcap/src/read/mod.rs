//! Files → items: MCAP and rosbag2, cut off or damaged, as far as they can be trusted.

pub(crate) mod bag;
mod bag_files;
pub(crate) mod bag_item;
pub mod chunk;
pub(crate) mod damage;
mod inner_lengths;
pub(crate) mod log_reader;
pub(crate) mod place;
#[cfg(feature = "rosbag2")]
mod sqlite_bag;
mod summary;
pub(crate) mod survey;
