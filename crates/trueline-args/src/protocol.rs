//! What robots speak, and where they are.

use crate::choice::{Choice, one_of};
use clap::Args;
use std::net::{IpAddr, SocketAddr};
use trueline_live::{LinkAddress, Protocol};

/// What robots speak.
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
        "KUKA's Robot Sensor Interface with ONLYSEND: the robot speaks first (UDP)",
        Protocol::KukaRsi,
    ),
];

#[derive(Args)]
pub struct LinkArgs {
    /// What the robot speaks
    #[arg(long, value_parser = one_of(&PROTOCOLS), default_value = "egm")]
    pub protocol: Protocol,
    /// Address of this PC and port to listen at, for example 192.168.125.10:6510, for a robot that speaks first
    #[arg(long, value_name = "IP:PORT")]
    pub bind: Option<SocketAddr>,
    /// The robot's address [default: the first sender of a valid frame]
    #[arg(long, value_name = "IP")]
    pub robot: Option<IpAddr>,
    /// Port of a robot that the PC calls [default: that of its protocol]
    #[arg(long, value_name = "PORT")]
    pub robot_port: Option<u16>,
}

impl LinkArgs {
    /// Where PC and robot are.
    pub fn address(&self) -> LinkAddress {
        let Self { protocol, bind, robot, robot_port } = *self;
        LinkAddress { protocol, bind, robot, robot_port }
    }
}
