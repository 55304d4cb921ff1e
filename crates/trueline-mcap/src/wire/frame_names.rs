//! Names of the frames in a recording of trueline, and how its frames are numbered.

/// Name of the frame of the robot's poses.
pub(crate) const BASE: &str = "base";
/// Name of the frame with the robot's pose.
pub(crate) const TOOL: &str = "tool";

/// The message counter has 32 bits, the camera's may have more.
pub(crate) fn low_bits(frame: u64) -> u32 {
    (frame & u64::from(u32::MAX)) as u32
}
