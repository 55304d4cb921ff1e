//! The simulated controller does what the manual, and people who measured, say that real ones do.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::Vector3;
use std::f64::consts::TAU;
use trueline_geometry::{Pose, Trajectory};
use trueline_live::RobotFrame;
use trueline_live::controller::{
    Controller, ControllerSettings, Event, GuidanceEnd, Network, NetworkSettings, Task, VirtualTime,
};
use trueline_live::egm::{
    Axes, EgmFeedBack, EgmHeader, EgmPose, EgmQuaternion, EgmRobot, EgmSensor, EgmSpeedRef, Generation,
    MciState, Message, MessageType, MotorState,
};

const START: [f64; 3] = [1.2, 0.1, 0.9];

fn start() -> Pose {
    Pose::new(Vector3::from(START), Vector3::new(3.0, 0.1, 0.2))
}

fn guided() -> ControllerSettings {
    ControllerSettings::new(Task::Guidance { start: start() })
}

fn perfect(settings: ControllerSettings) -> VirtualTime {
    VirtualTime {
        controller: Controller::new(settings),
        to_pc: Network::new(NetworkSettings::none(), 1),
        to_robot: Network::new(NetworkSettings::none(), 2),
    }
}

fn frame(datagram: &[u8]) -> RobotFrame {
    RobotFrame::of(&EgmRobot::read(datagram).unwrap()).unwrap()
}

fn planned(pose: EgmPose) -> EgmFeedBack {
    EgmFeedBack { cartesian: Some(pose), ..EgmFeedBack::default() }
}

fn answer(x_m: f64, speed_m_s: Option<f64>) -> Vec<u8> {
    let mut pose = start();
    pose.translation.vector.x += x_m;
    let cartesians = speed_m_s.map(|v| Axes::from([v * 1e3, 0.0, 0.0, 0.0, 0.0, 0.0]));
    EgmSensor {
        header: Some(EgmHeader::new(1, 0, MessageType::Correction)),
        planned: Some(planned(EgmPose::with_quaternion(&pose))),
        speed_ref: cartesians.map(|speed| EgmSpeedRef { cartesians: Some(speed), ..EgmSpeedRef::default() }),
    }
    .encode_to_vec()
}

/// Lag, s, and amplitude of the robot behind a sine of 20 mm.
fn tracking(gain_per_s: f64, frequency_hz: f64, with_speed: bool) -> (f64, f64) {
    let mut settings = guided();
    settings.following.gain_per_s = gain_per_s;
    settings.following.ramp_in_s = 0.0;
    settings.feedback.servo_lag_s = 0.0;
    settings.feedback.noise_m = 0.0;
    // Near the sine's turning points a slow robot is at its reference for long.
    settings.convergence.for_s = f64::INFINITY;
    let (mut sine, mut cosine, mut count) = (0.0, 0.0, 0.0);
    let omega = TAU * frequency_hz;
    // Whole periods after the transient.
    let (from_s, until_s) = (20.0, 20.0 + (5.0 * frequency_hz).ceil() / frequency_hz);
    perfect(settings).run(until_s, |at_ns, datagram| {
        let time_s = at_ns as f64 * 1e-9;
        if time_s >= from_s {
            let x_m = frame(datagram).base_from_tool.translation.vector.x - START[0];
            sine += x_m * (omega * time_s).sin();
            cosine += x_m * (omega * time_s).cos();
            count += 1.0;
        }
        let speed = with_speed.then(|| 0.02 * omega * (omega * time_s).cos());
        Some(answer(0.02 * (omega * time_s).sin(), speed))
    });
    let (sine, cosine) = (2.0 * sine / count, 2.0 * cosine / count);
    ((-cosine).atan2(sine) / omega, sine.hypot(cosine) / 0.02)
}

/// Against the transfer function of the loop `v = LP·(k(r − p) + r')`, p = v/s, behind the dead time, with the delay of
/// sampling: an answer is read in the cycle after its computation.
#[test]
fn follows_as_its_transfer_function_says() {
    for (gain, frequency, with_speed) in [
        (5.0, 0.1, false),
        (5.0, 0.5, false),
        (5.0, 1.0, false),
        (20.0, 0.5, false),
        (5.0, 0.5, true),
        (5.0, 1.0, true),
    ] {
        let s = nalgebra::Complex::new(0.0, TAU * frequency);
        let late = (-s * (0.015 + 0.004_032)).exp();
        let low_pass = (s / (TAU * 20.0) + 1.0).inv();
        let reference = if with_speed { s + gain } else { nalgebra::Complex::new(gain, 0.0) };
        let closed = late * low_pass * reference / (s + low_pass * gain);
        let (lag_s, share) = tracking(gain, frequency, with_speed);
        let expected_s = -closed.arg() / (TAU * frequency);
        // A cycle's rounding of the dead time (2 ms) and half a cycle of the integration.
        assert!(
            (lag_s - expected_s).abs() < 0.004,
            "k = {gain}, {frequency} Hz: {lag_s} s, expected {expected_s} s"
        );
        assert!(
            (share - closed.norm()).abs() < 0.02,
            "k = {gain}, {frequency} Hz: {share}, expected {}",
            closed.norm()
        );
    }
}

/// The published figure that surprises: at the default gain the robot is 0.2 s behind.
#[test]
fn is_a_fifth_of_a_second_late_at_the_default_gain() {
    let (lag_s, _) = tracking(5.0, 0.1, false);
    assert!((lag_s - 0.214).abs() < 0.01, "{lag_s} s");
    let (lag_s, _) = tracking(5.0, 0.1, true);
    assert!((0.01..0.03).contains(&lag_s), "{lag_s} s");
}

#[test]
fn two_answers_a_cycle_make_commands_old() {
    // The wanted place moves at 50 mm/s; the queue is read once a cycle.
    let lag_after = |answers: usize| {
        let mut settings = guided();
        settings.following.gain_per_s = 20.0;
        let mut cell = perfect(settings);
        let mut lag_m = 0.0;
        let mut robot = Vec::new();
        for _ in 0..1200 {
            let now_s = cell.controller.next_cycle_ns() as f64 * 1e-9;
            if let Some(datagram) = cell.controller.run_cycle() {
                robot.push(frame(&datagram).base_from_tool.translation.vector.x - START[0]);
                lag_m = 0.05 * now_s - robot.last().unwrap();
            }
            for _ in 0..answers {
                cell.controller.receive(&answer(0.05 * now_s, None), "127.0.0.1".parse().unwrap());
            }
        }
        lag_m / 0.05
    };
    let (once_s, twice_s) = (lag_after(1), lag_after(2));
    assert!(once_s < 0.1, "{once_s} s");
    // Half of the messages of 4.8 s are still in the queue.
    assert!(twice_s > 2.0, "{twice_s} s");
}

#[test]
fn ends_without_answers_and_says_so() {
    let mut cell = perfect(guided());
    let mut states = Vec::new();
    cell.run(1.0, |at_ns, datagram| {
        states.push((at_ns as f64 * 1e-9, frame(datagram).mci));
        None
    });
    assert_eq!(cell.controller.ended(), Some(GuidanceEnd::Timeout));
    let error_s = states.iter().find(|(_, mci)| *mci == MciState::Error).unwrap().0;
    // 0.2 s until it runs, 0.2 s of patience.
    assert!((error_s - 0.4).abs() < 0.01, "{error_s} s");
}

#[test]
fn ends_when_it_rests_at_its_reference() {
    let mut cell = perfect(guided());
    let mut last_s = 0.0;
    cell.run(5.0, |at_ns, _| {
        last_s = at_ns as f64 * 1e-9;
        Some(answer(0.0, None))
    });
    assert_eq!(cell.controller.ended(), Some(GuidanceEnd::Converged));
    // Runs from 0.2 s on; the condition time is 1 s; then the stream ends.
    assert!((last_s - 1.2).abs() < 0.02, "{last_s} s");
}

#[test]
fn refuses_what_a_controller_refuses() {
    let bad = [f64::NAN, f64::INFINITY].map(|x| answer(x, None));
    let with_attitude = |orient| {
        let good = EgmSensor::decode(answer(0.0, None).as_slice()).unwrap();
        let pose = EgmPose { orient, ..good.planned.unwrap().cartesian.unwrap() };
        EgmSensor { planned: Some(planned(pose)), ..good }.encode_to_vec()
    };
    let [u0, u1, u2, u3] = [Some(0.0); 4];
    let zero = with_attitude(Some(EgmQuaternion { u0, u1, u2, u3 }));
    let not_whole = with_attitude(Some(EgmQuaternion { u0: Some(1.0), ..EgmQuaternion::default() }));
    let none = with_attitude(None);
    for bytes in bad.into_iter().chain([zero, not_whole, none, vec![0xff; 9], Vec::new()]) {
        let mut cell = perfect(guided());
        let mut farthest_m = 0.0_f64;
        cell.run(1.0, |_, datagram| {
            let away = frame(datagram).base_from_tool.translation.vector - Vector3::from(START);
            farthest_m = farthest_m.max(away.norm());
            Some(bytes.clone())
        });
        let (taken, refused) = cell.controller.answers();
        assert_eq!(taken, 0);
        assert!(refused.values().sum::<u64>() > 40, "{refused:?}");
        // Five sigmas of the reported noise on three axes.
        assert!(farthest_m < 1e-4 && cell.controller.ended() == Some(GuidanceEnd::Timeout));
    }
}

#[test]
fn events_show_in_the_states() {
    let mut settings = guided();
    settings.convergence.for_s = 100.0;
    settings.events = vec![
        (0.5, Event::EmergencyStop),
        (0.8, Event::MotorsOn),
        (1.2, Event::RapidStop),
        (1.4, Event::RapidStart),
        (1.8, Event::Restart),
    ];
    let mut cell = perfect(settings);
    let mut seen = Vec::new();
    let mut sequences = Vec::new();
    cell.run(2.4, |at_ns, datagram| {
        let frame = frame(datagram);
        sequences.push(frame.sequence);
        seen.push((at_ns as f64 * 1e-9, frame.motors, frame.mci));
        Some(answer(0.0, None))
    });
    let at = |time_s: f64| {
        seen.iter().find(|(t, ..)| *t >= time_s).map(|(_, motors, mci)| (*motors, *mci)).unwrap()
    };
    assert_eq!(at(0.1), (MotorState::On, MciState::Stopped));
    assert_eq!(at(0.4), (MotorState::On, MciState::Running));
    assert_eq!(at(0.6), (MotorState::Off, MciState::Stopped));
    assert_eq!(at(0.9), (MotorState::On, MciState::Running));
    assert_eq!(at(1.3), (MotorState::On, MciState::Stopped));
    assert_eq!(at(1.5), (MotorState::On, MciState::Running));
    let restart = sequences.windows(2).position(|pair| pair[1] < pair[0]).unwrap();
    assert_eq!((sequences[restart + 1], cell.controller.sessions()), (0, 2));
}

#[test]
fn a_stream_follows_its_own_path_and_no_answers() {
    let times: Vec<f64> = (0..500).map(|k| f64::from(k) * 0.01).collect();
    let poses: Vec<Pose> =
        times.iter().map(|t| Pose::translation(1.0 + 0.05 * t, 0.02 * (2.0 * t).sin(), 0.5)).collect();
    let path = Trajectory::new(times, &poses).unwrap();
    let mut settings = ControllerSettings::new(Task::Stream { path: path.clone(), rest_s: 0.5 });
    settings.feedback.noise_m = 0.0;
    let mut worst_m = 0.0_f64;
    perfect(settings).run(5.0, |at_ns, datagram| {
        let frame = frame(datagram);
        assert_eq!(frame.mci, MciState::Stopped);
        // The robot is 8 ms behind the program.
        let path_s = at_ns as f64 * 1e-9 - 0.5 - 0.008;
        if path_s < 0.02 {
            return Some(answer(0.5, None));
        }
        let expected = path.pose_at(path_s).unwrap().translation.vector;
        worst_m = worst_m.max((frame.base_from_tool.translation.vector - expected).norm());
        Some(answer(0.5, None))
    });
    // Between cycles set points are linear, and the path's speed steps by 0.8 mm/s at its own knots: a kink costs
    // step · period / 4.
    assert!(worst_m < 1e-6, "{worst_m} m");
}

#[test]
fn a_stream_stands_still_while_the_motors_are_off() {
    let times: Vec<f64> = (0..500).map(|k| f64::from(k) * 0.01).collect();
    let poses: Vec<Pose> = times.iter().map(|t| Pose::translation(1.0 + 0.05 * t, 0.0, 0.5)).collect();
    let path = Trajectory::new(times, &poses).unwrap();
    let mut settings = ControllerSettings::new(Task::Stream { path, rest_s: 0.0 });
    settings.feedback.noise_m = 0.0;
    settings.events = vec![(1.0, Event::EmergencyStop), (2.0, Event::MotorsOn)];
    let mut at = Vec::new();
    perfect(settings).run(3.0, |at_ns, datagram| {
        at.push((at_ns as f64 * 1e-9, frame(datagram).base_from_tool.translation.vector.x));
        None
    });
    let x = |time_s: f64| at.iter().find(|(t, _)| *t >= time_s).unwrap().1;
    assert!((x(1.1) - x(1.9)).abs() < 1e-9, "it stands");
    // A second late from then on: to a cycle at 50 mm/s.
    assert!((x(2.9) - x(0.0) - 0.05 * 1.9).abs() < 0.001, "{}", x(2.9));
}

#[test]
fn generations_and_clocks_are_those_asked_for() {
    for generation in [Generation::From6_07, Generation::From6_10, Generation::From7, Generation::From7_16] {
        let mut settings = guided();
        settings.generation = generation;
        settings.clock.drift_ppm = 100.0;
        settings.clock.step_s = Some((0.15, -3.0));
        let mut stamps = Vec::new();
        perfect(settings).run(0.2, |at_ns, datagram| {
            let frame = frame(datagram);
            assert_eq!(frame.generation, generation);
            stamps.push((at_ns, frame.device_ns));
            None
        });
        let told_ns = |k: usize| stamps[k].1 - 86_400_000_000_000 - stamps[k].0;
        assert_eq!(told_ns(0), 0);
        // 100 ppm of 0.1 s, to the microsecond of the message.
        assert!((told_ns(25) - 10_000).abs() <= 1000, "{}", told_ns(25));
        assert!((told_ns(45) + 3_000_000_000 - 18_000).abs() <= 1500, "{}", told_ns(45));
    }
}

#[test]
fn networks_lose_repeat_and_overtake_as_asked_and_alike_for_a_seed() {
    let settings =
        NetworkSettings { loss: 0.05, duplicate: 0.03, reorder: 0.04, ..NetworkSettings::typical() };
    let run = |seed: u64| {
        let mut network = Network::new(settings, seed);
        let mut got = Vec::new();
        for k in 0..20_000_u32 {
            let now_ns = i64::from(k) * 4_032_000;
            network.send(now_ns, k);
            while let Some((due_ns, k)) = network.take_due(now_ns) {
                assert!(due_ns - i64::from(k) * 4_032_000 >= 200_000);
                got.push(k);
            }
        }
        got
    };
    let got = run(7);
    assert_eq!(got, run(7));
    assert_ne!(got, run(8));
    let mut distinct = got.clone();
    distinct.sort_unstable();
    distinct.dedup();
    // Binomial: five sigmas of 20 000 · p · (1 − p).
    let near = |found: usize, p: f64| {
        assert!(
            (found as f64 - 20_000.0 * p).abs() < 5.0 * (20_000.0 * p * (1.0 - p)).sqrt() + 3.0,
            "{found} of {p}"
        );
    };
    near(20_000 - distinct.len(), 0.05);
    near(got.len() - distinct.len(), 0.95 * 0.03);
    let overtaken = got.windows(2).filter(|pair| pair[1] < pair[0]).count();
    assert!(overtaken > 400, "{overtaken}");
}

#[test]
fn joint_references_are_refused_by_name_and_a_pc_that_is_late_is_waited_for() {
    let mut settings = ControllerSettings::new(Task::Guidance { start: Pose::identity() });
    settings.waits_for_pc = true;
    let mut robot = Controller::new(settings);
    let from = "127.0.0.1".parse().unwrap();
    for _ in 0..1000 {
        robot.run_cycle();
    }
    assert_eq!(robot.ended(), None, "four seconds without a PC, twenty times the timeout");
    let joints = EgmSensor {
        header: Some(EgmHeader::new(1, 1, MessageType::Correction)),
        planned: Some(EgmFeedBack { joints: Some([1.0; 6].into()), ..EgmFeedBack::default() }),
        speed_ref: None,
    };
    robot.receive(&joints.encode_to_vec(), from);
    robot.run_cycle();
    let (taken, refused) = robot.answers();
    assert_eq!(taken, 0);
    assert!(
        refused.keys().any(|reason| reason.starts_with("joint references: not simulated")),
        "{refused:?}"
    );
}
