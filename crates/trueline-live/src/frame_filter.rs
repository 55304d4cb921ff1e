//! Which datagrams are the robot's: everything else is counted with its reason, and nothing more.

use crate::egm::{EgmRobot, WireError};
use crate::robot_frame::{FrameError, RobotFrame};
use crate::stamped_socket::LONGEST_BYTES;
use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};

/// Why a datagram is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Rejection {
    /// From somebody else than the robot that is listened to.
    #[error("from another sender")]
    OtherSender,
    /// Without a byte.
    #[error("empty")]
    Empty,
    /// Longer than any EGM message.
    #[error("longer than any EGM message")]
    TooLong,
    /// No EGM message.
    #[error("not an EGM message: {0}")]
    Wire(#[from] WireError),
    /// An EGM message that cannot be relied on.
    #[error("not usable: {0}")]
    Frame(#[from] FrameError),
    /// A packet of another robot's protocol that cannot be used.
    #[error("not usable: {0}")]
    Packet(#[from] PacketError),
    /// Its sequence number was there already.
    #[error("a repetition")]
    Repeated,
    /// Its sequence number is further ahead than frames can have been lost.
    #[error("a sequence number far ahead")]
    FarAhead,
    /// Its sequence number is older than any delayed one.
    #[error("a stale sequence number")]
    Stale,
}

impl Rejection {
    /// Whether it belongs to the robot's stream but is not needed.
    #[must_use]
    pub fn is_needless(&self) -> bool {
        matches!(self, Self::Packet(PacketError::NotNeeded(_)))
    }
}

/// Why a packet of a robot other than ABB's is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PacketError {
    /// Not the length that it should have.
    #[error("{found} bytes are not a packet of this protocol")]
    Length {
        /// Its bytes.
        found: usize,
    },
    /// Another kind of packet.
    #[error("a packet of type {found}")]
    Kind {
        /// Its kind.
        found: u32,
    },
    /// Something that is part of the protocol and not needed.
    #[error("{0}")]
    NotNeeded(&'static str),
    /// An invalid figure.
    #[error("a pose or time that is not a number")]
    NotFinite,
    /// A text that cannot be read.
    #[error("{0}")]
    Text(&'static str),
}

/// Place of an accepted frame in its session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SequenceStatus {
    /// The first frame of all, or the first after the controller began anew.
    First,
    /// The newest; this many numbers before it have not come (yet).
    Newest {
        /// Numbers left out directly before it.
        skipped: u32,
    },
    /// Overtaken by newer ones on the way: good data, but no longer to be answered.
    Late,
}

/// After so long a silence of the robot a lower sequence number, or another port, is a new session, ns.
pub(crate) const RESTART_SILENCE_NS: i64 = 100_000_000;
/// The same in periods of a robot that speaks rarely.
const SILENT_PERIODS: i64 = 5;
/// More numbers than this cannot be lost without a silence.
const FARTHEST_AHEAD: u32 = 10_000;
/// A frame may be overtaken by this many.
const LATE_WINDOW: u32 = 64;

/// Decides about datagrams, one after the other.
#[derive(Clone, Debug, Default)]
pub struct FrameFilter {
    allowed: Option<IpAddr>,
    robot: Option<SocketAddr>,
    /// Newest sequence number, and which of the 64 up to it were seen (bit 0 is the newest).
    newest: u32,
    seen: u64,
    accepted_ns: i64,
    /// First number of the session and when it came, ns.
    began: (u32, i64),
    accepted: u64,
    rejected: BTreeMap<String, u64>,
}

impl FrameFilter {
    /// Listens to one machine, or to the first sender of a valid frame.
    #[must_use]
    pub fn new(allowed: Option<IpAddr>) -> Self {
        Self { allowed, ..Self::default() }
    }

    /// The robot, once a frame of it was accepted.
    #[must_use]
    pub fn robot(&self) -> Option<SocketAddr> {
        self.robot
    }

    /// Frames accepted.
    #[must_use]
    pub fn accepted(&self) -> u64 {
        self.accepted
    }

    /// Datagrams rejected, by reason.
    #[must_use]
    pub fn rejected(&self) -> &BTreeMap<String, u64> {
        &self.rejected
    }

    /// Judges a datagram that came at a steady time, ns.
    ///
    /// # Errors
    /// Why it is not used.
    pub fn judge(
        &mut self,
        bytes: &[u8],
        from: SocketAddr,
        steady_ns: i64,
    ) -> Result<(RobotFrame, SequenceStatus), Rejection> {
        self.judge_as(bytes, from, steady_ns, |bytes| {
            let frame = RobotFrame::of(&EgmRobot::read(bytes)?)?;
            Ok((frame.sequence, frame))
        })
    }

    /// Judges a datagram of any protocol: `decode` gives its sequence number and its content.
    ///
    /// # Errors
    /// Why it is not used.
    pub fn judge_as<T>(
        &mut self,
        bytes: &[u8],
        from: SocketAddr,
        steady_ns: i64,
        decode: impl FnOnce(&[u8]) -> Result<(u32, T), Rejection>,
    ) -> Result<(T, SequenceStatus), Rejection> {
        let judged = self.decide(bytes, from, steady_ns, decode);
        match &judged {
            Ok(_) => self.accepted += 1,
            Err(reason) => *self.rejected.entry(reason.to_string()).or_default() += 1,
        }
        judged
    }

    fn decide<T>(
        &mut self,
        bytes: &[u8],
        from: SocketAddr,
        steady_ns: i64,
        decode: impl FnOnce(&[u8]) -> Result<(u32, T), Rejection>,
    ) -> Result<(T, SequenceStatus), Rejection> {
        let silent = steady_ns - self.accepted_ns >= self.restart_silence_ns();
        if !self.is_robot(from, silent) {
            return Err(Rejection::OtherSender);
        }
        if bytes.is_empty() {
            return Err(Rejection::Empty);
        }
        if bytes.len() > LONGEST_BYTES {
            return Err(Rejection::TooLong);
        }
        let (sequence, frame) = decode(bytes)?;
        let status = self.stand(sequence, from, silent)?;
        if status == SequenceStatus::First {
            self.began = (sequence, steady_ns);
        }
        self.robot = Some(from);
        self.accepted_ns = self.accepted_ns.max(steady_ns);
        Ok((frame, status))
    }

    /// Longer than the time between frames at any rate.
    fn restart_silence_ns(&self) -> i64 {
        let numbers = i64::from(self.newest.wrapping_sub(self.began.0)).max(1);
        let period_ns = (self.accepted_ns - self.began.1) / numbers;
        RESTART_SILENCE_NS.max(SILENT_PERIODS * period_ns)
    }

    fn is_robot(&self, from: SocketAddr, silent: bool) -> bool {
        if self.allowed.is_some_and(|ip| ip != from.ip()) {
            return false;
        }
        self.robot.is_none_or(|robot| robot == from || (silent && robot.ip() == from.ip()))
    }

    fn stand(&mut self, sequence: u32, from: SocketAddr, silent: bool) -> Result<SequenceStatus, Rejection> {
        let ahead = sequence.wrapping_sub(self.newest);
        let behind = self.newest.wrapping_sub(sequence);
        let is_new_session = self.robot != Some(from) || (silent && ahead > u32::MAX / 2);
        if is_new_session || (silent && ahead == 0) {
            (self.newest, self.seen) = (sequence, 1);
            return Ok(SequenceStatus::First);
        }
        if ahead == 0 {
            return Err(Rejection::Repeated);
        }
        if ahead <= u32::MAX / 2 {
            if ahead > FARTHEST_AHEAD && !silent {
                return Err(Rejection::FarAhead);
            }
            self.seen = self.seen.checked_shl(ahead).unwrap_or(0) | 1;
            self.newest = sequence;
            return Ok(SequenceStatus::Newest { skipped: ahead - 1 });
        }
        let bit = if behind < LATE_WINDOW { 1_u64 << behind } else { return Err(Rejection::Stale) };
        if self.seen & bit != 0 {
            return Err(Rejection::Repeated);
        }
        self.seen |= bit;
        Ok(SequenceStatus::Late)
    }
}
