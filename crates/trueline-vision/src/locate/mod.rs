//! Finds stripes: tiles that stand out → edgels → straight line segments.

pub mod binning;
pub(crate) mod edgel;
pub mod line_segment;
pub(crate) mod ridge_edgel;
pub(crate) mod segment_parts;
pub(crate) mod short_arm;
pub mod tiles;
