//! A datagram of the robot that can be relied on.

use crate::egm::{EgmRobot, Generation, MciState, MessageType, MotorState, PoseError, RapidState};
use trueline_geometry::Pose;

/// Content of one message of the controller, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotFrame {
    /// `seqno`.
    pub sequence: u32,
    /// Measured `base_from_tool`, m.
    pub base_from_tool: Pose,
    /// The controller's clock when the robot was there, ns, of no known epoch.
    pub device_ns: i64,
    /// IEEE 1588 time when the robot was there, ns, where the controller is synchronised.
    pub ptp_ns: Option<i64>,
    /// Whether the motors are on.
    pub motors: MotorState,
    /// State of the motion correction interface.
    pub mci: MciState,
    /// Whether RAPID runs.
    pub rapid: RapidState,
    /// Used share of the robot's limits, %, if reported.
    pub utilization_percent: Option<f64>,
    /// The robot is near its reference, by the controller's own measure.
    pub converged: bool,
    /// A collision was detected.
    pub collided: bool,
    /// Sender of it.
    pub generation: Generation,
    /// Quaternion and Euler angles differ by more than their digits.
    pub attitudes_differ: bool,
    /// The signal that the program sends with the poses (`\DOToSensor`), if any. RobotWare 7.7 and later.
    pub digital: Option<bool>,
}

/// Why a message of the robot cannot be relied on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// Not `MSGTYPE_DATA`.
    #[error("it is not a message of a robot (mtype is not DATA)")]
    NotData,
    /// No sequence number.
    #[error("it has no sequence number")]
    NoSequence,
    /// No cartesian feedback.
    #[error("it has no cartesian feedback")]
    NoFeedback,
    /// RobotWare before 6.07.
    #[error("its feedback has no time: RobotWare before 6.07 has inconsistent units")]
    OldRobotWare,
    /// The pose is not one.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// A time of which a part is missing, or that does not fit.
    #[error("its time is not whole, or out of range")]
    Time,
}

impl RobotFrame {
    /// Checks a message.
    ///
    /// # Errors
    /// A missing or invalid field.
    pub fn of(message: &EgmRobot) -> Result<Self, FrameError> {
        let header = message.header.ok_or(FrameError::NotData)?;
        if header.mtype() != MessageType::Data {
            return Err(FrameError::NotData);
        }
        let feedback = message.feed_back.ok_or(FrameError::NoFeedback)?;
        let pose = feedback.cartesian.ok_or(FrameError::NoFeedback)?;
        let time = feedback.time.ok_or(FrameError::OldRobotWare)?;
        Ok(Self {
            sequence: header.seqno.ok_or(FrameError::NoSequence)?,
            base_from_tool: pose.pose()?,
            device_ns: nanoseconds(time.sec, time.usec, 1_000).ok_or(FrameError::Time)?,
            ptp_ns: feedback.time_stamp.and_then(|stamp| nanoseconds(stamp.sec, stamp.nsec, 1)),
            motors: message.motor_state.unwrap_or_default().state(),
            mci: message.mci_state.unwrap_or_default().state(),
            rapid: message.rapid_exec_state.unwrap_or_default().state(),
            utilization_percent: message.utilization_rate.filter(|u| !u.is_nan()),
            converged: message.mci_convergence_met == Some(true),
            collided: message.collision_info.is_some_and(|collision| collision.flag == Some(true)),
            generation: Generation::of(message),
            attitudes_differ: pose.contradicts_itself(),
            digital: message.rapid_data.and_then(|data| data.flag),
        })
    }

    /// Whether the controller moves the robot by references of the PC. An unreported RAPID state counts as running:
    /// controllers may leave it out after a restart.
    #[must_use]
    pub(crate) fn is_guided(&self) -> bool {
        self.motors == MotorState::On && self.mci == MciState::Running && self.rapid != RapidState::Stopped
    }
}

fn nanoseconds(whole_s: Option<u64>, part: Option<u64>, part_ns: i64) -> Option<i64> {
    let whole_ns = i64::try_from(whole_s?).ok()?.checked_mul(1_000_000_000)?;
    whole_ns.checked_add(i64::try_from(part?).ok()?.checked_mul(part_ns)?)
}
