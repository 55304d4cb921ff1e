//! How a robot's stream is, whatever it speaks: who sends, how regularly, what is lost and what is not used.

use crate::frame_filter::{Rejection, SequenceStatus};
use crate::link_watch::{RECENT, Timing, timing};
use crate::robot_source::{RobotPacket, RobotPose};
use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;

/// Listens along.
#[derive(Clone, Debug, Default)]
pub struct SourceWatch {
    robot: Option<(SocketAddr, RobotPose)>,
    recent: VecDeque<(i64, i64)>,
    frames: u64,
    skipped: u64,
    late: u64,
    sessions: u64,
    last_ns: Option<i64>,
    longest_gap_ns: i64,
    unused: BTreeMap<(String, SocketAddr), u64>,
    unlisted: u64,
}

/// A robot's stream so far.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceReport {
    /// The robot, and the last that it said.
    pub robot: Option<(SocketAddr, RobotPose)>,
    /// Good poses.
    pub frames: u64,
    /// Poses that the controller counted and that never came.
    pub lost: u64,
    /// Poses overtaken by newer ones.
    pub late: u64,
    /// How often the stream began.
    pub sessions: u64,
    /// Longest time without a pose between two, s.
    pub longest_gap_s: f64,
    /// Rate and delays of the last minute; `None` with fewer than ten poses.
    pub timing: Option<Timing>,
    /// Packets that were not used, by reason and sender.
    pub unused: BTreeMap<(String, SocketAddr), u64>,
    /// Packets not used of further senders.
    pub unlisted: u64,
}

/// Reasons and senders that are told apart; more is a flood, and counted together.
const MOST_REASONS: usize = 64;

impl SourceWatch {
    /// Takes notice of a packet.
    pub fn note(&mut self, packet: &RobotPacket<'_>) {
        match packet.judged {
            Ok((pose, status)) => self.note_pose(packet, pose, status),
            Err(reason) => self.note_unused(reason, packet.from),
        }
    }

    /// Whether the robot that is heard sends from this address.
    #[must_use]
    pub fn is_robot(&self, from: SocketAddr) -> bool {
        self.robot.is_some_and(|(robot, _)| robot == from)
    }

    /// Good poses so far.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.frames
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
        let steady_ns = packet.arrival.steady_ns;
        self.frames += 1;
        match status {
            SequenceStatus::First => {
                self.sessions += 1;
                // Another session may have another clock.
                self.recent.clear();
            }
            SequenceStatus::Newest { skipped } => self.skipped += u64::from(skipped),
            SequenceStatus::Late => self.late += 1,
        }
        if let Some(last_ns) = self.last_ns.replace(steady_ns) {
            self.longest_gap_ns = self.longest_gap_ns.max(steady_ns - last_ns);
        }
        if status != SequenceStatus::Late {
            self.robot = Some((packet.from, pose));
        }
        if self.recent.len() == RECENT {
            self.recent.pop_front();
        }
        self.recent.push_back((pose.device_ns, steady_ns));
    }

    /// What there is to tell.
    #[must_use]
    pub fn report(&self) -> SourceReport {
        SourceReport {
            robot: self.robot,
            frames: self.frames,
            lost: self.skipped.saturating_sub(self.late),
            late: self.late,
            sessions: self.sessions,
            longest_gap_s: self.longest_gap_ns as f64 * 1e-9,
            timing: timing(&self.recent),
            unused: self.unused.clone(),
            unlisted: self.unlisted,
        }
    }
}
