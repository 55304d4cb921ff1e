//! The detector, which may mistake something else for the seam. One error a file.

mod feature_noise;
mod gaps;
mod other_edge;
mod reflections;
mod shop_detector;
mod spatter;
mod stretches;

pub(crate) use feature_noise::sigma;
pub(crate) use shop_detector::{Detected, ShopDetector};
