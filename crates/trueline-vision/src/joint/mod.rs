//! The joints: each file turns line segments into the seam point of one.

pub mod arm_pair;
pub mod butt;
pub mod corner;
pub mod corner_list;
pub mod edge;
pub mod end_face;
pub mod fillet;
pub mod groove;
pub mod lap;
pub mod plate_end;
pub mod step;
pub mod v_block;
pub mod v_groove;
