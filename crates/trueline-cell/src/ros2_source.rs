//! A robot whose driver publishes poses in ROS 2: reads a topic over DDS, without any ROS on this PC.
//!
//! DDS is implemented by `rustdds`, which needs no system library. Names are the DDS names of ROS 2: a topic `/pose` is
//! `rt/pose`, a message `package/msg/Name` has the type `package::msg::dds_::Name_`. The reader accepts writers of any
//! reliability, and requests no repetition: a late pose is worthless. From transforms (`/tf`) the pose of one frame in another is
//! composed. Static ones (`/tf_static`) are requested, because they were published earlier.

use crate::frame_tree::{FrameTree, TreeError};
use crate::ros2_dds::{PATIENCE, Reader, Unpark, other, participant, reader};
use rustdds::policy::{Durability, Reliability};
use rustdds::{DomainParticipant, GUID, QosPolicyBuilder, RTPSEntity};
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::task::Waker;
use std::time::{Duration, Instant};
use std::{io, thread};
use trueline_geometry::Pose;
use trueline_geometry::arm::urdf::Chain;
use trueline_live::frame_filter::PacketError;
use trueline_live::robot_source::{
    PoseMeaning, RobotPacket, RobotPose, RobotSource, RobotStatus, SourceAbout, SourceError,
};
use trueline_live::stamped_socket::Arrival;
use trueline_live::{HostClock, SequenceStatus};
use trueline_mcap::Content;
use trueline_mcap::message::{JointStates, Kind, decode, kind};

/// A topic, its message and its network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ros2Topic {
    /// Name of the topic in ROS, with or without its slash.
    pub topic: String,
    /// Type of its messages, `package/msg/Name`: one with a single pose, transforms, or joint states.
    pub message: String,
    /// Frames of the robot's base and of the tool: for transforms, and for joints if the URDF has more than one chain.
    pub frames: Option<[String; 2]>,
    /// Text of the robot's URDF, for joint states.
    pub urdf: Option<String>,
    /// ROS_DOMAIN_ID of the driver.
    pub domain: u16,
    /// Address of this PC on the robot's network; 127.0.0.1 for a driver on this PC. Other networks get no messages, although the
    /// library's sockets are open to all.
    pub network: IpAddr,
}

/// Messages that hold transforms.
pub const TRANSFORMS: &str = "tf2_msgs/msg/TFMessage";

/// Transforms, and their use.
struct Transforms {
    statics: Reader,
    tree: FrameTree,
    sequence: u32,
    refused: Option<TreeError>,
}

/// Source of poses from a topic.
pub struct Ros2Source {
    topic: Ros2Topic,
    clock: HostClock,
    reader: Reader,
    waker: Waker,
    last: Option<(GUID, i64)>,
    writers: usize,
    frame: Option<String>,
    unstamped: bool,
    arm: Option<Chain>,
    transforms: Option<Transforms>,
    /// Identifier of this program in the domain.
    own: GUID,
    // The last field: it is dropped when no reader is left.
    _participant: DomainParticipant,
}

impl Ros2Source {
    /// Subscribes to the topic.
    ///
    /// # Errors
    /// A message without a single pose; a domain that DDS does not have; an error of the operating system.
    pub fn open(topic: Ros2Topic, clock: HostClock) -> io::Result<Self> {
        let participant = participant(topic.domain, topic.network)?;
        Self::of(&participant, topic, clock)
    }

    /// The same, with a participant that has other topics too.
    pub(crate) fn of(
        participant: &DomainParticipant,
        topic: Ros2Topic,
        clock: HostClock,
    ) -> io::Result<Self> {
        match (kind(&topic.message, "cdr"), &topic.frames) {
            (Kind::Pose, None) | (Kind::Transforms, Some(_)) => {}
            (Kind::JointStates, _) if topic.urdf.is_some() => {}
            (Kind::JointStates, _) => {
                let hint = "name the robot's URDF";
                return Err(io::Error::other(format!("{} contains joint angles: {hint}", topic.message)));
            }
            (Kind::Transforms, None) => {
                let hint = "name the frames of the base and of the tool";
                return Err(io::Error::other(format!("{} contains several frames: {hint}", topic.message)));
            }
            (Kind::Pose, Some(_)) => {
                return Err(io::Error::other(format!("{} states its frame itself", topic.message)));
            }
            _ => {
                let hint = "use PoseStamped, PoseWithCovarianceStamped, Odometry, TFMessage or JointState";
                return Err(io::Error::other(format!("{} contains no single pose: {hint}", topic.message)));
            }
        }
        let qos = QosPolicyBuilder::new().reliability(Reliability::BestEffort).build();
        let reader = reader(participant, &topic.topic, &topic.message, &qos)?;
        let arm = topic.urdf.as_deref().map(|urdf| arm(urdf, topic.frames.as_ref())).transpose()?;
        let transforms = match &topic.frames {
            Some([base, tool]) if arm.is_none() => {
                let qos = QosPolicyBuilder::new()
                    .reliability(Reliability::Reliable { max_blocking_time: PATIENCE })
                    .durability(Durability::TransientLocal)
                    .build();
                let named = format!("{}_static", topic.topic);
                let statics = crate::ros2_dds::reader(participant, &named, &topic.message, &qos)?;
                Some(Transforms { statics, tree: FrameTree::new(base, tool), sequence: 0, refused: None })
            }
            _ => None,
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
            arm,
            transforms,
            own: participant.guid(),
            _participant: participant.clone(),
        })
    }

    /// Takes all waiting messages; returns their number.
    fn take(&mut self, each: &mut dyn FnMut(&RobotPacket<'_>)) -> Result<usize, SourceError> {
        if self.transforms.is_some() {
            return self.take_transforms(each);
        }
        let mut count = 0;
        // In this order: data after the reading wake this thread.
        self.reader.drain_read_notifications();
        self.reader.set_waker(Some(self.waker.clone()));
        loop {
            let taken = self.reader.try_take_one().map_err(|error| unheard(self.address(), error))?;
            let Some(change) = taken else { return Ok(count) };
            let arrival = arrived(&self.clock);
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

    /// Takes static transforms first, because the poses of the moving ones depend on them.
    fn take_transforms(&mut self, each: &mut dyn FnMut(&RobotPacket<'_>)) -> Result<usize, SourceError> {
        let (address, message) = (self.address(), self.topic.message.clone());
        let Self { reader, transforms: Some(transforms), clock, waker, own, .. } = self else {
            return Ok(0);
        };
        let Transforms { statics, tree, sequence, refused } = transforms;
        let mut count = 0;
        for (reader, is_static) in [(statics, true), (reader, false)] {
            reader.drain_read_notifications();
            reader.set_waker(Some(waker.clone()));
            loop {
                let taken = reader.try_take_one().map_err(|error| unheard(address, error))?;
                let Some(change) = taken else { break };
                // The node's own transform: another calibration is not another robot.
                if change.writer_guid.prefix == own.prefix {
                    continue;
                }
                let mut arrival = arrived(clock);
                let bytes = &change.sample;
                let mut tell = |arrival, judged: Result<_, PacketError>| {
                    let judged = judged.map_err(Into::into);
                    each(&RobotPacket { bytes, from: address, arrival, judged, egm: None });
                };
                count += 1;
                let Ok(Content::Transforms(list)) = decode(&message, "cdr", bytes) else {
                    tell(arrival, Err(PacketError::Text("another type of message, or an invalid transform")));
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
                    tell(arrival, Err(PacketError::NotNeeded("transforms without a new pose")));
                }
                for (stamp_ns, base_from_tool) in new.poses {
                    // Poses that became known together get different stamps, in their order.
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

    /// Status of a message: each writer numbers its own.
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

    /// The driver's stamp, ns, and the pose; without a driver's stamp, the time of the publication.
    fn pose(&mut self, bytes: &[u8], sent_ns: Option<i64>) -> Result<(i64, Pose), PacketError> {
        let content = decode(&self.topic.message, "cdr", bytes);
        let (stamp_ns, pose) = match (content, &self.arm) {
            (Ok(Content::Pose(stamped)), None) => {
                self.frame = Some(stamped.frame);
                (stamped.stamp_ns, stamped.pose)
            }
            (Ok(Content::JointStates(states)), Some(arm)) => (states.stamp_ns, of_joints(arm, &states)?),
            _ => return Err(PacketError::Text("another type of message, or an invalid pose")),
        };
        self.unstamped |= stamp_ns == 0;
        let stamp_ns = if stamp_ns == 0 { sent_ns } else { Some(stamp_ns) };
        let stamp_ns =
            stamp_ns.ok_or(PacketError::Text("no stamp in the message, and no time of its publication"))?;
        Ok((stamp_ns, pose))
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
        // Another thread may have opened it.
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
            notes.push(format!(
                "the publisher changed {} time(s): a robot must have one publisher",
                self.writers - 1
            ));
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

/// The arrival of a message that is read now.
fn arrived(clock: &HostClock) -> Arrival {
    let read = clock.read();
    Arrival { steady_ns: read.steady_ns, is_of_reading: false, kernel_wall_ns: None, read }
}

/// Wraps an error of DDS about a topic.
fn unheard(address: SocketAddr, error: impl ToString) -> SourceError {
    SourceError::Refused { address, why: error.to_string() }
}

fn arm(urdf: &str, frames: Option<&[String; 2]>) -> io::Result<Chain> {
    let [base, tool] = frames.map_or([None; 2], |frames| frames.each_ref().map(|name| Some(name.as_str())));
    Chain::of(urdf, base, tool).map_err(other)
}

/// Pose of the tool at the joints' positions. A gripper's fingers may have messages of their own.
fn of_joints(arm: &Chain, states: &JointStates) -> Result<Pose, PacketError> {
    let position = |name: &str| {
        let known = states.names.iter().zip(&states.positions).find(|(known, _)| known.as_str() == name);
        known.map(|(_, position)| *position).filter(|position| position.is_finite())
    };
    match arm.base_from_tool(position) {
        Ok(Some(pose)) => Ok(pose),
        Ok(None) => Err(PacketError::NotNeeded("joints of another device")),
        Err(_) => Err(PacketError::Text("a joint of the robot is missing, or its position is not a number")),
    }
}

/// Ticks of RTPS are 2⁻³² s.
fn ns_of_ticks(ticks: u64) -> i64 {
    ((u128::from(ticks) * 1_000_000_000) >> 32) as i64
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    const URDF: &str = r#"<robot name="two"><link name="base"/><link name="arm"/><link name="tool"/>
        <joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
        <joint name="reach" type="prismatic"><parent link="arm"/><child link="tool"/><origin xyz="0.5 0 0"/><axis xyz="1 0 0"/></joint>
        </robot>"#;

    fn states(named: &[(&str, f64)]) -> JointStates {
        let (names, positions) = named.iter().map(|(name, at)| ((*name).to_owned(), *at)).unzip();
        JointStates { stamp_ns: 1, names, positions }
    }

    #[test]
    fn joints_give_the_pose_of_the_tool_and_what_is_missing_is_refused() {
        let arm = arm(URDF, None).unwrap();
        // A quarter turn, and 0.1 m more of reach: 0.6 m along y.
        let quarter = std::f64::consts::FRAC_PI_2;
        let pose = of_joints(&arm, &states(&[("reach", 0.1), ("finger", 7.0), ("turn", quarter)])).unwrap();
        assert!((pose.translation.vector - nalgebra::Vector3::new(0.0, 0.6, 0.0)).norm() < 1e-12);
        assert!(matches!(of_joints(&arm, &states(&[("finger", 1.0)])), Err(PacketError::NotNeeded(_))));
        assert!(matches!(of_joints(&arm, &states(&[("turn", 1.0)])), Err(PacketError::Text(_))));
        let no_number = states(&[("turn", f64::NAN), ("reach", 0.0)]);
        assert!(matches!(of_joints(&arm, &no_number), Err(PacketError::Text(_))));
    }
}
