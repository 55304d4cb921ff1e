//! What the user can do where a robot's stream cannot be opened.

use crate::failure::Failure;
use std::io::ErrorKind;
use trueline_live::LinkError;

impl From<LinkError> for Failure {
    fn from(error: LinkError) -> Self {
        let (message, hint) = match &error {
            LinkError::RobotPortNotNeeded => {
                ("--robot-port: this robot speaks first, from a port of its own".to_owned(), "leave it out")
            }
            LinkError::BindMissing => (
                "--bind IP:PORT is missing: this robot speaks first".to_owned(),
                "the address of this PC that its controller is set to send to, for example --bind 192.168.125.10:6510",
            ),
            LinkError::BindNotNeeded => (
                "--bind: the PC calls this robot, from a port that the system chooses".to_owned(),
                "leave it out, and name the robot: --robot IP",
            ),
            LinkError::RobotMissing => (
                "--robot IP is missing: the PC calls this robot".to_owned(),
                "for example --robot 192.168.0.10",
            ),
            LinkError::AnyPort { .. } => {
                (error.to_string(), "name the port that its UDPUC device has, for example 6510")
            }
            LinkError::Io { error: why, .. } => (error.to_string(), cannot_listen(why.kind())),
        };
        Self::new(message, hint)
    }
}

fn cannot_listen(kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::AddrInUse => "another program listens there; end it, or use another port",
        ErrorKind::AddrNotAvailable => "it is no address of this PC: `ip address` lists them",
        _ => "ports below 1024 need more rights",
    }
}
