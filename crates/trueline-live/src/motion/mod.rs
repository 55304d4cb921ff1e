//! Motion of the robot by the PC: limits, a path proved to keep them, and the gate that every command passes.

mod anchor;
mod checked_path;
mod cycle_clock;
pub mod derive_limits;
mod gate;
pub mod limits;
pub mod limits_file;
mod path_summary;
mod path_timing;
mod phase;
mod spline;
mod step_budget;
mod travel;

pub use checked_path::{CheckedPath, Extremes, PathError, Reference};
pub use cycle_clock::ReceivedFrame;
pub use gate::{Gate, GateState, Input};
pub use limits::MotionLimits;
pub use path_summary::PathSummary;
pub use path_timing::{PathState, Ramp};
pub use phase::{EndReason, OperatorCommand, Phase};
