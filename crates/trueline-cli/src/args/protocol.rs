//! Protocols of robots, and their addresses.

use crate::args::choice::{Choice, one_of};
use clap::Args;
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use trueline_cell::{ARRIVAL, READING};
#[cfg(feature = "ros2")]
use trueline_cell::{Ros2Source, Ros2Topic, TRANSFORMS};
use trueline_live::protocol::read_ethernet_config;
use trueline_live::{HostClock, LinkAddress, LinkError, LinkOptions, Protocol, RobotLink};

/// Protocols of robots.
pub(crate) static PROTOCOLS: [Choice<Protocol>; 5] = [
    ("egm", "ABB's Externally Guided Motion: the robot speaks first (UDP)", Protocol::Egm),
    ("ur-rtde", "Universal Robots' RTDE: the PC calls (TCP 30004)", Protocol::UrRtde),
    ("fanuc-hspo", "FANUC's High Speed Position Output: the robot speaks first (UDP)", Protocol::FanucHspo),
    (
        "fanuc-stream-motion",
        "FANUC's Stream Motion, J519: the PC asks (UDP 60015)",
        Protocol::FanucStreamMotion,
    ),
    (
        "kuka-rsi",
        "KUKA's Robot Sensor Interface: the robot speaks first (UDP); without ONLYSEND see --answer-rsi",
        Protocol::KukaRsi,
    ),
];

/// A topic of ROS 2 instead.
#[cfg(feature = "ros2")]
#[derive(Args)]
pub(crate) struct Ros2Args {
    /// Topic of ROS 2 to listen to instead of a robot's own protocol, for example /tcp_pose
    #[arg(long = "ros2", value_name = "TOPIC", conflicts_with_all = ["protocol", "bind", "robot", "robot_port", "inputs", "answer_rsi"])]
    pub(crate) topic: Option<String>,
    /// Type of the topic's messages [default: geometry_msgs/msg/PoseStamped; tf2_msgs/msg/TFMessage with --ros2-frames]
    #[arg(long = "ros2-type", value_name = "TYPE", requires = "topic")]
    pub(crate) message: Option<String>,
    /// Of a topic of transforms, as /tf: the frame of the robot's base and that of the tool, for example base:tool0
    #[arg(long = "ros2-frames", value_name = "BASE:TOOL", requires = "topic", value_parser = frames)]
    pub(crate) frames: Option<[String; 2]>,
    /// ROS_DOMAIN_ID of the robot's driver
    #[arg(long = "ros2-domain", value_name = "ID", requires = "topic", default_value_t = 0)]
    pub(crate) domain: u16,
    /// Address of this PC on the robot's network; 127.0.0.1 for a driver on this PC
    #[arg(long = "ros2-network", value_name = "IP", requires = "topic", default_value = "127.0.0.1")]
    pub(crate) network: IpAddr,
}

/// A robot, and the port that the PC calls.
#[derive(Clone, Copy)]
pub(crate) struct RobotAddress {
    ip: IpAddr,
    port: Option<u16>,
}

fn robot_address(text: &str) -> Result<RobotAddress, String> {
    let with_port =
        || text.parse::<SocketAddr>().map(|at| RobotAddress { ip: at.ip(), port: Some(at.port()) });
    let alone = text.parse().map(|ip| RobotAddress { ip, port: None });
    alone
        .or_else(|_: std::net::AddrParseError| with_port())
        .map_err(|_| "write 192.168.0.10 or 192.168.0.10:30004".to_owned())
}

#[derive(Args)]
pub(crate) struct LinkArgs {
    /// Protocol of the robot
    #[arg(long, value_parser = one_of(&PROTOCOLS), default_value = "egm")]
    pub(crate) protocol: Protocol,
    /// Address of this PC and port to listen at, for example 192.168.125.10:6510, for a robot that speaks first
    #[arg(long, value_name = "IP:PORT")]
    pub(crate) bind: Option<SocketAddr>,
    /// The robot's address [default: the first sender of a valid frame]; where the PC calls, with a port other than that of the protocol
    #[arg(long, value_name = "IP[:PORT]", value_parser = robot_address)]
    pub(crate) robot: Option<RobotAddress>,
    /// The port by itself, for scripts
    #[arg(long, value_name = "PORT", hide = true)]
    pub(crate) robot_port: Option<u16>,
    /// Digital input to hear of: DI101 or RI1 of fanuc-stream-motion 3 and 4, the TAG that holds it of kuka-rsi [default there: DiL]
    #[arg(long, value_name = "NAME")]
    pub(crate) inputs: Option<String>,
    /// kuka-rsi without ONLYSEND: consent to answer every message of --robot with zero corrections, as the controller's Ethernet
    /// configuration awaits it. This PC is then part of the robot's motion loop: the robot stops when it ends or is late
    #[arg(long, value_name = "ETHERNET.xml")]
    pub(crate) answer_rsi: Option<PathBuf>,
    #[cfg(feature = "ros2")]
    #[command(flatten)]
    pub(crate) ros2: Ros2Args,
}

impl LinkArgs {
    /// Addresses of PC and robot.
    pub(crate) fn address(&self) -> LinkAddress {
        let Self { protocol, bind, robot, .. } = *self;
        let robot_port = robot.and_then(|robot| robot.port).or(self.robot_port);
        LinkAddress { protocol, bind, robot: robot.map(|robot| robot.ip), robot_port }
    }

    fn options(&self) -> Result<LinkOptions, LinkError> {
        let answer = self.answer_rsi.as_deref().map(read_ethernet_config).transpose()?;
        Ok(LinkOptions { inputs: self.inputs.clone(), answer })
    }

    /// Refuses missing and unneeded options, before anything is opened.
    ///
    /// # Errors
    /// [`LinkError`] says what.
    pub(crate) fn check(&self) -> Result<(), LinkError> {
        #[cfg(feature = "ros2")]
        if self.ros2.topic.is_some() {
            return Ok(());
        }
        self.address().check()?;
        self.options()?.check(&self.address())
    }

    /// Opens the robot's stream.
    ///
    /// # Errors
    /// [`LinkError`] names missing and unneeded options, and the operating system's error.
    pub(crate) fn open(&self, clock: HostClock) -> Result<RobotLink, LinkError> {
        #[cfg(feature = "ros2")]
        if let Some(topic) = self.ros2.topic() {
            let address = (topic.network, 0).into();
            let source = Ros2Source::open(topic, clock).map_err(|error| LinkError::Io { address, error })?;
            return Ok(RobotLink::other(source));
        }
        self.address().open_with(&self.options()?, clock)
    }

    /// Points to check if nothing came.
    pub(crate) fn advice_if_silent(&self) -> &'static str {
        #[cfg(feature = "ros2")]
        if self.ros2.topic.is_some() {
            return "`ros2 topic info TOPIC` on the driver's PC shows whether it is published, and its type; ROS_DOMAIN_ID and the \
                    network are --ros2-domain and --ros2-network here, and networks must carry multicast.";
        }
        self.protocol.advice_if_silent()
    }

    /// Kind of the poses' stamps: the kernel's, if it stamps.
    pub(crate) fn stamps(&self) -> &'static str {
        #[cfg(feature = "ros2")]
        if self.ros2.topic.is_some() {
            return READING;
        }
        if self.protocol == Protocol::UrRtde { READING } else { ARRIVAL }
    }
}

#[cfg(feature = "ros2")]
impl Ros2Args {
    fn topic(&self) -> Option<Ros2Topic> {
        let (topic, frames) = (self.topic.clone()?, self.frames.clone());
        let usual = if frames.is_some() { TRANSFORMS } else { "geometry_msgs/msg/PoseStamped" };
        let message = self.message.clone().unwrap_or_else(|| usual.to_owned());
        Some(Ros2Topic { topic, message, frames, urdf: None, domain: self.domain, network: self.network })
    }
}

#[cfg(feature = "ros2")]
pub(crate) fn frames(text: &str) -> Result<[String; 2], String> {
    let (base, tool) = text
        .split_once(':')
        .filter(|(base, tool)| !base.is_empty() && !tool.is_empty())
        .ok_or("write BASE:TOOL, the names of two frames, for example base:tool0")?;
    if base.trim_start_matches('/') == tool.trim_start_matches('/') {
        return Err("base and tool are to be different frames".to_owned());
    }
    Ok([base, tool].map(str::to_owned))
}
