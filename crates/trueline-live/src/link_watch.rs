//! Senders, regularity and losses: the answer to "no data from the UdpUc device".

use crate::endpoint::Received;
use crate::frame_filter::{Rejection, SequenceStatus};
use crate::robot_frame::RobotFrame;
use crate::stream_counts::{StreamCounts, StreamSummary};
use std::collections::BTreeMap;
use std::net::SocketAddr;

/// Senders that are told apart; more than this is a flood, and counted together.
const MOST_TALKERS: usize = 64;

/// Messages of one sender.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Talker {
    /// Its datagrams.
    pub datagrams: u64,
    /// Good frames of the robot among them.
    pub accepted: u64,
    /// The others, by reason.
    pub rejected: BTreeMap<String, u64>,
}

/// Listens along.
#[derive(Clone, Debug, Default)]
pub struct LinkWatch {
    talkers: BTreeMap<SocketAddr, Talker>,
    unlisted: u64,
    robot: Option<(SocketAddr, RobotFrame)>,
    counts: StreamCounts,
    repeated: u64,
    contradictions: u64,
    without_kernel_stamp: u64,
    dropped_by_kernel: u32,
}

/// The robot's link in three figures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Brief {
    /// The robot, and its last message.
    pub robot: Option<(SocketAddr, RobotFrame)>,
    /// Good frames.
    pub frames: u64,
    /// Sequence numbers that never came.
    pub lost: u64,
}

/// The robot's link so far.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkReport {
    /// Everybody who sent something.
    pub talkers: BTreeMap<SocketAddr, Talker>,
    /// Datagrams of senders beyond those listed.
    pub unlisted: u64,
    /// The robot, and its last message.
    pub robot: Option<(SocketAddr, RobotFrame)>,
    /// Its good frames.
    pub stream: StreamSummary,
    /// Frames that came twice.
    pub repeated: u64,
    /// Frames whose quaternion and Euler angles contradict each other.
    pub contradictions: u64,
    /// Datagrams without a stamp of the kernel that could be used: they are stamped when they were read.
    pub without_kernel_stamp: u64,
    /// Datagrams that this machine had to drop.
    pub dropped_by_kernel: u32,
}

impl LinkWatch {
    /// Takes notice of a datagram.
    pub fn note(&mut self, received: &Received<'_>) {
        let datagram = &received.datagram;
        self.dropped_by_kernel = datagram.dropped_by_kernel;
        self.without_kernel_stamp +=
            u64::from(datagram.arrival.kernel_wall_ns.is_none() || datagram.arrival.is_of_reading);
        if self.talkers.len() < MOST_TALKERS || self.talkers.contains_key(&datagram.from) {
            let talker = self.talkers.entry(datagram.from).or_default();
            talker.datagrams += 1;
            match &received.judged {
                Ok(_) => talker.accepted += 1,
                Err(reason) => *talker.rejected.entry(reason.to_string()).or_default() += 1,
            }
        } else {
            self.unlisted += 1;
        }
        match received.judged {
            Ok((frame, status)) => {
                self.note_frame(datagram.from, frame, status, datagram.arrival.steady_ns);
            }
            Err(Rejection::Repeated) => self.repeated += 1,
            Err(_) => {}
        }
    }

    fn note_frame(&mut self, from: SocketAddr, frame: RobotFrame, status: SequenceStatus, steady_ns: i64) {
        self.contradictions += u64::from(frame.attitudes_differ);
        self.counts.note(frame.device_ns, steady_ns, status);
        if status != SequenceStatus::Late {
            self.robot = Some((from, frame));
        }
    }

    /// The robot and its last message, its frames, and the number of lost ones: cheap enough for every step.
    #[must_use]
    pub fn brief(&self) -> Brief {
        Brief { robot: self.robot, frames: self.counts.frames(), lost: self.counts.lost() }
    }

    /// Present report.
    #[must_use]
    pub fn report(&self) -> LinkReport {
        LinkReport {
            talkers: self.talkers.clone(),
            unlisted: self.unlisted,
            robot: self.robot,
            stream: self.counts.summary(),
            repeated: self.repeated,
            contradictions: self.contradictions,
            without_kernel_stamp: self.without_kernel_stamp,
            dropped_by_kernel: self.dropped_by_kernel,
        }
    }
}
