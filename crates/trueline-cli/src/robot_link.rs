//! Opens what a robot speaks, from arguments.

use crate::args::ProtocolName;
use crate::commands::listen;
use crate::failure::Failure;
use std::net::{IpAddr, SocketAddr};
use trueline_live::fanuc::{Hspo, StreamMotion};
use trueline_live::kuka::Rsi;
use trueline_live::udp_source::UdpSource;
use trueline_live::ur::RtdeSource;
use trueline_live::{HostClock, RobotSource};

/// Where PC and robot are, as far as the user says.
#[derive(Clone, Copy)]
pub struct Link {
    pub protocol: ProtocolName,
    pub bind: Option<SocketAddr>,
    pub robot: Option<IpAddr>,
    pub robot_port: Option<u16>,
}

impl Link {
    /// Where the PC listens, for a robot that speaks first.
    pub fn bind(&self) -> Result<SocketAddr, Failure> {
        if self.robot_port.is_some() {
            return Err(Failure::new(
                "--robot-port: this robot speaks first, from a port of its own",
                "leave it out",
            ));
        }
        self.bind.ok_or_else(|| {
            Failure::new(
                "--bind IP:PORT is missing: this robot speaks first",
                "the address of this PC that its controller is set to send to, for example --bind 192.168.125.10:6510",
            )
        })
    }

    fn robot(&self, port: u16) -> Result<SocketAddr, Failure> {
        if self.bind.is_some() {
            return Err(Failure::new(
                "--bind: the PC calls this robot, from a port that the system chooses",
                "leave it out, and name the robot: --robot IP",
            ));
        }
        let Some(robot) = self.robot else {
            return Err(Failure::new(
                "--robot IP is missing: the PC calls this robot",
                "for example --robot 192.168.0.10",
            ));
        };
        Ok(SocketAddr::new(robot, self.robot_port.unwrap_or(port)))
    }

    /// Opens it.
    pub fn open(&self, clock: HostClock) -> Result<Box<dyn RobotSource>, Failure> {
        let heard = |bind: SocketAddr| move |error: std::io::Error| listen::bind_failure(bind, &error);
        match self.protocol {
            ProtocolName::Egm => Ok(Box::new(listen::bind(self.bind()?, self.robot, clock)?)),
            ProtocolName::FanucHspo => {
                let bind = self.bind()?;
                let source =
                    UdpSource::listen(bind, self.robot, Hspo::default(), clock).map_err(heard(bind))?;
                Ok(Box::new(source))
            }
            ProtocolName::KukaRsi => {
                let bind = self.bind()?;
                let source =
                    UdpSource::listen(bind, self.robot, Rsi::default(), clock).map_err(heard(bind))?;
                Ok(Box::new(source))
            }
            ProtocolName::UrRtde => {
                Ok(Box::new(RtdeSource::new(self.robot(trueline_live::ur::PORT)?, clock)))
            }
            ProtocolName::FanucStreamMotion => {
                let robot = self.robot(trueline_live::fanuc::STREAM_MOTION_PORT)?;
                let source = UdpSource::call(robot, StreamMotion::default(), clock).map_err(heard(robot))?;
                Ok(Box::new(source))
            }
        }
    }
}
