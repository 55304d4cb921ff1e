//! A robot with a driver that publishes poses in ROS 2: a topic is read over DDS, without any ROS on this PC.
//!
//! DDS is done by `rustdds`, which is made for it and needs no system library. Names are the DDS names of ROS 2: a topic
//! `/pose` is `rt/pose`, a message `package/msg/Name` has the type `package::msg::dds_::Name_`. The reader accepts writers
//! of any reliability, and requests nothing again: a late pose is worthless. From transforms (`/tf`) the pose of one frame
//! in another is composed. Static ones (`/tf_static`) are requested, as they were published before.

use crate::frame_tree::{FrameTree, TreeError};
use rustdds::dds::adapters::no_key::{Decode, DefaultDecoder, DeserializerAdapter};
use rustdds::no_key::SimpleDataReader;
use rustdds::policy::{Durability, Reliability};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, GUID, QosPolicyBuilder, RepresentationIdentifier, TopicKind,
};
use std::convert::Infallible;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::task::{Wake, Waker};
use std::thread::Thread;
use std::time::{Duration, Instant};
use std::{io, thread};
use trueline_geometry::Pose;
use trueline_live::frame_filter::PacketError;
use trueline_live::robot_source::{
    PoseMeaning, RobotPacket, RobotPose, RobotSource, RobotStatus, SourceAbout, SourceError,
};
use trueline_live::stamped_socket::Arrival;
use trueline_live::{HostClock, SequenceStatus};
use trueline_mcap::Content;
use trueline_mcap::message::{Kind, decode, kind};

/// Which topic, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ros2Topic {
    /// Name of the topic in ROS, with or without its slash.
    pub topic: String,
    /// Type of its messages, `package/msg/Name`: one that holds one pose, or transforms.
    pub message: String,
    /// Of transforms: the frame of the robot's base and that of the tool.
    pub frames: Option<[String; 2]>,
    /// ROS_DOMAIN_ID of the driver.
    pub domain: u16,
    /// Address of this PC on the robot's network; 127.0.0.1 for a driver on this PC. Other networks are neither asked nor told
    /// of, although the library's sockets are open to all.
    pub network: IpAddr,
}

/// Domains above take ports that the system uses for itself.
const LARGEST_DOMAIN: u16 = 232;

/// Messages that hold transforms.
pub const TRANSFORMS: &str = "tf2_msgs/msg/TFMessage";
/// A writer is waited for so long before it may drop a message.
const PATIENCE: rustdds::Duration = rustdds::Duration::from_millis(100);

type Reader = SimpleDataReader<Vec<u8>, AsItCame>;

/// Transforms, and their use.
struct Transforms {
    statics: Reader,
    tree: FrameTree,
    sequence: u32,
    refused: Option<TreeError>,
}

/// A topic that is listened to.
pub struct Ros2Source {
    topic: Ros2Topic,
    clock: HostClock,
    reader: Reader,
    waker: Waker,
    last: Option<(GUID, i64)>,
    writers: usize,
    frame: Option<String>,
    unstamped: bool,
    transforms: Option<Transforms>,
    // The last field: it ends when no reader is left.
    _participant: DomainParticipant,
}

impl Ros2Source {
    /// Asks the network for the topic.
    ///
    /// # Errors
    /// A message without a single pose; a domain that DDS does not have; error of the operating system.
    pub fn open(topic: Ros2Topic, clock: HostClock) -> io::Result<Self> {
        match (kind(&topic.message, "cdr"), &topic.frames) {
            (Kind::Pose, None) | (Kind::Transforms, Some(_)) => {}
            (Kind::Transforms, None) => {
                let hint = "name the frames of the base and of the tool";
                return Err(io::Error::other(format!("{} holds many frames: {hint}", topic.message)));
            }
            (Kind::Pose, Some(_)) => {
                return Err(io::Error::other(format!("{} states its frame itself", topic.message)));
            }
            _ => {
                let hint = "PoseStamped, PoseWithCovarianceStamped and Odometry hold one, TFMessage holds transforms";
                return Err(io::Error::other(format!(
                    "{} holds no pose of one thing: {hint}",
                    topic.message
                )));
            }
        }
        if topic.domain > LARGEST_DOMAIN {
            return Err(io::Error::other(format!("ROS_DOMAIN_ID is 0 to {LARGEST_DOMAIN}")));
        }
        let participant = DomainParticipantBuilder::new(topic.domain)
            .with_only_networks([topic.network])
            .same_host_loopback(topic.network.is_loopback())
            .build()
            .map_err(other)?;
        let qos = QosPolicyBuilder::new().reliability(Reliability::BestEffort).build();
        let reader = reader(&participant, &topic.topic, &topic.message, &qos)?;
        let transforms = match &topic.frames {
            None => None,
            Some([base, tool]) => {
                let qos = QosPolicyBuilder::new()
                    .reliability(Reliability::Reliable { max_blocking_time: PATIENCE })
                    .durability(Durability::TransientLocal)
                    .build();
                let named = format!("{}_static", topic.topic);
                let statics = self::reader(&participant, &named, &topic.message, &qos)?;
                Some(Transforms { statics, tree: FrameTree::new(base, tool), sequence: 0, refused: None })
            }
        };
        Ok(Self {
            topic,
            clock,
            reader,
            waker: Waker::from(Arc::new(Unpark(thread::current()))),
            last: None,
            writers: 0,
            frame: None,
            unstamped: false,
            transforms,
            _participant: participant,
        })
    }

    /// Everything that is there; how much that was.
    fn take(&mut self, each: &mut dyn FnMut(&RobotPacket<'_>)) -> Result<usize, SourceError> {
        if self.transforms.is_some() {
            return self.take_transforms(each);
        }
        let mut count = 0;
        // In this order: data after the reading wake this thread.
        self.reader.drain_read_notifications();
        self.reader.set_waker(Some(self.waker.clone()));
        loop {
            let taken = self
                .reader
                .try_take_one()
                .map_err(|error| SourceError::Refused { address: self.address(), why: error.to_string() })?;
            let Some(change) = taken else { return Ok(count) };
            let read = self.clock.read();
            let arrival =
                Arrival { steady_ns: read.steady_ns, is_of_reading: false, kernel_wall_ns: None, read };
            let sent_ns = change.source_timestamp().map(|stamp| ns_of_ticks(stamp.to_ticks()));
            let number = i64::from(change.sequence_number);
            let status = self.place(change.writer_guid, number);
            let judged = self
                .pose(&change.sample, sent_ns)
                .map(|(device_ns, base_from_tool)| {
                    let status_of = RobotStatus::Unknown;
                    (
                        RobotPose {
                            sequence: number as u32,
                            device_ns,
                            base_from_tool,
                            status: status_of,
                            inputs: None,
                        },
                        status,
                    )
                })
                .map_err(Into::into);
            each(&RobotPacket { bytes: &change.sample, from: self.address(), arrival, judged, egm: None });
            count += 1;
        }
    }

    /// Of transforms the static ones first: poses of the moving ones stand on them.
    fn take_transforms(&mut self, each: &mut dyn FnMut(&RobotPacket<'_>)) -> Result<usize, SourceError> {
        let (address, message) = (self.address(), self.topic.message.clone());
        let Self { reader, transforms: Some(transforms), clock, waker, .. } = self else { return Ok(0) };
        let Transforms { statics, tree, sequence, refused } = transforms;
        let mut count = 0;
        for (reader, is_static) in [(statics, true), (reader, false)] {
            reader.drain_read_notifications();
            reader.set_waker(Some(waker.clone()));
            loop {
                let taken = reader.try_take_one();
                let taken =
                    taken.map_err(|error| SourceError::Refused { address, why: error.to_string() })?;
                let Some(change) = taken else { break };
                let read = clock.read();
                let mut arrival =
                    Arrival { steady_ns: read.steady_ns, is_of_reading: false, kernel_wall_ns: None, read };
                let bytes = &change.sample;
                let mut tell = |arrival, judged: Result<_, PacketError>| {
                    let judged = judged.map_err(Into::into);
                    each(&RobotPacket { bytes, from: address, arrival, judged, egm: None });
                };
                count += 1;
                let Ok(Content::Transforms(list)) = decode(&message, "cdr", bytes) else {
                    tell(arrival, Err(PacketError::Text("not such a message, or an invalid transform")));
                    continue;
                };
                if !is_static && list.iter().any(|transform| transform.stamp_ns == 0) {
                    tell(arrival, Err(PacketError::Text("a moving transform without a stamp")));
                    continue;
                }
                let new = tree.add(&list, is_static).map_err(|error| {
                    *refused = Some(error.clone());
                    SourceError::Refused { address, why: error.to_string() }
                })?;
                if new.poses.is_empty() {
                    tell(arrival, Err(PacketError::NotNeeded("transforms that make no new pose")));
                }
                for (stamp_ns, base_from_tool) in new.poses {
                    // Poses that became known at once came one after the other: no two have one stamp.
                    arrival.steady_ns += 1;
                    let is_first = *sequence == 0 || new.began_anew;
                    *sequence = sequence.wrapping_add(1);
                    let pose = RobotPose {
                        sequence: *sequence,
                        device_ns: stamp_ns,
                        base_from_tool,
                        status: RobotStatus::Unknown,
                        inputs: None,
                    };
                    let status = match is_first {
                        true => SequenceStatus::First,
                        false => SequenceStatus::Newest { skipped: 0 },
                    };
                    tell(arrival, Ok((pose, status)));
                }
            }
        }
        Ok(count)
    }

    /// Place of a message: writers count theirs one by one.
    fn place(&mut self, writer: GUID, number: i64) -> SequenceStatus {
        let last = self.last.replace((writer, number));
        match last.filter(|(before, _)| *before == writer) {
            Some((_, before)) if number > before => {
                let skipped = u32::try_from(number - before - 1).unwrap_or(u32::MAX);
                SequenceStatus::Newest { skipped }
            }
            Some(_) => SequenceStatus::Late,
            None => {
                self.writers += 1;
                SequenceStatus::First
            }
        }
    }

    /// The driver's stamp, ns, and the pose; where the driver does not stamp, when it published.
    fn pose(&mut self, bytes: &[u8], sent_ns: Option<i64>) -> Result<(i64, Pose), PacketError> {
        let content = decode(&self.topic.message, "cdr", bytes);
        let Ok(Content::Pose(stamped)) = content else {
            return Err(PacketError::Text("not such a message, or an invalid pose"));
        };
        self.frame = Some(stamped.frame);
        self.unstamped |= stamped.stamp_ns == 0;
        let stamp_ns = if stamped.stamp_ns == 0 { sent_ns } else { Some(stamped.stamp_ns) };
        let stamp_ns =
            stamp_ns.ok_or(PacketError::Text("neither a stamp in it nor one of its publication"))?;
        Ok((stamp_ns, stamped.pose))
    }

    fn address(&self) -> SocketAddr {
        SocketAddr::new(self.topic.network, 0)
    }
}

impl RobotSource for Ros2Source {
    fn receive(
        &mut self,
        timeout: Duration,
        each: &mut dyn FnMut(&RobotPacket<'_>),
    ) -> Result<(), SourceError> {
        let until = Instant::now() + timeout;
        // It may have been opened by another thread.
        self.waker = Waker::from(Arc::new(Unpark(thread::current())));
        while self.take(each)? == 0 {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            thread::park_timeout(left);
        }
        Ok(())
    }

    fn about(&self) -> SourceAbout {
        let mut notes = Vec::new();
        if let Some(frame) = &self.frame {
            notes.push(format!("the poses are given in the frame `{frame}`"));
        }
        if let Some(transforms) = &self.transforms {
            notes.extend(transforms.tree.notes());
            notes.extend(transforms.refused.as_ref().map(ToString::to_string));
        }
        if self.writers > 1 {
            notes.push(format!("{} times another publisher spoke: one robot has one", self.writers - 1));
        }
        if self.unstamped {
            notes.push(
                "the driver does not stamp its messages: they have the time of their publication".into(),
            );
        }
        SourceAbout {
            protocol: format!(
                "ROS 2, {} of {} by DDS, domain {}",
                self.topic.topic, self.topic.message, self.topic.domain
            ),
            pose: PoseMeaning::Published,
            clock: "the driver's stamps, ns: the clock of its PC, not the controller's",
            controller: None,
            notes,
        }
    }
}

fn reader(
    participant: &DomainParticipant,
    topic: &str,
    message: &str,
    qos: &rustdds::QosPolicies,
) -> io::Result<Reader> {
    let named = format!("rt/{}", topic.trim_start_matches('/'));
    let dds = participant.create_topic(named, dds_type(message), qos, TopicKind::NoKey).map_err(other)?;
    let subscriber = participant.create_subscriber(qos).map_err(other)?;
    subscriber.create_simple_datareader_no_key(&dds, Some(qos.clone())).map_err(other)
}

/// Ticks of RTPS are 2⁻³² s.
fn ns_of_ticks(ticks: u64) -> i64 {
    ((u128::from(ticks) * 1_000_000_000) >> 32) as i64
}

fn other(error: impl std::fmt::Display) -> io::Error {
    io::Error::other(error.to_string())
}

/// `geometry_msgs/msg/PoseStamped` is `geometry_msgs::msg::dds_::PoseStamped_`.
fn dds_type(message: &str) -> String {
    let (package, name) = message.split_once('/').unwrap_or((message, ""));
    format!("{package}::msg::dds_::{}_", name.trim_start_matches("msg/"))
}

struct Unpark(Thread);

impl Wake for Unpark {
    fn wake(self: Arc<Self>) {
        self.0.unpark();
    }
}

/// A message's bytes with the head that states their encoding, as in a bag.
struct AsItCame;

impl DeserializerAdapter<Vec<u8>> for AsItCame {
    type Error = Infallible;
    type Decoded = Vec<u8>;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded(decoded: Vec<u8>) -> Vec<u8> {
        decoded
    }
}

impl DefaultDecoder<Vec<u8>> for AsItCame {
    type Decoder = WithHead;
    const DECODER: WithHead = WithHead;
}

#[derive(Clone)]
struct WithHead;

impl Decode<'_, Vec<u8>> for WithHead {
    type Error = Infallible;

    fn decode_bytes(self, bytes: &[u8], encoding: RepresentationIdentifier) -> Result<Vec<u8>, Infallible> {
        let little = u8::from(encoding == RepresentationIdentifier::CDR_LE);
        Ok([&[0, little, 0, 0], bytes].concat())
    }
}
