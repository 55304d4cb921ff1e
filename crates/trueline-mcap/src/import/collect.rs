//! The second pass over a recording: the chosen data are extracted.

use crate::import::axes::AxisJoints;
use crate::import::choice::{Choice, StampClock};
use crate::import::chosen::{Chosen, OWN_POSES, RobotSource};
use crate::import::stored_picture::{MessageType, StoredPicture};
use crate::import::transform_chain::Samples;
use crate::import_error::ImportError;
use crate::message::content::{
    Content, FrameStamps, JointStates, Kind, PictureOrigin, StampedPicture, StampedPose, StampedProfile,
    StampedTransform,
};
use crate::message::content_error::ContentError;
use crate::message::decode::{decode, kind};
use crate::message::stamp;
use crate::read::bag_item::{BagItem, BagMessage};
use crate::read::survey::is_static_topic;
use crate::wire::frame_names::{BASE, TOOL};
use crate::write::entry::InputsEntry;
use std::collections::{BTreeMap, HashMap};
use trueline_dataset::{Feature, RobotSample};

/// Data extracted so far.
pub(super) struct Collector<'a> {
    chosen: &'a Chosen,
    is_own: bool,
    clock: StampClock,
    allow_jpeg: bool,
    keeps_profiles: bool,
    numbers: HashMap<String, u64>,
    base: Option<String>,
    pub robot: Vec<RobotSample>,
    /// Messages of joints that are not the arm's.
    pub of_other_joints: usize,
    /// Of each step of the chain.
    pub transforms: Vec<Samples>,
    pub pictures: Vec<StoredPicture>,
    /// Pictures by their form.
    pub origins: BTreeMap<PictureOrigin, usize>,
    pub profiles: Vec<StampedProfile>,
    pub picture_types: Vec<MessageType>,
    pub frames: Vec<FrameStamps>,
    pub features: Vec<Feature>,
    /// Changes of the robot's digital inputs.
    pub inputs: Vec<InputsEntry>,
    /// External axes.
    pub axes: AxisJoints<'a>,
    /// IEEE 1588 time of the robot's datagrams by their steady stamp, ns both; collected only if these are the
    /// stamps.
    pub ptp_ns: HashMap<i64, i64>,
}

impl<'a> Collector<'a> {
    pub(super) fn new(chosen: &'a Chosen, is_own: bool, choice: &'a Choice, keeps_profiles: bool) -> Self {
        let (steps, base) = match &chosen.robot {
            RobotSource::Chain(chain) => (chain.steps.len(), None),
            RobotSource::Poses { base, .. } => (0, base.clone()),
            RobotSource::Own | RobotSource::Joints { .. } => (0, None),
        };
        Self {
            chosen,
            is_own,
            clock: choice.clock,
            allow_jpeg: choice.allow_jpeg,
            keeps_profiles,
            numbers: HashMap::new(),
            base,
            robot: Vec::new(),
            of_other_joints: 0,
            transforms: vec![Vec::new(); steps],
            pictures: Vec::new(),
            origins: BTreeMap::new(),
            profiles: Vec::new(),
            picture_types: Vec::new(),
            frames: Vec::new(),
            features: Vec::new(),
            inputs: Vec::new(),
            axes: AxisJoints::new(&choice.axes),
            ptp_ns: HashMap::new(),
        }
    }

    pub(super) fn add(&mut self, item: BagItem<'_>) -> Result<(), ImportError> {
        match item {
            BagItem::Message(message) if self.is_wanted(&message) => self.add_message(&message),
            _ => Ok(()),
        }
    }

    fn is_wanted(&self, message: &BagMessage<'_>) -> bool {
        match kind(message.schema, message.encoding) {
            Kind::Pose => {
                matches!(&self.chosen.robot, RobotSource::Poses { topic, .. } if topic == message.topic)
            }
            Kind::Transforms => match &self.chosen.robot {
                RobotSource::Own => message.topic == OWN_POSES,
                RobotSource::Poses { .. } | RobotSource::Joints { .. } => false,
                RobotSource::Chain(chain) => {
                    let only = chain.only.as_deref();
                    only.is_none_or(|only| only == message.topic || is_static_topic(message.topic))
                }
            },
            Kind::Picture => self.chosen.pictures.as_deref() == Some(message.topic),
            Kind::Profile => self.keeps_profiles && self.chosen.profiles.as_deref() == Some(message.topic),
            Kind::Features | Kind::Frame | Kind::Inputs => true,
            Kind::RobotClocks => self.clock == StampClock::Ptp || self.axes.are_asked(),
            Kind::RobotPacket => self.axes.are_asked(),
            Kind::JointStates => self.has_robot(message.topic) || self.axes.are_asked(),
            Kind::Other => false,
        }
    }

    /// Whether the robot's joints are in a topic.
    fn has_robot(&self, topic: &str) -> bool {
        matches!(&self.chosen.robot, RobotSource::Joints { topic: own, .. } if own == topic)
    }

    fn add_message(&mut self, message: &BagMessage<'_>) -> Result<(), ImportError> {
        let number = self.numbers.entry(message.topic.to_owned()).or_default();
        *number += 1;
        match decoded(message, *number, self.is_own, self.allow_jpeg)? {
            Content::Pose(pose) => self.add_pose(message.topic, pose)?,
            Content::Transforms(transforms) => {
                for transform in transforms {
                    self.add_transform(message, transform);
                }
            }
            Content::Picture(picture) => self.add_picture(message, &picture),
            Content::Profile(profile) => self.profiles.push(stamped(message, self.is_own, profile)),
            Content::Frame(frame) => self.frames.push(frame),
            Content::Inputs(inputs) => self.inputs.push(inputs),
            Content::Features(features) => self.features.extend(features),
            Content::ExternalAxes(steady_ns, ptp_ns, axes) => {
                self.ptp_ns.extend(ptp_ns.map(|ptp_ns| (steady_ns, ptp_ns)));
                let axes = axes.iter().map(|(name, value)| (name.as_str(), *value));
                self.axes.add(message.topic, steady_ns, axes);
            }
            Content::JointStates(states) => {
                let joints = states.names.iter().map(String::as_str).zip(states.positions.iter().copied());
                self.axes.add(message.topic, states.stamp_ns, joints);
                if self.has_robot(message.topic) {
                    self.add_joints(message.topic, &states)?;
                }
            }
            Content::Other => {}
        }
        Ok(())
    }

    fn add_pose(&mut self, topic: &str, pose: StampedPose) -> Result<(), ImportError> {
        let base = self.base.get_or_insert_with(|| pose.frame.clone());
        if *base != pose.frame {
            let (topic, wanted) = (topic.to_owned(), base.clone());
            return Err(ImportError::OtherBase { topic, found: pose.frame, wanted });
        }
        let (stamp_ns, base_from_tool) = (pose.stamp_ns, pose.pose);
        self.robot.push(RobotSample { stamp_ns, device_ns: None, base_from_tool });
        Ok(())
    }

    fn add_joints(&mut self, topic: &str, states: &JointStates) -> Result<(), ImportError> {
        let RobotSource::Joints { arm, .. } = &self.chosen.robot else { return Ok(()) };
        let missing =
            |joint: &str| ImportError::JointMissing { topic: topic.to_owned(), joint: joint.to_owned() };
        let known: BTreeMap<&str, f64> =
            states.names.iter().map(String::as_str).zip(states.positions.iter().copied()).collect();
        // A message may be of speeds alone.
        if let Some(joint) =
            states.names.iter().skip(states.positions.len()).find(|name| arm.moves_with(name))
        {
            return Err(missing(joint));
        }
        let pose = arm.base_from_tool(|name| known.get(name).copied()).map_err(|joint| missing(&joint))?;
        match pose {
            Some(base_from_tool) => {
                self.robot.push(RobotSample { stamp_ns: states.stamp_ns, device_ns: None, base_from_tool });
            }
            None => self.of_other_joints += 1,
        }
        Ok(())
    }

    fn add_transform(&mut self, message: &BagMessage<'_>, transform: StampedTransform) {
        match &self.chosen.robot {
            RobotSource::Own if transform.parent == BASE && transform.child == TOOL => {
                self.robot.push(RobotSample {
                    stamp_ns: message.log_time as i64,
                    device_ns: Some(message.publish_time as i64),
                    base_from_tool: transform.parent_from_child,
                });
            }
            RobotSource::Chain(chain) => {
                let is_it = |(parent, child): (&String, &String)| {
                    *parent == transform.parent && *child == transform.child
                };
                let place = chain.steps.iter().position(|step| is_it((&step.parent, &step.child)));
                if let Some(samples) = place.and_then(|place| self.transforms.get_mut(place)) {
                    samples.push((transform.stamp_ns, transform.parent_from_child));
                }
            }
            _ => {}
        }
    }

    /// Keeps where the picture is: its pixels are read again when they are needed.
    fn add_picture(&mut self, message: &BagMessage<'_>, picture: &StampedPicture) {
        let stamp_ns = if self.is_own { message.log_time as i64 } else { picture.stamp_ns };
        *self.origins.entry(picture.origin).or_insert(0) += 1;
        let (sequence, place) = (message.sequence, message.place);
        let kind = MessageType { schema: message.schema.to_owned(), encoding: message.encoding.to_owned() };
        let known = self.picture_types.iter().position(|known| *known == kind);
        let message_type = known.unwrap_or_else(|| {
            self.picture_types.push(kind);
            self.picture_types.len() - 1
        });
        self.pictures.push(StoredPicture { stamp_ns, sequence, place, message_type });
    }
}

/// Content of a message, by its number in its topic.
pub(super) fn decoded(
    message: &BagMessage<'_>,
    number: u64,
    is_own: bool,
    allow_jpeg: bool,
) -> Result<Content, ImportError> {
    let allowed = |content: Content| match &content {
        Content::Picture(picture) if picture.origin == PictureOrigin::Jpeg && !allow_jpeg => {
            Err(ContentError::Jpeg)
        }
        _ => Ok(content),
    };
    // For a recording of trueline the times of the log are used.
    let stamped = |content: Content| {
        let times = [message.log_time, message.publish_time];
        times.into_iter().filter(|_| is_own).try_for_each(|time| stamp::of_log(time).map(drop))?;
        Ok(content)
    };
    let decoded = decode(message.schema, message.encoding, message.bytes).and_then(allowed).and_then(stamped);
    decoded.map_err(|problem| ImportError::Message {
        topic: message.topic.to_owned(),
        number,
        log_time: message.log_time,
        problem,
    })
}

/// A profile with its stamp and its number.
pub(super) fn stamped(message: &BagMessage<'_>, is_own: bool, mut profile: StampedProfile) -> StampedProfile {
    if is_own {
        profile.stamp_ns = message.log_time as i64;
        profile.frame = Some(u64::from(message.sequence));
    }
    profile
}
