//! The joints: each file turns line segments into the seam point of one.

pub mod arm_pair;
pub mod butt;
pub mod corner;
pub mod edge;
pub mod end_face;
pub mod fillet;
pub mod lap;
pub mod plate_end;
pub mod v_groove;
