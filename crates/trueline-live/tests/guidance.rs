//! The gate leads the simulated controller, over good networks and bad ones.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use common::limits;
use nalgebra::Vector3;
use std::net::SocketAddr;
use std::thread;
use std::time::Duration;
use trueline_dataset::RobotSample;
use trueline_geometry::{Pose, so3};
use trueline_live::controller::settings::Convergence;
use trueline_live::controller::{
    Controller, ControllerSettings, Event, GuidanceEnd, Network, NetworkSettings, RealTime, Task, VirtualTime,
};
use trueline_live::egm::{EgmCartesian, EgmSensor, Message};
use trueline_live::guide::{self, Answer, Observer, Patience};
use trueline_live::motion::{
    CheckedPath, EndReason, Gate, GateState, Input, OperatorCommand, Phase, ReceivedFrame,
};
use trueline_live::{Endpoint, FrameFilter, Guide, HostClock, Received, SequenceStatus};

fn s_path(duration_s: f64) -> Vec<RobotSample> {
    let down = so3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
    (0..=(duration_s * 100.0) as i64)
        .map(|k| {
            let t = k as f64 * 0.01;
            let position = Vector3::new(0.85 + 0.05 * t, 0.02 * (2.5 * t).sin(), 0.6);
            let turn = Vector3::new(0.0, 0.15 * (1.7 * t).sin(), 0.1 * (1.1 * t).sin());
            RobotSample {
                stamp_ns: k * 10_000_000,
                device_ns: None,
                base_from_tool: Pose::from_parts(position.into(), down * so3::exp(&turn)),
            }
        })
        .collect()
}

fn gate(duration_s: f64, timeout_s: f64) -> Gate {
    Gate::new(limits(), CheckedPath::new(&s_path(duration_s), 1.0, &limits()).unwrap(), timeout_s)
}

struct Pc {
    frame_filter: FrameFilter,
    gate: Gate,
    state: GateState,
    sequence: u32,
    worst_m: f64,
    highest_m_s: f64,
}

impl Pc {
    fn new() -> Self {
        Self {
            frame_filter: FrameFilter::new(None),
            gate: gate(5.0, 0.2),
            state: GateState::default(),
            sequence: 0,
            worst_m: 0.0,
            highest_m_s: 0.0,
        }
    }

    fn receive(&mut self, at_ns: i64, datagram: &[u8], from: SocketAddr) -> Option<Vec<u8>> {
        let (frame, status) = self.frame_filter.judge(datagram, from, at_ns).ok()?;
        if status == SequenceStatus::Late {
            return None;
        }
        let is_first = status == SequenceStatus::First;
        let received = Some(ReceivedFrame { frame, arrival_ns: at_ns, is_first });
        let input = Input { received, now_ns: at_ns, command: OperatorCommand::Go };
        let (state, reference) = self.gate.step(self.state, &input);
        self.state = state;
        let reference = reference?;
        if matches!(state.phase, Phase::Travelling { .. }) {
            let off = reference.base_from_tool.translation.vector - frame.base_from_tool.translation.vector;
            self.worst_m = self.worst_m.max(off.norm());
            self.highest_m_s = self.highest_m_s.max(reference.velocity_m_s.norm());
        }
        self.sequence += 1;
        Some(guide::message(self.sequence, at_ns, &reference).encode_to_vec())
    }

    fn end_reason(&self) -> Option<EndReason> {
        match self.state.phase {
            Phase::Holding { why, .. } | Phase::Silent { why } => Some(why),
            _ => None,
        }
    }
}

fn robot() -> SocketAddr {
    "192.0.2.1:40000".parse().unwrap()
}

/// The output of `trueline robot-program abb`. With the default of 1 mm a slow start counts as rest, and the guidance ends.
fn tight() -> Convergence {
    Convergence { distance_m: 5e-5, angle_rad: 0.05_f64.to_radians(), for_s: 3.0 }
}

fn cell(network: NetworkSettings, change: impl FnOnce(&mut ControllerSettings)) -> VirtualTime {
    let mut settings = ControllerSettings::new(Task::Guidance { start: s_path(5.0)[0].base_from_tool });
    settings.convergence = tight();
    change(&mut settings);
    VirtualTime {
        controller: Controller::new(settings),
        to_pc: Network::new(network, 11),
        to_robot: Network::new(network, 12),
    }
}

#[test]
fn the_robot_travels_the_path_and_the_guidance_ends_in_peace() {
    for gain in [5.0, 20.0] {
        let mut pc = Pc::new();
        let mut cell = cell(NetworkSettings::typical(), |s| s.following.gain_per_s = gain);
        cell.run(14.0, |at_ns, datagram| pc.receive(at_ns, datagram, robot()));
        assert_eq!(pc.end_reason(), Some(EndReason::Travelled));
        assert_eq!(cell.controller.ended(), Some(GuidanceEnd::Converged), "by the condition time at rest");
        // With the speed sent along, the lag is dead time, servo and network: 25 to 35 ms of 80 mm/s. At the start
        // the gain must ramp in: 0.5 s with half the speed, at most 2 mm behind by then.
        assert!(pc.worst_m < 0.008, "{} mm", pc.worst_m * 1e3);
        assert!(pc.highest_m_s > 0.06 && pc.highest_m_s < 0.12);
        let (taken, refused) = cell.controller.answers();
        assert!(taken > 1000 && refused.is_empty(), "{refused:?}");
    }
}

#[test]
fn bad_networks_junk_and_rogues_do_not_stop_or_mislead_it() {
    let bad = NetworkSettings { loss: 0.01, duplicate: 0.01, reorder: 0.01, ..NetworkSettings::typical() };
    let mut last: Option<Vec<u8>> = None;
    let mut pc = Pc::new();
    pc.frame_filter = FrameFilter::new(Some(robot().ip()));
    let mut cell = cell(bad, |s| s.following.gain_per_s = 10.0);
    cell.run(16.0, |at_ns, datagram| {
        let stranger = "192.0.2.66:40000".parse().unwrap();
        assert_eq!(pc.receive(at_ns, datagram, stranger), None);
        assert_eq!(pc.receive(at_ns, &[0xff; 40], robot()), None);
        if let Some(old) = &last {
            assert_eq!(pc.receive(at_ns, old, robot()), None, "a replay");
        }
        last = Some(datagram.to_vec());
        pc.receive(at_ns, datagram, robot())
    });
    assert_eq!(pc.end_reason(), Some(EndReason::Travelled));
    assert!(pc.worst_m < 0.01, "{}", pc.worst_m);
    let (_, refused) = cell.controller.answers();
    assert!(refused.is_empty(), "{refused:?}");
}

#[test]
fn an_emergency_stop_ends_the_scan_and_motors_on_do_not_begin_it_again() {
    for event in [Event::EmergencyStop, Event::RapidStop, Event::Collision] {
        let mut pc = Pc::new();
        let mut cell = cell(NetworkSettings::typical(), |s| {
            s.convergence.for_s = 100.0;
            s.events = vec![(2.0, event), (3.0, Event::MotorsOn)];
        });
        let mut positions = Vec::new();
        cell.run(6.0, |at_ns, datagram| {
            let answer = pc.receive(at_ns, datagram, robot());
            if let (Some(answer), true) = (&answer, at_ns > 3_200_000_000) {
                let planned = EgmSensor::decode(answer.as_slice()).unwrap().planned.unwrap();
                let EgmCartesian { x, y, z } = planned.cartesian.unwrap().pos.unwrap();
                positions.push(Vector3::from([x, y, z].map(Option::unwrap)));
            }
            answer
        });
        let expected = if event == Event::Collision { EndReason::Collision } else { EndReason::LeftGuidance };
        assert_eq!(pc.end_reason(), Some(expected));
        let moved = positions.iter().map(|p| (p - positions[0]).norm()).fold(0.0, f64::max);
        // Held where it was, to the noise of the feedback that is echoed.
        assert!(moved < 0.1, "{event:?}: {moved} mm");
    }
}

#[test]
fn a_restart_of_the_controller_ends_the_scan() {
    let mut pc = Pc::new();
    let mut cell = cell(NetworkSettings::typical(), |s| s.events = vec![(2.0, Event::Restart)]);
    cell.run(5.0, |at_ns, datagram| pc.receive(at_ns, datagram, robot()));
    assert!(pc.end_reason().is_some(), "{:?}", pc.state.phase);
}

#[test]
fn a_silent_pc_is_noticed_by_the_controller() {
    let mut pc = Pc::new();
    let mut cell = cell(NetworkSettings::typical(), |_| ());
    cell.run(4.0, |at_ns, datagram| {
        let answer = pc.receive(at_ns, datagram, robot());
        answer.filter(|_| at_ns < 2_000_000_000)
    });
    assert_eq!(cell.controller.ended(), Some(GuidanceEnd::Timeout));
    assert_eq!(pc.end_reason(), Some(EndReason::LeftGuidance));
}

#[derive(Default)]
struct Watching {
    received: usize,
    answers: Vec<Answer>,
    panics: bool,
}

impl Observer for Watching {
    fn received(&mut self, _: &Received<'_>) {
        self.received += 1;
        assert!(!self.panics || self.received != 200, "whoever looks on may fail");
    }

    fn answered(&mut self, answer: &Answer) {
        self.answers.push(answer.clone());
    }

    fn stepped(&mut self, _: &GateState) {}
}

/// Guides a simulated robot over sockets; `command` is asked with the answers so far.
fn lead(
    mut watching: Watching,
    command: impl Fn(u64) -> OperatorCommand,
) -> (guide::Outcome, Watching, Option<GuidanceEnd>) {
    let endpoint = Endpoint::bind("127.0.0.1:0".parse().unwrap(), None, HostClock::start()).unwrap();
    let pc = endpoint.local_address().unwrap();
    let robot = thread::spawn(move || {
        let mut settings = ControllerSettings::new(Task::Guidance { start: s_path(1.5)[0].base_from_tool });
        settings.timeout_s = 1.0;
        settings.convergence = tight();
        let mut robot = RealTime::bind(
            Controller::new(settings),
            Network::new(NetworkSettings::none(), 1),
            Network::new(NetworkSettings::none(), 2),
            "127.0.0.1:0".parse().unwrap(),
            pc,
        )
        .unwrap();
        let mut end = None;
        robot
            .run(|cycle| {
                end = cycle.controller.ended();
                if end.is_some() || cycle.passed > Duration::from_secs(10) {
                    std::ops::ControlFlow::Break(())
                } else {
                    std::ops::ControlFlow::Continue(())
                }
            })
            .unwrap();
        end
    });
    // Patience for a machine that is busy otherwise: the scan may be interrupted, but not ended by it.
    let patience = Patience { armed: Duration::from_secs(20), hold: Duration::from_millis(300) };
    let mut guide = Guide::new(endpoint, gate(1.5, 0.9), patience);
    let asked = std::cell::Cell::new(0);
    let outcome = guide
        .run(
            || {
                asked.set(asked.get() + 1);
                command(asked.get())
            },
            &mut watching,
        )
        .unwrap();
    (outcome, watching, robot.join().unwrap())
}

fn is_rest(answer: &Answer) -> bool {
    let message = EgmSensor::decode(answer.bytes.as_slice()).unwrap();
    message.speed_ref.unwrap().cartesians.unwrap().as_slice().iter().all(|v| *v == 0.0)
}

/// The three ways to end are tests of their own, which take their 1.5 to 3 s of real time side by side.
#[test]
fn leads_over_real_sockets_to_the_end_of_the_path() {
    let (outcome, watching, _) = lead(Watching::default(), |_| OperatorCommand::Go);
    assert_eq!(outcome.end_reason, EndReason::Travelled, "{outcome:?}");
    assert!(is_rest(watching.answers.last().unwrap()));
    assert!(watching.answers.iter().filter(|a| !is_rest(a)).count() > 50);
}

#[test]
fn a_stop_over_real_sockets_ends_at_rest() {
    let (outcome, watching, _) =
        lead(Watching::default(), |k| if k > 250 { OperatorCommand::Stop } else { OperatorCommand::Go });
    assert_eq!(outcome.end_reason, EndReason::Stopped, "{outcome:?}");
    assert!(is_rest(watching.answers.last().unwrap()));
}

#[test]
fn silence_over_real_sockets_ends_at_rest_and_is_noticed_by_the_controller() {
    let (outcome, watching, end) =
        lead(Watching::default(), |k| if k > 250 { OperatorCommand::Silence } else { OperatorCommand::Go });
    assert_eq!(outcome.end_reason, EndReason::Stopped, "{outcome:?}");
    assert!(is_rest(watching.answers.last().unwrap()));
    assert_eq!(end, Some(GuidanceEnd::Timeout));
}

#[test]
fn a_panic_beside_the_loop_stops_the_scan_smoothly() {
    let (outcome, watching, _) =
        lead(Watching { panics: true, ..Watching::default() }, |_| OperatorCommand::Go);
    assert!(outcome.observer_panicked);
    assert_eq!(outcome.end_reason, EndReason::Stopped, "{outcome:?}");
    assert!(is_rest(watching.answers.last().unwrap()));
}
