//! ABB's Externally Guided Motion on the wire: datagrams in, messages out, and back.
//!
//! A test of `trueline-mcap` makes [`messages`]; its recordings describe the same messages to viewers.

pub mod datagram;
pub mod generation;
/// Made of `proto/abb/egm.proto`, and not to be edited.
#[rustfmt::skip]
pub mod messages;
pub mod numbers;
pub mod pose;

pub use datagram::WireError;
pub use generation::Generation;
pub use messages::egm_header::MessageType;
pub use messages::egm_mci_state::MciStateType as MciState;
pub use messages::egm_motor_state::MotorStateType as MotorState;
pub use messages::egm_rapid_ctrl_exec_state::RapidCtrlExecStateType as RapidState;
pub use messages::{
    EgmCartesian, EgmClock, EgmEuler, EgmFeedBack, EgmHeader, EgmPose, EgmQuaternion, EgmRobot, EgmSensor,
    EgmSpeedRef, EgmTimestamp,
};
pub use numbers::{Axes, Collision, RapidData};
pub use pose::PoseError;
/// Messages into bytes and back.
pub use prost::Message;
