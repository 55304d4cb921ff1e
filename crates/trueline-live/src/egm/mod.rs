//! ABB's Externally Guided Motion on the wire: datagrams in, messages out, and back.

pub mod generation;
pub mod header;
pub mod pose;
pub(crate) mod robot_message;
pub(crate) mod sensor_message;
pub mod wire;

pub use generation::Generation;
pub use header::{Header, MessageKind};
pub use pose::{Axes, EgmPose, PoseError};
pub use robot_message::{
    Collision, MciState, MeasuredForce, MotorState, RapidData, RapidState, RobotMessage, RobotState,
};
pub use sensor_message::SensorMessage;
pub use wire::WireError;
