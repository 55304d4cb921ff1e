//! The topics of a recording of trueline, with numbers that never change.
//!
//! A file lists its topics once, in its first chunk. If just that is damaged and the program was killed before it wrote the
//! summary, every message would be lost without a name. So the reader knows these numbers.

use foxglove::Encode;
use foxglove::messages::{CompressedImage, FrameTransform, Log, PointCloud};
use std::borrow::Cow;
use std::sync::{Arc, LazyLock};

/// The profile in the header of a recording of trueline.
pub(crate) const PROFILE: &str = "trueline";

/// The robot's pose: this one is read back.
pub(crate) const TF: u16 = 1;
/// The robot's datagrams as they came.
pub(crate) const ROBOT: u16 = 2;
/// Datagrams that are not used.
pub(crate) const REJECTED: u16 = 3;
/// Answers to the robot.
pub(crate) const ANSWER: u16 = 4;
/// Readings of both clocks.
pub(crate) const CLOCK: u16 = 5;
/// Notes.
pub(crate) const LOG: u16 = 6;
/// Pictures.
pub(crate) const IMAGE: u16 = 7;
/// Stamps of the frames.
pub(crate) const FRAME: u16 = 8;
/// Seam points.
pub(crate) const FEATURES: u16 = 9;
/// Packets of robots that do not speak EGM, as they came.
pub(crate) const PACKET: u16 = 10;
/// Whole profiles.
pub(crate) const POINTS: u16 = 11;
/// Changes of the robot's digital inputs.
pub(crate) const INPUTS: u16 = 12;

/// A topic with its schema. The schema has the number of the topic.
pub(crate) struct Topic {
    pub id: u16,
    pub name: &'static str,
    pub schema: String,
    pub descriptors: Cow<'static, [u8]>,
}

/// How messages are encoded, and their descriptors.
pub(crate) const ENCODING: &str = "protobuf";

/// A `FileDescriptorSet` with all of trueline's messages and what they use: viewers read a recording by it. `robot` is described as
/// an `abb.egm.EgmRobot`, which it is, and read as bytes, so that the datagram stays as it came.
const OWN_DESCRIPTORS: &[u8] = include_bytes!("../../proto/recording.bin");

/// All topics.
pub(crate) static TOPICS: LazyLock<Vec<Topic>> = LazyLock::new(|| {
    let own = |id, name, schema: &str| Topic {
        id,
        name,
        schema: format!("trueline.{schema}"),
        descriptors: OWN_DESCRIPTORS.into(),
    };
    vec![
        standard::<FrameTransform>(TF, "/tf"),
        own(ROBOT, "/robot/egm", "RobotDatagram"),
        own(REJECTED, "/robot/rejected", "RejectedDatagram"),
        own(ANSWER, "/robot/answer", "Answer"),
        own(CLOCK, "/clock", "Clock"),
        standard::<Log>(LOG, "/log"),
        standard::<CompressedImage>(IMAGE, "/camera/image"),
        own(FRAME, "/camera/frame", "Frame"),
        own(FEATURES, "/sensor/features", "Features"),
        own(PACKET, "/robot/packet", "RobotPacket"),
        standard::<PointCloud>(POINTS, "/sensor/profile"),
        own(INPUTS, "/robot/inputs", "Inputs"),
    ]
});

/// The name of a topic by its number; empty for one that is none of ours.
pub(crate) fn name(id: u16) -> &'static str {
    TOPICS.iter().find(|topic| topic.id == id).map_or("", |topic| topic.name)
}

pub(crate) fn standard<T: Encode>(id: u16, name: &'static str) -> Topic {
    let (schema, descriptors) =
        T::get_schema().map_or_else(Default::default, |schema| (schema.name, schema.data));
    Topic { id, name, schema, descriptors }
}

/// The meaning of a channel number in a recording of trueline that lost its own statement.
pub(crate) fn known_channel(id: u16) -> Option<Arc<mcap::Channel<'static>>> {
    let topic = TOPICS.iter().find(|topic| topic.id == id)?;
    let schema = mcap::Schema {
        id,
        name: topic.schema.clone(),
        encoding: ENCODING.to_owned(),
        data: topic.descriptors.clone(),
    };
    Some(Arc::new(mcap::Channel {
        id,
        topic: topic.name.to_owned(),
        schema: Some(Arc::new(schema)),
        message_encoding: ENCODING.to_owned(),
        metadata: Default::default(),
    }))
}
