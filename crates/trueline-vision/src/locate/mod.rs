//! Where there is a stripe: tiles that stand out → edgels → straight line segments.

pub mod binning;
pub(crate) mod edgel;
pub mod line_segment;
pub(crate) mod segment_parts;
pub mod tiles;
