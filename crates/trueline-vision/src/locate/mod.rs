//! Where there is a stripe: tiles that stand out → edgels → straight line segments.

pub mod binning;
pub mod edgel;
pub mod line_segment;
pub mod segment_parts;
pub mod tiles;
