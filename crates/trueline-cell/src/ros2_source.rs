//! A robot whose driver publishes poses in ROS 2: a topic is read over DDS, without any ROS on this PC.
//!
//! DDS is done by `rustdds`, which is made for it and needs no system library. Names are those that ROS 2 gives to DDS: a topic `/pose`
//! is `rt/pose`, a message `package/msg/Name` has the type `package::msg::dds_::Name_`. The reader takes what writers of any
//! reliability send, and asks for nothing again: a pose that is late is worth nothing.

use rustdds::dds::adapters::no_key::{Decode, DefaultDecoder, DeserializerAdapter};
use rustdds::no_key::SimpleDataReader;
use rustdds::policy::Reliability;
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
    /// Type of its messages, `package/msg/Name`: one that holds one pose.
    pub message: String,
    /// ROS_DOMAIN_ID of the driver.
    pub domain: u16,
    /// Address of this PC on the robot's network; 127.0.0.1 for a driver on this PC. Other networks are neither asked nor told
    /// of, although the library's sockets are open to all.
    pub network: IpAddr,
}

/// Domains above take ports that the system uses for itself.
const LARGEST_DOMAIN: u16 = 232;

type Reader = SimpleDataReader<Vec<u8>, AsItCame>;

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
    // The last field: it ends when no reader is left.
    _participant: DomainParticipant,
}

impl Ros2Source {
    /// Asks the network for the topic.
    ///
    /// # Errors
    /// A message that holds no single pose, a domain that DDS does not have, and what the operating system says.
    pub fn open(topic: Ros2Topic, clock: HostClock) -> io::Result<Self> {
        if kind(&topic.message, "cdr") != Kind::Pose {
            let hint = "PoseStamped, PoseWithCovarianceStamped and Odometry hold one";
            return Err(io::Error::other(format!("{} holds no pose of one thing: {hint}", topic.message)));
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
        let named = format!("rt/{}", topic.topic.trim_start_matches('/'));
        let dds = participant
            .create_topic(named, dds_type(&topic.message), &qos, TopicKind::NoKey)
            .map_err(other)?;
        let subscriber = participant.create_subscriber(&qos).map_err(other)?;
        let reader = subscriber.create_simple_datareader_no_key(&dds, Some(qos)).map_err(other)?;
        Ok(Self {
            topic,
            clock,
            reader,
            waker: Waker::from(Arc::new(Unpark(thread::current()))),
            last: None,
            writers: 0,
            frame: None,
            unstamped: false,
            _participant: participant,
        })
    }

    /// Everything that is there; how much that was.
    fn take(&mut self, each: &mut dyn FnMut(&RobotPacket<'_>)) -> Result<usize, SourceError> {
        let mut count = 0;
        // In this order: what comes after the reading wakes this thread.
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
            each(&RobotPacket { bytes: &change.sample, from: self.address(), arrival, judged });
            count += 1;
        }
    }

    /// Where a message stands: writers count theirs one by one.
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
            return Err(PacketError::Text("not such a message, or a pose that is none"));
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

/// A message's bytes with the head that says how they are written, as a bag holds them.
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
