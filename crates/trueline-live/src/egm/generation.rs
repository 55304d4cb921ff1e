//! The RobotWare version that sent a message, detected by its fields.

use super::messages::EgmRobot;
use std::fmt;

/// A generation of RobotWare, as far as its messages show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Generation {
    /// Before 6.07: no time in the feedback, and units that are not consistent.
    Before6_07,
    /// 6.07 to 6.09.
    From6_07,
    /// 6.10 and later 6.
    From6_10,
    /// 7.
    From7,
    /// 7.16 and later: IEEE 1588 stamps or torques.
    From7_16,
}

impl Generation {
    /// The oldest generation that could have sent this.
    #[must_use]
    pub fn of(message: &EgmRobot) -> Self {
        let feedback = message.feed_back;
        let is_7 = message.measured_force.is_some_and(|force| force.flag.is_some())
            || message.move_index.is_some()
            || message.collision_info.is_some()
            || message.rapid_data.is_some();
        if feedback.is_some_and(|f| f.time_stamp.is_some()) || message.torque_ref.is_some() {
            Self::From7_16
        } else if is_7 {
            Self::From7
        } else if feedback.is_none_or(|f| f.time.is_none()) {
            Self::Before6_07
        } else if message.utilization_rate.is_some() {
            Self::From6_10
        } else {
            Self::From6_07
        }
    }
}

impl fmt::Display for Generation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Before6_07 => "RobotWare before 6.07",
            Self::From6_07 => "RobotWare 6.07 to 6.09",
            Self::From6_10 => "RobotWare 6.10 or later",
            Self::From7 => "RobotWare 7",
            Self::From7_16 => "RobotWare 7.16 or later",
        })
    }
}
