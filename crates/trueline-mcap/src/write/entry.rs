//! Entries that can be recorded.

use std::net::SocketAddr;
use trueline_dataset::{Feature, FrameSignals};
use trueline_geometry::Pose;

/// One thing that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A pose reported by the robot.
    Robot(RobotEntry),
    /// A datagram came that is not used.
    Rejected(RejectedEntry),
    /// The robot was answered.
    Answer(AnswerEntry),
    /// Both clocks of the PC were read.
    Clock(ClockEntry),
    /// Something is worth telling.
    Note(NoteEntry),
    /// Digital inputs of the robot changed.
    Inputs(InputsEntry),
    /// The camera took a picture.
    Frame(FrameEntry),
    /// A profiler took a profile.
    Profile(ProfileEntry),
    /// Seam points reported by a sensor.
    Features(FeaturesEntry),
}

/// A point of a profile in a message: two numbers in double precision.
pub(crate) const POINT_BYTES: usize = 16;

impl Entry {
    /// Whether it contains data of the cell, not only of this PC.
    pub(crate) fn is_of_cell(&self) -> bool {
        !matches!(self, Self::Clock(_) | Self::Note(_))
    }

    /// Bytes of the picture or the profile in it.
    pub(crate) fn picture_bytes(&self) -> usize {
        match self {
            Self::Frame(frame) => frame.png.len(),
            Self::Profile(profile) => profile.columns.len() * POINT_BYTES,
            _ => 0,
        }
    }
}

/// A datagram or packet of the robot, and the pose in it.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotEntry {
    /// Whether it is EGM's, whose fields a schema describes to viewers. A note describes other protocols.
    pub is_egm: bool,
    /// As it came.
    pub datagram: Vec<u8>,
    /// The sender.
    pub from: SocketAddr,
    /// When it came by the steady clock, ns: the stamp that calibration uses.
    pub steady_ns: i64,
    /// When it came by the kernel's wall clock, ns since 1970, where the kernel stamps.
    pub kernel_wall_ns: Option<i64>,
    /// When it was read by the wall clock, ns since 1970.
    pub read_wall_ns: i64,
    /// Its number.
    pub sequence: u32,
    /// The controller's clock when the robot was there, ns.
    pub device_ns: i64,
    /// IEEE 1588 time when the robot was there, ns, where the controller is synchronised.
    pub ptp_ns: Option<i64>,
    /// Pose of the robot, m.
    pub base_from_tool: Pose,
}

/// A datagram that is not used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RejectedEntry {
    /// As it came.
    pub datagram: Vec<u8>,
    /// The sender.
    pub from: SocketAddr,
    /// When it came by the steady clock, ns.
    pub steady_ns: i64,
    /// Why it is not used.
    pub reason: String,
}

/// A datagram to the robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AnswerEntry {
    /// As it was sent.
    pub datagram: Vec<u8>,
    /// To whom.
    pub to: SocketAddr,
    /// When by the steady clock, ns.
    pub steady_ns: i64,
    /// Its number.
    pub sequence: u32,
}

/// Both clocks of the PC at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockEntry {
    /// The steady one, ns.
    pub steady_ns: i64,
    /// The wall clock, ns since 1970.
    pub wall_ns: i64,
}

/// How much a note matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoteLevel {
    /// A useful remark.
    Info,
    /// Something is not as it should be.
    Warning,
    /// Something failed.
    Error,
}

/// Text for people who read the recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoteEntry {
    /// When by the steady clock, ns.
    pub steady_ns: i64,
    /// How much it matters.
    pub level: NoteLevel,
    /// The words.
    pub text: String,
}

/// A change of the robot's digital inputs, between two of its packets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputsEntry {
    /// When the packet before the change and the first one after it came, by the steady clock, ns: the stamps of their poses.
    pub between_ns: [i64; 2],
    /// The controller's clock in both, ns.
    pub device_ns: [i64; 2],
    /// The inputs before and after it, the first in the lowest bit.
    pub bits: [u64; 2],
}

/// Status of a frame that came whole.
pub const COMPLETE: &str = "complete";

/// A frame of the camera with all its stamps.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameEntry {
    /// The camera's counter.
    pub frame: u64,
    /// The stamp that calibration uses, by the steady clock, ns.
    pub stamp_ns: i64,
    /// When its first packet came by the steady clock, ns, where known.
    pub first_packet_ns: Option<i64>,
    /// When it was complete by the steady clock, ns, where known.
    pub complete_ns: Option<i64>,
    /// The camera's own clock, ns, where known.
    pub device_ns: Option<i64>,
    /// Exposure time, µs, where known.
    pub exposure_us: Option<f64>,
    /// State of the camera's inputs with it.
    pub signals: FrameSignals,
    /// Whether it came whole, in the words of the camera's driver; [`COMPLETE`] if it did.
    pub status: String,
    /// The picture; empty if the frame was incomplete.
    pub png: Vec<u8>,
}

/// A whole profile.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileEntry {
    /// Counts profiles; a jump is a lost one.
    pub profile: u64,
    /// The stamp that calibration uses, by the steady clock, ns.
    pub stamp_ns: i64,
    /// Of each column the position along the stripe and the range, m; `None` without a return.
    pub columns: Vec<Option<[f64; 2]>>,
}

/// Seam points of one profile, or of one picture processed elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct FeaturesEntry {
    /// The points.
    pub features: Vec<Feature>,
}
