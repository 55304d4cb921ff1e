//! A datagram with every field that RobotWare has.

use crate::common::pose;
use trueline_live::egm::messages::{EgmMciState, EgmMotorState, EgmRapidCtrlExecState};
use trueline_live::egm::{
    Axes, Collision, EgmClock, EgmFeedBack, EgmHeader, EgmPose, EgmRobot, EgmTimestamp, MciState, Message,
    MessageType, MotorState, RapidData, RapidState,
};

/// `measuredForce` in the form of RobotWare 6 or 7, by turns.
pub(crate) fn full_datagram(k: u32) -> Vec<u8> {
    let axes = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let state = EgmFeedBack {
        joints: Some(axes.into()),
        cartesian: Some(EgmPose::full(&pose(k))),
        external_joints: Some(axes.into()),
        time: Some(EgmClock { sec: Some(7), usec: Some(8) }),
        time_stamp: Some(EgmTimestamp { sec: Some(9), nsec: Some(10) }),
    };
    EgmRobot {
        header: Some(EgmHeader::new(k, 2, MessageType::Data)),
        feed_back: Some(state),
        planned: Some(state),
        motor_state: Some(EgmMotorState { state: Some(MotorState::On.into()) }),
        mci_state: Some(EgmMciState { state: Some(MciState::Running.into()) }),
        mci_convergence_met: Some(true),
        test_signals: Some(axes.into()),
        rapid_exec_state: Some(EgmRapidCtrlExecState { state: Some(RapidState::Running.into()) }),
        measured_force: Some(Axes::from(axes).with_flag(k.is_multiple_of(2).then_some(true))),
        utilization_rate: Some(3.0),
        move_index: Some(4),
        collision_info: Some(Collision::from(axes).with_flag(Some(false))),
        rapid_data: Some(RapidData::from([0.5; 40]).with_flag(Some(true))),
        torque_ref: Some(axes.into()),
    }
    .encode_to_vec()
}
