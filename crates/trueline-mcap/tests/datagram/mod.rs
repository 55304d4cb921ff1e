//! A datagram with every field that RobotWare has.

use crate::common::pose;
use trueline_live::egm::{
    Axes, Collision, EgmPose, Header, MciState, MeasuredForce, MessageKind, MotorState, RapidData,
    RapidState, RobotMessage, RobotState,
};

/// `measuredForce` in the form of RobotWare 6 or 7, by turns.
pub(crate) fn full_datagram(k: u32) -> Vec<u8> {
    let axes = Axes::from([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let state = RobotState {
        joints_deg: Some(axes),
        cartesian: Some(EgmPose::full(&pose(k))),
        external_joints: Some(axes),
        time_s_us: Some((7, 8)),
        ptp_s_ns: Some((9, 10)),
    };
    RobotMessage {
        header: Some(Header { sequence: Some(k), sent_ms: Some(2), kind: Some(MessageKind::Data) }),
        feedback: Some(state),
        planned: Some(state),
        motors: Some(MotorState::On),
        mci: Some(MciState::Running),
        converged: Some(true),
        rapid: Some(RapidState::Running),
        force: Some(MeasuredForce { active: k.is_multiple_of(2).then_some(true), force: axes }),
        utilization_percent: Some(3.0),
        move_index: Some(4),
        collision: Some(Collision { triggered: Some(false), quota: axes }),
        rapid_data: Some(RapidData { digital: Some(true), numbers: [0.5; 40].into() }),
        torque_reference: Some(axes),
        unread: 0,
    }
    .encode()
}
