//! Sources of a robot's poses, for any protocol.

use crate::frame_filter::{Rejection, SequenceStatus};
use crate::robot_answer::RobotAnswer;
use crate::stamped_socket::Arrival;
use crate::{Endpoint, Received};
use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;
use trueline_geometry::Pose;

/// A robot that reports its pose. Nothing that it is sent moves it.
pub trait RobotSource: Send {
    /// Waits for the robot, and hands over every packet that is there.
    ///
    /// # Errors
    /// [`SourceError`]: packets that came before it are handed over first. A source that was closed by the robot may be
    /// asked again: it connects anew.
    fn receive(
        &mut self,
        timeout: Duration,
        each: &mut dyn FnMut(&RobotPacket<'_>),
    ) -> Result<(), SourceError>;

    /// Its protocol, and the kind of its poses, as far as known now.
    fn about(&self) -> SourceAbout;

    /// Whether the robot waits for answers: then the receiver must not wait for anything else.
    fn must_answer(&self) -> bool {
        false
    }

    /// Answers that were sent since this was last asked.
    fn take_answers(&mut self) -> Vec<RobotAnswer> {
        Vec::new()
    }
}

/// A packet of the robot and its result.
#[derive(Clone, Copy, Debug)]
pub struct RobotPacket<'a> {
    /// As it came.
    pub bytes: &'a [u8],
    /// Its sender.
    pub from: SocketAddr,
    /// When it came.
    pub arrival: Arrival,
    /// The robot's pose, or why the packet is not used.
    pub judged: Result<(RobotPose, SequenceStatus), Rejection>,
    /// All that EGM says, where the robot is ABB's.
    pub egm: Option<&'a Received<'a>>,
}

/// Pose of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotPose {
    /// Counts the controller's cycles; wraps.
    pub sequence: u32,
    /// The controller's clock, of no known epoch and without its wraps, ns.
    pub device_ns: i64,
    /// Pose of the frame that [`SourceAbout::pose`] names, m.
    pub base_from_tool: Pose,
    /// How the robot is.
    pub status: RobotStatus,
    /// Its digital inputs when it was there, the first in the lowest bit; `None` where the stream does not say.
    pub inputs: Option<u64>,
}

/// State of a robot, as far as its stream reports it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RobotStatus {
    /// The stream does not say.
    #[default]
    Unknown,
    /// Ready, at rest or moving.
    Ready,
    /// It cannot move: why.
    Stopped(&'static str),
}

impl fmt::Display for RobotStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unknown => "state unknown",
            Self::Ready => "ready",
            Self::Stopped(why) => why,
        })
    }
}

/// Kind of the poses that a robot reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseMeaning {
    /// Of the tool that the program names, in its work object.
    ToolInWorkObject,
    /// Of the active tool (TCP) in the robot's base.
    TcpInBase,
    /// Of the flange (faceplate) in the robot's world frame.
    FlangeInWorld,
    /// Of the active tool in the active base or user frame.
    TcpInActiveBase,
    /// Pose from a driver's publication, in the frame that it names.
    Published,
}

impl fmt::Display for PoseMeaning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ToolInWorkObject => "the tool in the work object that the program names",
            Self::TcpInBase => "the active tool (TCP) in the robot's base",
            Self::FlangeInWorld => "the flange (faceplate) in the robot's world frame",
            Self::TcpInActiveBase => "the active tool in the active base",
            Self::Published => "the poses of the robot's driver",
        })
    }
}

/// Protocol of a source. Recordings of different meanings are not to be mixed in one calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceAbout {
    /// Protocol and version.
    pub protocol: String,
    /// Which pose comes.
    pub pose: PoseMeaning,
    /// The clock of the stream: unit and resolution.
    pub clock: &'static str,
    /// The controller's software, if reported.
    pub controller: Option<String>,
    /// Remarks: statements of the controller, and irregularities of its stream.
    pub notes: Vec<String>,
}

/// Why nothing comes.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The network.
    #[error("{address}: {error}")]
    Io {
        /// Its sender.
        address: SocketAddr,
        /// Error of the operating system.
        error: io::Error,
    },
    /// The robot closed the connection, or ended its stream; the next call connects anew.
    #[error("{address} closed the connection")]
    Closed {
        /// Its sender.
        address: SocketAddr,
    },
    /// The robot speaks, and cannot be listened to.
    #[error("{address}: {why}")]
    Refused {
        /// Its sender.
        address: SocketAddr,
        /// Why.
        why: String,
    },
}

impl RobotSource for Endpoint {
    fn receive(
        &mut self,
        timeout: Duration,
        each: &mut dyn FnMut(&RobotPacket<'_>),
    ) -> Result<(), SourceError> {
        let heard = Self::receive(self, timeout, |received| each(&received.into()));
        match (heard, self.local_address()) {
            (Err(error), Ok(address)) => Err(SourceError::Io { address, error }),
            _ => Ok(()),
        }
    }

    fn about(&self) -> SourceAbout {
        SourceAbout {
            protocol: "ABB EGM".to_owned(),
            pose: PoseMeaning::ToolInWorkObject,
            clock: "µs (ms on RobotWare 6)",
            controller: None,
            notes: Vec::new(),
        }
    }
}

impl<'a> From<&'a Received<'a>> for RobotPacket<'a> {
    fn from(received: &'a Received<'a>) -> Self {
        let judged = received.judged.map(|(frame, status)| {
            let ready = if frame.is_guided() { RobotStatus::Ready } else { RobotStatus::Unknown };
            let pose = RobotPose {
                sequence: frame.sequence,
                device_ns: frame.device_ns,
                base_from_tool: frame.base_from_tool,
                status: ready,
                inputs: frame.digital.map(u64::from),
            };
            (pose, status)
        });
        let datagram = received.datagram;
        Self {
            bytes: datagram.bytes,
            from: datagram.from,
            arrival: datagram.arrival,
            judged,
            egm: Some(received),
        }
    }
}
