//! Datagrams of robots.

use trueline_live::egm::{RobotMessage, SensorMessage};
use trueline_live::fanuc::stream_motion_packets;
use trueline_live::kuka::rob_message;

pub(crate) fn egm(bytes: &[u8]) {
    if let Ok(message) = RobotMessage::decode(bytes) {
        drop(format!("{message:?}"));
    }
    if let Ok(message) = SensorMessage::decode(bytes) {
        drop(format!("{message:?}"));
    }
}

pub(crate) fn stream_motion(bytes: &[u8]) {
    if let Err(error) = stream_motion_packets::status(bytes) {
        assert!(!error.to_string().is_empty());
    }
}

pub(crate) fn rsi(bytes: &[u8]) {
    if let Ok(message) = rob_message::read(bytes) {
        assert!(message.pose.translation.vector.iter().all(|x| x.is_finite()), "a pose that is no pose");
    }
}
