//! The joints: each file turns line segments into the seam point of one.

pub mod arm_pair;
pub mod butt;
pub(crate) mod coloured_corner;
pub mod corner;
pub(crate) mod corner_list;
pub mod edge;
pub(crate) mod end_face;
pub mod fillet;
pub mod groove;
pub mod lap;
pub(crate) mod plain_corner;
pub mod plate_end;
pub mod step;
pub(crate) mod turn;
pub mod v_block;
pub(crate) mod v_groove;
