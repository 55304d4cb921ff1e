//! Motion of the robot by the PC: limits, a path proved to keep them, and the gate that every command passes.

pub mod anchor;
pub mod checked_path;
pub mod gate;
pub mod limits;
pub mod phase;
pub mod propose;
pub mod rhythm;
pub mod ride;
pub mod spline;

pub use checked_path::{CheckedPath, PathError, Reference};
pub use gate::{Gate, GateState, Input};
pub use limits::MotionLimits;
pub use phase::{Ending, Phase, Wish};
pub use rhythm::HeardFrame;
