//! The robot in short, for a display.

use std::fmt;
use trueline_geometry::Pose;
use trueline_live::StreamBrief;

/// The robot in short; its `Display` is that of its stream.
#[derive(Clone, Copy, Debug, Default)]
pub struct RobotBrief {
    /// Its stream.
    pub link: StreamBrief,
    /// Good poses so far.
    pub poses: u64,
    /// The last one, `base_from_tool`.
    pub base_from_tool: Option<Pose>,
}

impl fmt::Display for RobotBrief {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.link.fmt(f)
    }
}
