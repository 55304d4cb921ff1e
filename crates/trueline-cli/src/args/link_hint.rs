//! Advice if a robot's stream cannot be opened.

use std::io::ErrorKind;
use trueline_live::LinkError;

/// The error with the option that it is about, and what to do.
#[must_use]
pub(crate) fn link_hint(error: &LinkError) -> (String, &'static str) {
    match error {
        LinkError::RobotPortNotNeeded => (
            "--robot has a port, and this robot speaks first, from a port of its own".to_owned(),
            "name its IP alone",
        ),
        LinkError::BindMissing => (
            "--bind IP:PORT is missing: this robot speaks first".to_owned(),
            "the address of this PC that its controller is set to send to, for example --bind 192.168.125.10:6510",
        ),
        LinkError::BindNotNeeded => (
            "--bind: the PC calls this robot, from a port that the system chooses".to_owned(),
            "leave it out, and name the robot: --robot IP",
        ),
        LinkError::RobotMissing => {
            ("--robot IP is missing: the PC calls this robot".to_owned(), "for example --robot 192.168.0.10")
        }
        LinkError::AnyPort { .. } => {
            (error.to_string(), "name the port that its UDPUC device has, for example 6510")
        }
        LinkError::InputsNotNeeded => (
            format!("--inputs: {error}"),
            "leave it out; the book's page Live lists the settings of the controller",
        ),
        LinkError::Inputs(_) => {
            (format!("--inputs {error}"), "the book's page Live lists the available inputs")
        }
        LinkError::AnswerNotNeeded => {
            (format!("--answer-rsi: {error}"), "leave it out; it is for kuka-rsi without ONLYSEND")
        }
        LinkError::AnswerWithoutRobot => {
            (format!("--answer-rsi: {error}"), "--robot IP, the address of the controller's RSI interface")
        }
        LinkError::Answer(_) => (
            format!("--answer-rsi: {error}"),
            "the Ethernet configuration that the controller uses, as it is; with ONLYSEND it needs no answers",
        ),
        LinkError::Config { .. } => {
            (error.to_string(), "the XML file that the ETHERNET object of the RSI context names")
        }
        LinkError::Io { error: why, .. } => (error.to_string(), cannot_listen(why.kind())),
    }
}

fn cannot_listen(kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::AddrInUse => "another program listens there; end it, or use another port",
        ErrorKind::AddrNotAvailable => "it is not an address of this PC: `ip address` lists them",
        _ => "ports below 1024 need more rights",
    }
}
