//! Listening to Stream Motion: stop, ask what the controller can do, start, and from then on nothing is sent. No command ever.
//!
//! Where another program streams motion (the status says that commands are awaited), silence would not be harmless: then
//! the stream is left alone.

use super::stream_motion_packets::{
    CAPABILITY, Capability, START, START_OLD, STOP, Status, VERSION_REQUEST, head, status, word, words,
};
use super::wrapping_clock::WrappingClock;
use crate::frame_filter::{Rejection, SequenceStatus};
use crate::robot_source::{PoseMeaning, RobotPose, RobotStatus, SourceAbout};
use crate::udp_source::DatagramProtocol;

/// Answers are waited for so long, and a silent stream is asked for again after it, ns.
const PATIENCE_NS: i64 = 1_000_000_000;
/// The version that the question for capabilities has.
const ASKED_VERSION: u32 = 3;
const MS_NS: i64 = 1_000_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Nothing asked yet.
    Idle,
    /// Asked for capabilities (versions 3 and 4).
    Capability,
    /// Asked for the version (versions 1 and 2).
    Version,
    /// Asked to start.
    Started,
}

/// The PC's side of one controller's stream.
#[derive(Clone, Debug)]
pub struct StreamMotion {
    stage: Stage,
    since_ns: i64,
    /// Start with it as soon as the socket is asked.
    start: Option<Vec<u8>>,
    version: Option<u32>,
    tool: bool,
    awaits_commands: bool,
    clock: WrappingClock,
}

impl Default for StreamMotion {
    fn default() -> Self {
        Self {
            stage: Stage::Idle,
            since_ns: 0,
            start: None,
            version: None,
            tool: false,
            awaits_commands: false,
            clock: WrappingClock::default(),
        }
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
            inputs: None,
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
            notes: Vec::new(),
        }
    }

    fn ask(&mut self, now_ns: i64) -> Vec<Vec<u8>> {
        if let Some(start) = self.start.take() {
            (self.stage, self.since_ns) = (Stage::Started, now_ns);
            return vec![start];
        }
        if self.awaits_commands || (self.stage != Stage::Idle && now_ns - self.since_ns < PATIENCE_NS) {
            return Vec::new();
        }
        self.since_ns = now_ns;
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
            self.start = Some(head(START, capability.version));
        } else if let (true, Stage::Version, Some(VERSION_REQUEST), Some(version)) =
            (bytes.len() == 8, self.stage, word(bytes, 0), word(bytes, 1))
        {
            self.version = Some(version);
            self.start = Some(head(START_OLD, version));
        } else if let (Ok(status), Stage::Started) = (status(bytes), self.stage) {
            self.since_ns = now_ns;
            self.awaits_commands |= status.awaits_commands;
        }
    }

    fn refusal(&self) -> Option<String> {
        self.awaits_commands.then(|| {
            "another program streams motion to this controller (the status says that commands are awaited); \
             stop it, then listen"
                .to_owned()
        })
    }

    /// Not where another program streams: the stop would be its end.
    fn farewell(&self) -> Option<Vec<u8>> {
        let version = self.version.unwrap_or(ASKED_VERSION);
        (!self.awaits_commands).then(|| head(STOP, version))
    }
}
