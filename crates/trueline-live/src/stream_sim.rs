//! A simulated controller of another make than ABB, in real time: UR, FANUC, KUKA.

use crate::controller::{Network, NetworkSettings, Wiring, WiringSettings};
use crate::fanuc::stream_motion_sim::StreamMotionController;
use crate::kuka::EthernetConfig;
use crate::kuka::rsi_sim::{AnswerCounts, RsiController};
use crate::pose_feed::PoseFeed;
use crate::protocol::Protocol;
use crate::udp_sim::{Sent, Speech, UdpRobot};
use crate::ur::{RtdeServer, ServerSettings};
use std::fmt;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::ops::ControlFlow;
use std::ops::RangeInclusive;
use std::time::Duration;

/// First and last value of R-30iB's µs counter, as users met it.
const HSPO_COUNTER_US: (u32, u32) = (0, 129_000_000);
/// An IPOC as controllers have it after some weeks.
const IPOC: u64 = 4_208_163_634;
/// `Timeout` of the ETHERNET object as it comes.
const RSI_TIMEOUT_CYCLES: u32 = 100;
/// Clients of RTDE treat a controller as booting for the first 40 s.
const UR_EPOCH_S: f64 = 100.0;

/// Settings of the simulation.
#[derive(Clone, Debug)]
pub struct StreamSim {
    /// Protocol of the controller.
    pub protocol: Protocol,
    /// Its own address, or the PC's if it speaks first.
    pub address: SocketAddr,
    /// Poses of the robot.
    pub feed: PoseFeed,
    /// Version of the protocol; 2 of RTDE and 3 of Stream Motion if not given.
    pub version: Option<u32>,
    /// Time between messages, ms; the protocol's usual one if not given. RTDE's clients choose.
    pub period_ms: Option<u32>,
    /// Rate error of the controller's clock, positive if fast, parts per million.
    pub drift_ppm: f64,
    /// The way to the PC; TCP loses nothing.
    pub network: NetworkSettings,
    /// Seed of the losses.
    pub seed: u64,
    /// Its wiring.
    pub wiring: WiringSettings,
    /// KUKA: answers are awaited, by this configuration.
    pub awaits: Option<EthernetConfig>,
}

/// Report on a simulated controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StreamSimReport {
    /// A server of RTDE.
    Rtde {
        /// Packages of data sent.
        packages: u64,
    },
    /// A controller that sends datagrams.
    Datagrams {
        /// Counts of the socket's messages.
        sent: Sent,
        /// Datagrams lost on purpose.
        lost: u64,
        /// Of Stream Motion: packets refused, and commands of motion that were not followed.
        refused_and_commands: Option<(u64, u64)>,
        /// For RSI without ONLYSEND: counts of the answers.
        answers: Option<AnswerCounts>,
    },
}

/// Versions that can be simulated; none of protocols that have none.
#[must_use]
pub fn versions(protocol: Protocol) -> Option<RangeInclusive<u32>> {
    match protocol {
        Protocol::UrRtde => Some(1..=2),
        Protocol::FanucStreamMotion => Some(1..=4),
        Protocol::Egm | Protocol::FanucHspo | Protocol::KukaRsi => None,
    }
}

impl StreamSim {
    /// Runs until told to stop; `each` is called after every cycle with the time since the start.
    ///
    /// # Errors
    /// Error of the operating system; EGM, which [`crate::controller`] simulates.
    pub fn run(self, each: impl Fn(Duration) -> ControlFlow<()>) -> io::Result<StreamSimReport> {
        if self.protocol != Protocol::UrRtde {
            return self.run_datagrams(each);
        }
        let wiring = Wiring::new(&self.wiring)?;
        let version = self.version.unwrap_or(2) as u16;
        let settings =
            ServerSettings { feed: self.feed, epoch_s: UR_EPOCH_S, drift_ppm: self.drift_ppm, version };
        let mut server = RtdeServer::bind(self.address, settings)?.wired(wiring);
        server.run(|_, passed| each(passed))?;
        Ok(StreamSimReport::Rtde { packages: server.sent() })
    }

    fn run_datagrams(self, each: impl Fn(Duration) -> ControlFlow<()>) -> io::Result<StreamSimReport> {
        let (speech, usual_ms) = self.speech()?;
        let (bind, pc) = match self.protocol.controllers_port() {
            Some(_) => (self.address, None),
            None => {
                let any = if self.address.ip().is_loopback() { self.address.ip() } else { [0; 4].into() };
                (SocketAddr::new(any, 0), Some(self.address))
            }
        };
        let socket = UdpSocket::bind(bind)?;
        let mut robot = UdpRobot {
            speech,
            feed: self.feed,
            period_ms: self.period_ms.unwrap_or(usual_ms),
            drift_ppm: self.drift_ppm,
            network: Network::new(self.network, self.seed),
            wiring: Wiring::new(&self.wiring)?,
        };
        let sent = robot.run(&socket, pc, |_, passed| each(passed))?;
        let (refused_and_commands, answers) = match &robot.speech {
            Speech::StreamMotion(controller) => (Some(controller.counts()), None),
            Speech::Rsi { controller, .. } => (None, controller.answers()),
            Speech::Hspo { .. } => (None, None),
        };
        Ok(StreamSimReport::Datagrams { sent, lost: robot.network.lost(), refused_and_commands, answers })
    }

    /// Its protocol, and its usual time between messages, ms.
    fn speech(&self) -> io::Result<(Speech, u32)> {
        match self.protocol {
            Protocol::KukaRsi => {
                let controller = match &self.awaits {
                    Some(config) => RsiController::awaiting(config.sentype.clone(), RSI_TIMEOUT_CYCLES),
                    None => RsiController::default(),
                };
                Ok((Speech::Rsi { begins: IPOC, controller }, 4))
            }
            Protocol::FanucStreamMotion => {
                let (version, period_ms) = (self.version.unwrap_or(3), self.period_ms.unwrap_or(8));
                Ok((Speech::StreamMotion(StreamMotionController::new(version, period_ms)), 8))
            }
            Protocol::FanucHspo => {
                Ok((Speech::Hspo { begins_us: HSPO_COUNTER_US.0, wraps_us: HSPO_COUNTER_US.1 }, 8))
            }
            Protocol::Egm | Protocol::UrRtde => {
                Err(io::Error::new(io::ErrorKind::Unsupported, "it does not stream by these datagrams"))
            }
        }
    }
}

impl fmt::Display for StreamSimReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rtde { packages } => write!(f, "{packages} packages of data sent"),
            Self::Datagrams {
                sent: Sent { cycles, datagrams, received },
                lost,
                refused_and_commands,
                answers,
            } => {
                write!(
                    f,
                    "{cycles} cycles, {datagrams} datagrams sent, {lost} lost on purpose, {received} received"
                )?;
                if let Some((refused, commands)) = refused_and_commands {
                    write!(f, "; {refused} of them refused, {commands} commands of motion not followed")?;
                }
                answers.map_or(Ok(()), |answers| write!(f, "; {answers}"))
            }
        }
    }
}
