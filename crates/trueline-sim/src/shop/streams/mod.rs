//! When packets and images arrive and how they are stamped. One error a file.

mod arrivals;
mod image_clock;
mod late_packets;
mod lost_packets;
mod millisecond_stamps;
mod stalls;

pub(crate) use arrivals::{Arrivals, Stream};
pub(crate) use image_clock::ImageClock;
