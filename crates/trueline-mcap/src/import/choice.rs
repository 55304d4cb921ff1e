//! The user's choice about a recording.

use trueline_dataset::SensorFile;
use trueline_dataset::import::axis_columns::AxisColumn;

/// The user's choice; not needed if there is only one possibility.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Choice {
    /// The sensor; else the one in the recording.
    pub sensor: Option<SensorFile>,
    /// The topic with the robot's poses or transforms.
    pub pose_topic: Option<String>,
    /// The topic with the pictures.
    pub image_topic: Option<String>,
    /// The frame that stands still.
    pub base_frame: Option<String>,
    /// The frame of the robot's reported pose.
    pub tool_frame: Option<String>,
    /// The text of the robot's URDF, with which joint angles become poses.
    pub urdf: Option<String>,
    /// The clock that stamps.
    pub clock: StampClock,
    /// The code for no return in profiles, m.
    pub no_return_m: Option<f64>,
    /// External axes by the names of their joints.
    pub axes: Vec<AxisColumn>,
    /// Whether pictures that are compressed with losses are taken.
    pub allow_jpeg: bool,
}

/// By which clock robot and pictures are stamped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StampClock {
    /// As the recording has it.
    #[default]
    Recorded,
    /// IEEE 1588: the controller's PTP time and the camera's own clock, which has to follow the same master. For recordings of
    /// trueline.
    Ptp,
}
