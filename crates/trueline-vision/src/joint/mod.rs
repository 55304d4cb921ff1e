//! The joints: each file turns line segments into the seam point of one.

pub mod butt;
pub mod corner;
pub mod end_face;
pub mod fillet;
pub mod lap;
pub mod plate_end;
pub mod v_groove;
