//! Motion of the robot by the PC: limits, a path proved to keep them, and the gate that every command passes.

pub mod anchor;
pub mod checked_path;
pub mod cycle_clock;
pub mod derive_limits;
pub mod gate;
pub mod limits;
pub mod limits_file;
pub mod path_timing;
pub mod phase;
pub mod spline;
mod step_budget;
mod travel;

pub use checked_path::{CheckedPath, PathError, Reference};
pub use cycle_clock::ReceivedFrame;
pub use gate::{Gate, GateState, Input};
pub use limits::MotionLimits;
pub use phase::{EndReason, OperatorCommand, Phase};
