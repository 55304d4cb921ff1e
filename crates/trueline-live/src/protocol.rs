//! What robots speak, and how a robot's stream is opened.

use crate::endpoint::Endpoint;
use crate::fanuc::{Hspo, StreamMotion};
use crate::host_clock::HostClock;
use crate::kuka::Rsi;
use crate::robot_link::RobotLink;
use crate::udp_source::UdpSource;
use crate::ur::RtdeSource;
use std::io;
use std::net::{IpAddr, SocketAddr};

/// What a robot speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    /// ABB's Externally Guided Motion: the robot speaks first (UDP).
    Egm,
    /// Universal Robots' RTDE: the PC calls (TCP).
    UrRtde,
    /// FANUC's High Speed Position Output: the robot speaks first (UDP).
    FanucHspo,
    /// FANUC's Stream Motion, J519: the PC asks (UDP).
    FanucStreamMotion,
    /// KUKA's Robot Sensor Interface with ONLYSEND: the robot speaks first (UDP).
    KukaRsi,
}

impl Protocol {
    /// Port at which the controller listens, if the PC speaks first.
    #[must_use]
    pub fn controllers_port(self) -> Option<u16> {
        match self {
            Self::UrRtde => Some(crate::ur::PORT),
            Self::FanucStreamMotion => Some(crate::fanuc::STREAM_MOTION_PORT),
            Self::Egm | Self::FanucHspo | Self::KukaRsi => None,
        }
    }

    /// What to look at on the controller if nothing came.
    #[must_use]
    pub fn advice_if_silent(self) -> &'static str {
        match self {
            Self::UrRtde => {
                "From PolyScope 5.10 on RTDE is off until it is enabled under Settings, Security, Services."
            }
            Self::FanucStreamMotion => {
                "Stream Motion needs option J519 (with R912, or S636), and no other PC may listen to it."
            }
            Self::FanucHspo => {
                "High Speed Position Output is an option; its system variables name this PC's address and port."
            }
            Self::KukaRsi => {
                "RSI sends between RSI_ON and RSI_OFF, to IP_NUMBER and PORT of its Ethernet XML; ONLYSEND must be TRUE and \
                 DEF_RIst in SEND."
            }
            Self::Egm => "Its program must run, up to EGMStreamStart or EGMRunPose.",
        }
    }
}

/// Where PC and robot are, as far as it is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkAddress {
    /// What the robot speaks.
    pub protocol: Protocol,
    /// Where the PC listens, for a robot that speaks first.
    pub bind: Option<SocketAddr>,
    /// The robot; of those that speak first, the only one that is believed.
    pub robot: Option<IpAddr>,
    /// Port of a robot that the PC calls, if not its protocol's own.
    pub robot_port: Option<u16>,
}

/// Why a robot's stream cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// It is not said where the PC listens.
    #[error("this robot speaks first, and the address at which this PC listens is missing")]
    BindMissing,
    /// It is said where the PC listens.
    #[error("the PC calls this robot, from a port that the system chooses")]
    BindNotNeeded,
    /// It is not said where the robot is.
    #[error("the PC calls this robot, and its address is missing")]
    RobotMissing,
    /// It is said at which port the robot listens.
    #[error("this robot speaks first, from a port of its own")]
    RobotPortNotNeeded,
    /// Port 0, of which no controller can know.
    #[error("{address}: a controller cannot know which port that is")]
    AnyPort {
        /// The address.
        address: SocketAddr,
    },
    /// The operating system refuses.
    #[error("{address}: cannot listen: {error}")]
    Io {
        /// Where was to be listened, or called.
        address: SocketAddr,
        /// What it says.
        error: io::Error,
    },
}

impl LinkAddress {
    /// Where the PC listens, or whom it calls.
    ///
    /// # Errors
    /// What is missing, or not needed.
    pub fn check(&self) -> Result<SocketAddr, LinkError> {
        match (self.protocol.controllers_port(), self.bind, self.robot) {
            (None, ..) if self.robot_port.is_some() => Err(LinkError::RobotPortNotNeeded),
            (None, Some(address), _) if address.port() == 0 => Err(LinkError::AnyPort { address }),
            (None, bind, _) => bind.ok_or(LinkError::BindMissing),
            (Some(_), Some(_), _) => Err(LinkError::BindNotNeeded),
            (Some(_), None, None) => Err(LinkError::RobotMissing),
            (Some(port), None, Some(robot)) => Ok(SocketAddr::new(robot, self.robot_port.unwrap_or(port))),
        }
    }

    /// Opens the stream.
    ///
    /// # Errors
    /// What is missing or not needed, and what the operating system says.
    pub fn open(&self, clock: HostClock) -> Result<RobotLink, LinkError> {
        let address = self.check()?;
        let link = match self.protocol {
            Protocol::Egm => {
                Endpoint::bind(address, self.robot, clock).map(|endpoint| RobotLink::Egm(Box::new(endpoint)))
            }
            Protocol::FanucHspo => {
                UdpSource::listen(address, self.robot, Hspo::default(), clock).map(RobotLink::other)
            }
            Protocol::KukaRsi => {
                UdpSource::listen(address, self.robot, Rsi::default(), clock).map(RobotLink::other)
            }
            Protocol::UrRtde => Ok(RobotLink::other(RtdeSource::new(address, clock))),
            Protocol::FanucStreamMotion => {
                UdpSource::call(address, StreamMotion::default(), clock).map(RobotLink::other)
            }
        };
        link.map_err(|error| LinkError::Io { address, error })
    }
}
