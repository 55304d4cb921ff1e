//! Content of a message, from any program.

use crate::write::entry::InputsEntry;
use trueline_dataset::{Feature, FrameSignals, GrayImage};
use trueline_geometry::Pose;

/// Kind of a topic's messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A pose of something that has no name, in a frame that has one.
    Pose,
    /// Poses of named frames in named frames.
    Transforms,
    /// A picture.
    Picture,
    /// A whole profile of a laser profiler.
    Profile,
    /// Angles of a robot's joints.
    JointStates,
    /// Seam points.
    Features,
    /// Stamps of a frame of a camera.
    Frame,
    /// Changes of a robot's digital inputs.
    Inputs,
    /// Clocks of a datagram of a robot, and its external axes.
    RobotClocks,
    /// External axes in a packet of a robot that does not speak EGM.
    RobotPacket,
    /// Something else.
    Other,
}

/// A message that was understood.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// A pose.
    Pose(StampedPose),
    /// Transforms.
    Transforms(Vec<StampedTransform>),
    /// A picture.
    Picture(StampedPicture),
    /// A profile.
    Profile(StampedProfile),
    /// Angles of joints.
    JointStates(JointStates),
    /// Seam points.
    Features(Vec<Feature>),
    /// Stamps of a frame.
    Frame(FrameStamps),
    /// A change of a robot's digital inputs.
    Inputs(InputsEntry),
    /// Arrival of a robot's packet on the steady clock, ns, its IEEE 1588 time, ns, if it has one, and names and values of
    /// external axes in it, deg or mm.
    ExternalAxes(i64, Option<i64>, Vec<(String, f64)>),
    /// Something else.
    Other,
}

/// A pose in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct StampedPose {
    /// Stamp in the message, ns.
    pub stamp_ns: i64,
    /// The frame, without a leading slash.
    pub frame: String,
    /// `frame_from_it`, m.
    pub pose: Pose,
}

/// A frame in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct StampedTransform {
    /// Stamp in the message, ns.
    pub stamp_ns: i64,
    /// The outer frame, without a leading slash.
    pub parent: String,
    /// The inner frame, without a leading slash.
    pub child: String,
    /// Maps coordinates in the child to coordinates in the parent, m.
    pub parent_from_child: Pose,
}

/// A picture of a moment.
#[derive(Clone, Debug, PartialEq)]
pub struct StampedPicture {
    /// Stamp in the message, ns.
    pub stamp_ns: i64,
    /// The picture.
    pub picture: Picture,
    /// Form before the conversion to gray levels.
    pub origin: PictureOrigin,
}

/// Form of a picture before it was converted to gray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PictureOrigin {
    /// Gray levels, without losses.
    Gray,
    /// Colours: their luma counts.
    Colour,
    /// A colour filter's mosaic: the mean of its colours about each pixel counts.
    Mosaic,
    /// Compressed with losses.
    Jpeg,
}

/// A profile of a moment, in the profiler's sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct StampedProfile {
    /// Stamp in the message, ns.
    pub stamp_ns: i64,
    /// Its number, where the message has one.
    pub frame: Option<u64>,
    /// Its points: x along the stripe, z range, m.
    pub points: Vec<[f64; 2]>,
    /// Columns without a return.
    pub no_return: usize,
}

/// A picture as it was recorded.
#[derive(Clone, Debug, PartialEq)]
pub enum Picture {
    /// A gray PNG, to be passed on unchanged.
    Png(Vec<u8>),
    /// A JPEG or a PNG in colour: [`trueline_dataset::gray_picture`] makes gray levels of it.
    Compressed(Vec<u8>),
    /// Pixels.
    Gray(GrayImage),
}

/// Angles of joints.
#[derive(Clone, Debug, PartialEq)]
pub struct JointStates {
    /// Stamp in the message, ns.
    pub stamp_ns: i64,
    /// Names of the joints.
    pub names: Vec<String>,
    /// Their positions, rad or m.
    pub positions: Vec<f64>,
}

/// All stamps of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameStamps {
    /// The camera's counter.
    pub frame: u64,
    /// The stamp that calibration uses, ns.
    pub stamp_ns: i64,
    /// When its first packet came, ns, where known.
    pub first_packet_ns: Option<i64>,
    /// When it was complete, ns, where known.
    pub complete_ns: Option<i64>,
    /// The camera's own clock, ns, where known.
    pub device_ns: Option<i64>,
    /// Exposure time, µs, where known.
    pub exposure_us: Option<f64>,
    /// State of the camera's inputs with it.
    pub signals: FrameSignals,
    /// Whether it came whole.
    pub status: String,
    /// Bytes of its picture; none if it has no picture.
    pub picture_bytes: u64,
}
