//! The gate before every command: for any messages received, its commands are inside the limits.

use nalgebra::{UnitQuaternion, UnitVector3, Vector3};
use std::sync::LazyLock;
use trueline_dataset::RobotSample;
use trueline_geometry::{Pose, so3};
use trueline_live::RobotFrame;
use trueline_live::egm::{Generation, MciState, MotorState, RapidState};
use trueline_live::motion::{
    CheckedPath, Gate, GateState, Input, MotionLimits, OperatorCommand, Phase, ReceivedFrame, Reference,
};

const PERIOD_NS: i64 = 4_032_000;
/// Bytes of an event.
const EVENT: usize = 16;
/// Time by which a reference may be ahead: 12 ms made up for, and a period of 20 ms at most.
const AHEAD_S: f64 = 0.032;
/// References over which the travel is measured.
const LOOK_BACK: usize = 60;

/// A small cell.
fn limits() -> MotionLimits {
    MotionLimits {
        box_m: [Vector3::new(0.7, -0.2, 0.4), Vector3::new(1.3, 0.2, 0.8)],
        tool_axis: UnitVector3::new_normalize(-Vector3::z()),
        cone_rad: 0.6,
        reach_m: 0.3,
        speed_m_s: 0.12,
        acceleration_m_s2: 0.6,
        jerk_m_s3: 8.0,
        turn_rad_s: 0.6,
        turn_acceleration_rad_s2: 3.0,
        deviation_m: 0.03,
        deviation_rad: 0.2,
        start_m: 0.01,
        start_rad: 0.05,
    }
}

/// Six seconds of an S in it; the gate, once for all sequences.
#[expect(clippy::expect_used, reason = "a fuzzing harness reports by panicking")]
static GATE: LazyLock<Gate> = LazyLock::new(|| {
    let down = so3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
    let sample = |k: i32| {
        let t = f64::from(k) * 0.01;
        let position = Vector3::new(0.85 + 0.05 * t, 0.02 * (2.5 * t).sin(), 0.6 + 0.01 * (1.3 * t).cos());
        let turn = Vector3::new(0.1 * (2.0 * t).sin(), 0.15 * (1.7 * t).sin(), 0.1 * (1.1 * t).cos());
        RobotSample {
            stamp_ns: (t * 1e9) as i64,
            device_ns: None,
            base_from_tool: Pose::from_parts(position.into(), down * so3::exp(&turn)),
        }
    };
    let samples: Vec<RobotSample> = (0..=600).map(sample).collect();
    let path = CheckedPath::new(&samples, 1.0, &limits()).expect("a path inside its limits");
    Gate::new(limits(), path, 0.2)
});

/// Output of the gate, and its times.
type Sent = Vec<(i64, Reference)>;

/// A controller driven by the bytes: 16 of them are an event. As many honest frames follow as its second byte states.
pub(crate) fn gate(bytes: &[u8]) {
    let gate = &*GATE;
    let mut state = GateState::default();
    let (mut sent, mut now_ns, mut k) = (Sent::new(), 0_i64, 0_i64);
    let mut robot = gate.path().at(0.0).base_from_tool;
    for event in bytes.chunks_exact(EVENT).take(400) {
        for repeat in 0..=event[1] % 64 {
            let (kind, after) = if repeat == 0 { (event[0], event[2]) } else { (0, 32) };
            // From nothing to a third of a second; a whole period is 32.
            now_ns += PERIOD_NS * i64::from(after) / 32 * if after > 200 { 12 } else { 1 };
            k += 1;
            let received = told(kind, event, k, robot).map(|mut frame| {
                frame.device_ns = if kind & 7 == 5 { word(event, 8) } else { frame.device_ns };
                ReceivedFrame { frame, arrival_ns: now_ns, is_first: k == 1 || kind & 7 == 6 }
            });
            let command = match (repeat, event[3]) {
                (0, 0) => OperatorCommand::Stop,
                (0, 1) => OperatorCommand::Silence,
                _ => OperatorCommand::Go,
            };
            let (next, reference) = gate.step(state, &Input { received, now_ns, command });
            state = next;
            if let Some(reference) = reference {
                robot = reference.base_from_tool;
                sent.push((now_ns, reference));
                is_allowed(&sent);
            }
            let rests = matches!(
                state.phase,
                Phase::Holding { .. } | Phase::Silent { .. } | Phase::Interrupted { .. }
            );
            let last = sent.last().map(|(_, reference)| reference);
            assert!(
                !rests || last.is_none_or(Reference::is_rest),
                "the last word was a movement: {:?}",
                state.phase
            );
        }
    }
}

/// Message of the controller; `None` for silence.
fn told(kind: u8, event: &[u8], k: i64, robot: Pose) -> Option<RobotFrame> {
    let mut frame = RobotFrame {
        sequence: k as u32,
        base_from_tool: robot,
        device_ns: 500_000_000_000 + k * PERIOD_NS,
        ptp_ns: None,
        motors: MotorState::On,
        mci: MciState::Running,
        rapid: RapidState::Running,
        utilization_percent: Some(20.0),
        converged: false,
        collided: false,
        generation: Generation::From7,
        attitudes_differ: false,
        digital: None,
    };
    let pose = &mut frame.base_from_tool;
    let steps = Vector3::from_fn(|i, _| f64::from(event[4 + i].cast_signed()));
    match kind & 7 {
        1 => return None,
        // Anywhere, or no number at all.
        2 => {
            pose.translation.vector =
                Vector3::from_fn(|i, _| f64::from_bits(word(event, 4 + 4 * i).cast_unsigned()));
        }
        // A drift of up to 2 mm and 1° a frame.
        3 => {
            pose.translation.vector += steps * 16e-6;
            pose.rotation *= UnitQuaternion::from_scaled_axis(steps * 1.4e-4);
        }
        4 => {
            frame.motors =
                [MotorState::Undefined, MotorState::On, MotorState::Off][usize::from(event[4] % 3)];
            frame.mci = [MciState::Undefined, MciState::Error, MciState::Stopped, MciState::Running]
                [usize::from(event[5] % 4)];
            frame.rapid =
                [RapidState::Undefined, RapidState::Stopped, RapidState::Running][usize::from(event[6] % 3)];
            frame.collided = event[7] > 200;
            frame.converged = event[7] & 1 == 1;
            frame.utilization_percent = Some(f64::from(event[8]));
        }
        // A leap that stays.
        7 => pose.translation.vector += steps * 1e-3,
        _ => {}
    }
    Some(frame)
}

/// Eight bytes from a place, or zeros beyond the end.
fn word(event: &[u8], at: usize) -> i64 {
    let mut bytes = [0; 8];
    for (byte, from) in bytes.iter_mut().zip(event.iter().skip(at)) {
        *byte = *from;
    }
    i64::from_le_bytes(bytes)
}

/// The newest reference: finite, in box and cone, under every speed, and no further from those before than there was time for.
fn is_allowed(sent: &Sent) {
    let Some(((now_ns, to), before)) = sent.split_last() else { return };
    let l = limits();
    let Reference { base_from_tool, velocity_m_s, angular_velocity_rad_s } = to;
    assert!(l.in_box(&base_from_tool.translation.vector, 0.0), "{base_from_tool}");
    assert!(l.cone_angle_rad(base_from_tool) <= l.cone_rad, "{base_from_tool}");
    assert!((base_from_tool.rotation.norm() - 1.0).abs() < 1e-9, "no rotation");
    assert!(velocity_m_s.norm() <= l.speed_m_s && angular_velocity_rad_s.norm() <= l.turn_rad_s);
    for (then_ns, from) in before.iter().rev().take(LOOK_BACK) {
        let may_s = (now_ns - then_ns) as f64 * 1e-9 + AHEAD_S;
        let from = from.base_from_tool;
        let step_m = (base_from_tool.translation.vector - from.translation.vector).norm();
        let turn_rad = from.rotation.angle_to(&base_from_tool.rotation);
        assert!(step_m <= l.speed_m_s * may_s + 1e-9, "{step_m} m in {may_s} s");
        assert!(turn_rad <= l.turn_rad_s * may_s + 1e-7, "{turn_rad} rad in {may_s} s");
        assert!(step_m + turn_rad * l.reach_m <= 0.250 * may_s + 1e-7, "the tip, in {may_s} s");
    }
}
