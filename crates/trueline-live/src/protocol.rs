//! Protocols of robots, and opening a robot's stream.

use crate::endpoint::Endpoint;
use crate::fanuc::{Hspo, Signal, StreamMotion};
use crate::host_clock::HostClock;
use crate::kuka::{EthernetConfig, InputElement, Rsi, ZeroAnswer};
use crate::robot_link::RobotLink;
use crate::udp_source::UdpSource;
use crate::ur::RtdeSource;
use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Protocol of a robot.
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
    /// KUKA's Robot Sensor Interface: the robot speaks first (UDP).
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

    /// Points to check on the controller if nothing came.
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
                "RSI sends between RSI_ON and RSI_OFF, to IP_NUMBER and PORT of its Ethernet XML; ONLYSEND must be TRUE (or answers \
                 be consented to) and DEF_RIst in SEND."
            }
            Self::Egm => "Its program must run, up to EGMStreamStart or EGMRunPose.",
        }
    }
}

/// Addresses of PC and robot, as far as known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkAddress {
    /// Protocol of the robot.
    pub protocol: Protocol,
    /// Address of the PC, for a robot that speaks first.
    pub bind: Option<SocketAddr>,
    /// The robot; of those that speak first, the only accepted one.
    pub robot: Option<IpAddr>,
    /// Port of a robot that the PC calls, if not its protocol's own.
    pub robot_port: Option<u16>,
}

/// Options of a robot's stream besides its address.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LinkOptions {
    /// Digital input to report, in the robot's own words; for robots with streams that do not contain the inputs.
    pub inputs: Option<String>,
    /// Consent to answer a KUKA controller, which was configured so.
    pub answer: Option<EthernetConfig>,
}

/// Why a robot's stream cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The PC's address is missing.
    #[error("this robot speaks first, and the address at which this PC listens is missing")]
    BindMissing,
    /// The PC's address is stated but not needed.
    #[error("the PC calls this robot, from a port that the system chooses")]
    BindNotNeeded,
    /// The robot's address is missing.
    #[error("the PC calls this robot, and its address is missing")]
    RobotMissing,
    /// A port of the robot is stated.
    #[error("this robot speaks first, from a port of its own")]
    RobotPortNotNeeded,
    /// Port 0, which no controller can know.
    #[error("{address}: a controller needs a fixed port")]
    AnyPort {
        /// The address.
        address: SocketAddr,
    },
    /// An input is named for a robot with all inputs in its stream.
    #[error("this robot's stream contains its inputs, if its controller is set to send them")]
    InputsNotNeeded,
    /// Not the name of an input.
    #[error("{0}")]
    Inputs(String),
    /// Answers for a robot that waits for none.
    #[error("this robot waits for no answers")]
    AnswerNotNeeded,
    /// Answers to any sender.
    #[error("only a robot that is named is answered")]
    AnswerWithoutRobot,
    /// The file with the configuration cannot be read.
    #[error("{}: {why}", .file.display())]
    Config {
        /// The file.
        file: PathBuf,
        /// The fault.
        why: String,
    },
    /// The configuration does not go with answers.
    #[error("{0}")]
    Answer(String),
    /// The operating system refuses.
    #[error("{address}: cannot listen: {error}")]
    Io {
        /// The local address, or the called one.
        address: SocketAddr,
        /// The error.
        error: io::Error,
    },
}

impl LinkAddress {
    /// The local address, or the called one.
    ///
    /// # Errors
    /// Missing or superfluous options.
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
    /// Missing or superfluous options; error of the operating system.
    pub fn open(&self, clock: HostClock) -> Result<RobotLink, LinkError> {
        self.open_with(&LinkOptions::default(), clock)
    }

    /// Opens the stream with its options.
    ///
    /// # Errors
    /// Missing or superfluous options; error of the operating system.
    pub fn open_with(&self, options: &LinkOptions, clock: HostClock) -> Result<RobotLink, LinkError> {
        let address = self.check()?;
        let (inputs, signal, answer) = (options.element(self)?, options.signal(self)?, options.answer(self)?);
        let link =
            match self.protocol {
                Protocol::Egm => Endpoint::bind(address, self.robot, clock)
                    .map(|endpoint| RobotLink::Egm(Box::new(endpoint))),
                Protocol::FanucHspo => {
                    UdpSource::listen(address, self.robot, Hspo::default(), clock).map(RobotLink::other)
                }
                Protocol::KukaRsi => UdpSource::listen(address, self.robot, Rsi::new(inputs, answer), clock)
                    .map(RobotLink::other),
                Protocol::UrRtde => Ok(RobotLink::other(RtdeSource::new(address, clock))),
                Protocol::FanucStreamMotion => {
                    UdpSource::call(address, StreamMotion::new(signal), clock).map(RobotLink::other)
                }
            };
        tracing::info!(protocol = ?self.protocol, %address, "robot link opened");
        link.map_err(|error| LinkError::Io { address, error })
    }
}

impl LinkOptions {
    /// Refuses options that do not fit the robot, before anything is opened.
    ///
    /// # Errors
    /// The missing or superfluous option.
    pub fn check(&self, address: &LinkAddress) -> Result<(), LinkError> {
        self.element(address)?;
        self.signal(address)?;
        self.answer(address).map(|_| ())
    }

    fn element(&self, address: &LinkAddress) -> Result<Option<InputElement>, LinkError> {
        let named = self.inputs.as_deref().filter(|_| address.protocol == Protocol::KukaRsi);
        named.map(|name| name.parse().map_err(|error| inputs(name, &error))).transpose()
    }

    fn signal(&self, address: &LinkAddress) -> Result<Option<Signal>, LinkError> {
        match (self.inputs.as_deref(), address.protocol) {
            (Some(name), Protocol::FanucStreamMotion) => {
                name.parse().map(Some).map_err(|error| inputs(name, &error))
            }
            (None, _) | (_, Protocol::KukaRsi) => Ok(None),
            (Some(_), Protocol::Egm | Protocol::UrRtde | Protocol::FanucHspo) => {
                Err(LinkError::InputsNotNeeded)
            }
        }
    }

    fn answer(&self, address: &LinkAddress) -> Result<Option<ZeroAnswer>, LinkError> {
        let Some(config) = &self.answer else { return Ok(None) };
        if address.protocol != Protocol::KukaRsi {
            return Err(LinkError::AnswerNotNeeded);
        }
        if address.robot.is_none() {
            return Err(LinkError::AnswerWithoutRobot);
        }
        let bound = address.check()?.port();
        ZeroAnswer::of(config, bound).map(Some).map_err(|error| LinkError::Answer(error.to_string()))
    }
}

/// Reads the Ethernet configuration of a KUKA controller.
///
/// # Errors
/// A file that cannot be read, or that is not such a configuration.
pub fn read_ethernet_config(file: &Path) -> Result<EthernetConfig, LinkError> {
    let why = |why: String| LinkError::Config { file: file.to_owned(), why };
    let text = fs::read_to_string(file).map_err(|error| why(error.to_string()))?;
    EthernetConfig::read(&text).map_err(|error| why(error.to_string()))
}

fn inputs(name: &str, error: &dyn std::fmt::Display) -> LinkError {
    LinkError::Inputs(format!("`{name}`: {error}"))
}
