//! Listens to Stream Motion: stop, ask for the controller's capabilities, name the input to report if there is one, start.
//! After that nothing is sent. No command ever.
//!
//! If another program streams motion (the status reports that commands are awaited), silence would be harmful. Then the
//! stream is left alone.

use super::signal::Signal;
use super::stream_motion_packets::{
    CAPABILITY, Capability, SIGNALS, START, START_OLD, STOP, Status, VERSION_REQUEST, head, status, word,
    words,
};
use super::wrapping_clock::WrappingClock;
use crate::frame_filter::{Rejection, SequenceStatus};
use crate::robot_source::{PoseMeaning, RobotPose, RobotStatus, SourceAbout};
use crate::udp_source::DatagramProtocol;

/// Waiting time for answers; a silent stream is requested again after it, ns.
const PATIENCE_NS: i64 = 1_000_000_000;
/// The version that the question for capabilities has.
const ASKED_VERSION: u32 = 3;
const MS_NS: i64 = 1_000_000;
/// A request that was not answered so often is not understood.
const MOST_UNANSWERED: u32 = 3;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Nothing asked yet.
    Idle,
    /// Requested capabilities (versions 3 and 4).
    Capability,
    /// Requested the version (versions 1 and 2).
    Version,
    /// Told which signal to report (versions 3 and 4).
    Signals,
    /// Asked to start.
    Started,
}

/// The PC's side of one controller's stream.
#[derive(Clone, Debug)]
pub struct StreamMotion {
    stage: Stage,
    since_ns: i64,
    /// Message to send at the next call, and the stage after it.
    next: Option<(Stage, Vec<u8>)>,
    /// The input that is to be reported.
    signal: Option<Signal>,
    /// Number of unanswered requests.
    unanswered: u32,
    refused: Option<String>,
    version: Option<u32>,
    tool: bool,
    awaits_commands: bool,
    clock: WrappingClock,
}

impl StreamMotion {
    /// Listens, also to an input if one is named.
    #[must_use]
    pub fn new(signal: Option<Signal>) -> Self {
        Self {
            stage: Stage::Idle,
            since_ns: 0,
            next: None,
            signal,
            unanswered: 0,
            refused: None,
            version: None,
            tool: false,
            awaits_commands: false,
            clock: WrappingClock::default(),
        }
    }
}

impl Default for StreamMotion {
    fn default() -> Self {
        Self::new(None)
    }
}

impl DatagramProtocol for StreamMotion {
    type Raw = Status;

    fn decode(&self, bytes: &[u8]) -> Result<(u32, Status), Rejection> {
        let status = status(bytes)?;
        Ok((status.sequence, status))
    }

    fn place(&mut self, raw: Status, status: SequenceStatus) -> (RobotPose, SequenceStatus) {
        let numbers = match status {
            SequenceStatus::First => None,
            SequenceStatus::Newest { skipped } => Some(skipped.saturating_add(1)),
            SequenceStatus::Late => Some(1),
        };
        let pose = RobotPose {
            sequence: raw.sequence,
            device_ns: self.clock.unwrapped_ns(raw.time_ms, MS_NS, numbers),
            base_from_tool: raw.pose,
            status: raw.stopped.map_or(RobotStatus::Ready, RobotStatus::Stopped),
            inputs: match self.version {
                Some(3..) => self.signal.and(raw.signals).map(|signals| signals & 1),
                _ => raw.signals,
            },
        };
        (pose, status)
    }

    fn about(&self) -> SourceAbout {
        let version = self.version.map_or_else(|| "not agreed yet".to_owned(), |v| format!("version {v}"));
        SourceAbout {
            protocol: format!("FANUC Stream Motion (J519), {version}"),
            pose: if self.tool { PoseMeaning::TcpInActiveBase } else { PoseMeaning::FlangeInWorld },
            clock: "ms, in steps of 2",
            controller: None,
            notes: self.signal.map(|signal| format!("input 0 is {signal}")).into_iter().collect(),
        }
    }

    fn ask(&mut self, now_ns: i64) -> Vec<Vec<u8>> {
        if let Some((stage, packet)) = self.next.take() {
            (self.stage, self.since_ns) = (stage, now_ns);
            return vec![packet];
        }
        if self.refusal().is_some() || (self.stage != Stage::Idle && now_ns - self.since_ns < PATIENCE_NS) {
            return Vec::new();
        }
        self.since_ns = now_ns;
        if self.stage == Stage::Signals {
            self.unanswered += 1;
            if let (MOST_UNANSWERED.., Some(signal)) = (self.unanswered, self.signal) {
                self.refused =
                    Some(format!("the controller does not answer when it is asked to report {signal}"));
                return Vec::new();
            }
        }
        if self.stage == Stage::Capability {
            self.stage = Stage::Version;
            return vec![head(VERSION_REQUEST, 1)];
        }
        self.stage = Stage::Capability;
        vec![head(STOP, ASKED_VERSION), words(&[CAPABILITY, ASKED_VERSION, 1, 0, 0, 0, 0])]
    }

    fn notice(&mut self, bytes: &[u8], now_ns: i64) {
        if let (Some(capability), Stage::Capability) = (Capability::read(bytes), self.stage) {
            self.version = Some(capability.version);
            self.tool = capability.tool;
            self.next = Some(match self.signal {
                Some(signal) => (Stage::Signals, signal.request(capability.version)),
                None => (Stage::Started, head(START, capability.version)),
            });
        } else if let (12, Stage::Signals, Some(SIGNALS), Some(result), Some(version)) =
            (bytes.len(), self.stage, word(bytes, 0), word(bytes, 1), self.version)
        {
            match (result, self.signal) {
                (0, _) | (_, None) => self.next = Some((Stage::Started, head(START, version))),
                (code, Some(signal)) => {
                    self.refused = Some(format!("the controller does not report {signal} (error {code})"));
                }
            }
        } else if let (true, Stage::Version, Some(VERSION_REQUEST), Some(version)) =
            (bytes.len() == 8, self.stage, word(bytes, 0), word(bytes, 1))
        {
            self.version = Some(version);
            match self.signal {
                None => self.next = Some((Stage::Started, head(START_OLD, version))),
                Some(signal) => {
                    self.refused = Some(format!(
                        "version {version} of Stream Motion reports {signal} only where commands ask for it, and none is ever sent"
                    ));
                }
            }
        } else if let (Ok(status), Stage::Started) = (status(bytes), self.stage) {
            self.since_ns = now_ns;
            self.awaits_commands |= status.awaits_commands;
        }
    }

    fn refusal(&self) -> Option<String> {
        let another = self.awaits_commands.then(|| {
            "another program streams motion to this controller (its status reports that commands are \
            awaited); stop it, then listen"
                .to_owned()
        });
        another.or_else(|| self.refused.clone())
    }

    /// Not where another program streams: the stop would be its end.
    fn farewell(&self) -> Option<Vec<u8>> {
        let version = self.version.unwrap_or(ASKED_VERSION);
        (!self.awaits_commands).then(|| head(STOP, version))
    }
}
