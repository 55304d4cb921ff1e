//! State of a robot's stream in any protocol: sender, regularity, losses and rejected messages.

use crate::frame_filter::{Rejection, SequenceStatus};
use crate::robot_source::{RobotPacket, RobotPose};
use crate::stream_counts::{StreamCounts, StreamSummary};
use std::collections::BTreeMap;
use std::net::SocketAddr;

/// Listens along.
#[derive(Clone, Debug, Default)]
pub struct SourceWatch {
    robot: Option<(SocketAddr, RobotPose)>,
    counts: StreamCounts,
    unused: BTreeMap<(String, SocketAddr), u64>,
    unlisted: u64,
}

/// A robot's stream so far.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceReport {
    /// The robot, and its last message.
    pub robot: Option<(SocketAddr, RobotPose)>,
    /// Its good poses.
    pub stream: StreamSummary,
    /// Packets that were not used, by reason and sender.
    pub unused: BTreeMap<(String, SocketAddr), u64>,
    /// Packets not used of further senders.
    pub unlisted: u64,
}

/// Largest number of separate reasons and senders; more are a flood, and counted together.
const MOST_REASONS: usize = 64;

impl SourceWatch {
    /// Takes notice of a packet.
    pub fn note(&mut self, packet: &RobotPacket<'_>) {
        match packet.judged {
            Ok((pose, status)) => self.note_pose(packet, pose, status),
            Err(reason) => self.note_unused(reason, packet.from),
        }
    }

    /// Whether the received robot sends from this address.
    #[must_use]
    pub fn is_robot(&self, from: SocketAddr) -> bool {
        self.robot.is_some_and(|(robot, _)| robot == from)
    }

    /// Good poses so far.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.counts.frames()
    }

    fn note_unused(&mut self, reason: Rejection, from: SocketAddr) {
        let key = (reason.to_string(), from);
        if self.unused.len() < MOST_REASONS || self.unused.contains_key(&key) {
            *self.unused.entry(key).or_default() += 1;
        } else {
            self.unlisted += 1;
        }
    }

    fn note_pose(&mut self, packet: &RobotPacket<'_>, pose: RobotPose, status: SequenceStatus) {
        self.counts.note(pose.device_ns, packet.arrival.steady_ns, status);
        if status != SequenceStatus::Late {
            self.robot = Some((packet.from, pose));
        }
    }

    /// Present report.
    #[must_use]
    pub fn report(&self) -> SourceReport {
        SourceReport {
            robot: self.robot,
            stream: self.counts.summary(),
            unused: self.unused.clone(),
            unlisted: self.unlisted,
        }
    }
}
