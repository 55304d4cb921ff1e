//! The simulated controller: one cycle after the other, at any pace.

use super::arm::{Arm, Target};
use super::joints;
use super::settings::{ControllerSettings, Event, StopMode, Task};
use crate::egm::messages::{EgmMciState, EgmMotorState, EgmRapidCtrlExecState};
use crate::egm::{
    Axes, Collision, EgmClock, EgmFeedBack, EgmHeader, EgmPose, EgmRobot, EgmSensor, EgmTimestamp,
    Generation, MciState, Message, MessageType, MotorState, RapidData, RapidState,
};
use nalgebra::{Vector3, Vector6};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::{BTreeMap, VecDeque};
use std::net::IpAddr;
use trueline_geometry::{Pose, so3};

/// Why a guidance ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GuidanceEnd {
    /// Near enough to the reference for long enough: `EGMRunPose` returns.
    #[error("converged: the robot was at its reference for the condition time, and EGMRunPose returned")]
    Converged,
    /// Event 41822.
    #[error("event 41822: no data from the UdpUc device")]
    Timeout,
    /// Further from the start than allowed.
    #[error("the position deviation reached its limit")]
    RangeLeft,
}

/// State of EGM.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Guidance {
    /// Streaming; guidance begins a little later, if at all.
    Connected,
    /// References move the robot.
    Running { since_ns: i64, received_ns: i64 },
    /// Over.
    Ended(GuidanceEnd),
}

/// Most messages that wait to be read.
const LONGEST_QUEUE: usize = 1000;
/// Time from the stream's start to `EGMRunPose`, s.
const UNTIL_RUNNING_S: f64 = 0.2;

/// A controller and its robot.
#[derive(Clone, Debug)]
pub struct Controller {
    settings: ControllerSettings,
    arm: Arm,
    start: Pose,
    queue: VecDeque<Vec<u8>>,
    target: Option<Target>,
    guidance: Guidance,
    motors_on: bool,
    rapid_runs: bool,
    collided: bool,
    cycle: u64,
    sequence: u32,
    sessions: u32,
    converged_since_ns: Option<i64>,
    happened: usize,
    /// Set points of the last cycles, newest last.
    past: VecDeque<(i64, Pose)>,
    refused: BTreeMap<String, u64>,
    taken: u64,
    /// Time that the robot's own program has run, ns.
    ran_ns: i64,
    /// The signal of `\DOToSensor`, if the program names one.
    digital: Option<bool>,
    rng: ChaCha8Rng,
}

/// How long set points are remembered, s: longer than any lag and exposure.
const MEMORY_S: f64 = 0.5;

impl Controller {
    /// A controller at its start.
    #[must_use]
    pub fn new(mut settings: ControllerSettings) -> Self {
        settings.events.sort_by(|a, b| a.0.total_cmp(&b.0));
        let start = match &settings.task {
            Task::Guidance { start } => *start,
            Task::Stream { path, .. } => path.pose_at(path.span().0).unwrap_or_else(Pose::identity),
        };
        Self {
            arm: Arm::new(start, settings.following, settings.period_s),
            start,
            queue: VecDeque::new(),
            target: None,
            guidance: Guidance::Connected,
            motors_on: true,
            rapid_runs: true,
            collided: false,
            cycle: 0,
            sequence: 0,
            sessions: 1,
            converged_since_ns: None,
            happened: 0,
            past: VecDeque::new(),
            refused: BTreeMap::new(),
            taken: 0,
            ran_ns: 0,
            digital: None,
            rng: ChaCha8Rng::seed_from_u64(settings.seed),
            settings,
        }
    }

    /// The signal that it sends along (`\DOToSensor`) from now on; RobotWare before 7.7 sends none.
    pub(crate) fn set_digital(&mut self, digital: Option<bool>) {
        self.digital = digital;
    }

    /// When its next cycle is, ns after the start.
    #[must_use]
    pub fn next_cycle_ns(&self) -> i64 {
        (self.cycle as f64 * self.settings.period_s * 1e9).round() as i64
    }

    /// How often it began.
    #[must_use]
    pub fn sessions(&self) -> u32 {
        self.sessions
    }

    /// Why guidance ended, if it did.
    #[must_use]
    pub fn ended(&self) -> Option<GuidanceEnd> {
        match self.guidance {
            Guidance::Ended(end) => Some(end),
            Guidance::Connected | Guidance::Running { .. } => None,
        }
    }

    /// Accepted answers, and rejected ones by reason.
    #[must_use]
    pub fn answers(&self) -> (u64, &BTreeMap<String, u64>) {
        (self.taken, &self.refused)
    }

    /// True pose of the robot at a time of the last half second, ns after the start.
    #[must_use]
    pub fn true_pose(&self, time_ns: i64) -> Option<Pose> {
        self.set_point(time_ns - (self.settings.feedback.servo_lag_s * 1e9) as i64)
    }

    fn set_point(&self, time_ns: i64) -> Option<Pose> {
        let after = self.past.partition_point(|(at_ns, _)| *at_ns <= time_ns);
        let (before_ns, before) = self.past.get(after.checked_sub(1)?)?;
        let Some((after_ns, later)) = self.past.get(after) else { return Some(*before) };
        let share = (time_ns - before_ns) as f64 / (after_ns - before_ns) as f64;
        Some(before.lerp_slerp(later, share))
    }

    /// A datagram of the PC arrives.
    pub fn receive(&mut self, bytes: &[u8], from: IpAddr) {
        if self.settings.peer.is_some_and(|peer| peer != from) {
            *self.refused.entry("from another address".to_owned()).or_default() += 1;
        } else if self.queue.len() == LONGEST_QUEUE {
            *self.refused.entry("queue full".to_owned()).or_default() += 1;
        } else {
            self.queue.push_back(bytes.to_vec());
        }
    }

    /// One cycle: reads one message, moves the robot, and reports its pose, if it is due.
    pub fn run_cycle(&mut self) -> Option<Vec<u8>> {
        let now_ns = self.next_cycle_ns();
        self.let_happen(now_ns);
        self.guide(now_ns);
        self.move_arm(now_ns);
        self.cycle += 1;
        let silent = self.guidance == Guidance::Ended(GuidanceEnd::Converged);
        if silent || !(self.cycle - 1).is_multiple_of(u64::from(self.settings.every_cycles.max(1))) {
            return None;
        }
        let message = self.message(now_ns);
        self.sequence = self.sequence.wrapping_add(1);
        Some(message.encode_to_vec())
    }

    fn let_happen(&mut self, now_ns: i64) {
        while let Some((at_s, event)) = self.settings.events.get(self.happened)
            && *at_s <= now_ns as f64 * 1e-9
        {
            match event {
                Event::EmergencyStop => (self.motors_on, self.rapid_runs) = (false, false),
                Event::MotorsOn => (self.motors_on, self.rapid_runs) = (true, true),
                Event::RapidStop => self.rapid_runs = false,
                Event::RapidStart => self.rapid_runs = true,
                Event::Collision => self.collided = true,
                Event::Restart => {
                    self.sequence = 0;
                    self.sessions += 1;
                    self.queue.clear();
                    self.target = None;
                    self.guidance = Guidance::Connected;
                }
            }
            self.happened += 1;
        }
    }

    fn moves(&self) -> bool {
        self.motors_on && self.rapid_runs
    }

    fn guide(&mut self, now_ns: i64) {
        let received = self.queue.pop_front().and_then(|bytes| self.take(&bytes));
        if let (Guidance::Connected, Task::Guidance { .. }, true) =
            (self.guidance, &self.settings.task, self.moves())
        {
            let begins_ns = (UNTIL_RUNNING_S * 1e9) as i64;
            let is_awaited = self.settings.waits_for_pc && self.taken == 0;
            if now_ns >= begins_ns && !is_awaited {
                self.start = self.arm.pose();
                self.guidance = Guidance::Running { since_ns: now_ns, received_ns: now_ns };
            }
        }
        let Guidance::Running { since_ns, mut received_ns } = self.guidance else { return };
        if !self.moves() {
            // RAPID stopped: connected, but not running. It continues when RAPID does.
            (self.guidance, self.target) = (Guidance::Connected, None);
            return;
        }
        if let Some(target) = received {
            (self.target, received_ns) = (Some(target), now_ns);
        }
        self.guidance = Guidance::Running { since_ns, received_ns };
        if (now_ns - received_ns) as f64 * 1e-9 > self.settings.timeout_s {
            self.end(GuidanceEnd::Timeout);
        } else if self.has_converged(now_ns) {
            self.end(GuidanceEnd::Converged);
        } else if self.has_left_range() {
            self.end(GuidanceEnd::RangeLeft);
        }
    }

    fn end(&mut self, why: GuidanceEnd) {
        self.guidance = Guidance::Ended(why);
        self.target = match (why, self.settings.stop_mode) {
            (GuidanceEnd::Converged, StopMode::RampDown) => {
                Some(Target { pose: self.start, velocity: Vector6::zeros() })
            }
            _ => None,
        };
        self.rapid_runs = why == GuidanceEnd::Converged;
    }

    /// A message as a target; one that the controller would not take is counted.
    fn take(&mut self, bytes: &[u8]) -> Option<Target> {
        let taken = target_of(bytes);
        match &taken {
            Ok(_) => self.taken += 1,
            Err(reason) => *self.refused.entry(reason.clone()).or_default() += 1,
        }
        taken.ok()
    }

    fn distances(&self, to: &Pose) -> (f64, f64) {
        let pose = self.arm.pose();
        ((pose.translation.vector - to.translation.vector).norm(), pose.rotation.angle_to(&to.rotation))
    }

    fn has_converged(&mut self, now_ns: i64) -> bool {
        let near = self.is_near();
        let since_ns = if near { *self.converged_since_ns.get_or_insert(now_ns) } else { now_ns };
        if !near {
            self.converged_since_ns = None;
        }
        near && (now_ns - since_ns) as f64 * 1e-9 >= self.settings.convergence.for_s
    }

    fn is_near(&self) -> bool {
        let Some(target) = &self.target else { return false };
        let (distance_m, angle_rad) = self.distances(&target.pose);
        distance_m < self.settings.convergence.distance_m && angle_rad < self.settings.convergence.angle_rad
    }

    fn has_left_range(&self) -> bool {
        let (distance_m, angle_rad) = self.distances(&self.start);
        distance_m > self.settings.following.range_m || angle_rad > self.settings.following.range_rad
    }

    fn move_arm(&mut self, now_ns: i64) {
        if self.cycle > 0 && self.moves() {
            self.ran_ns += (self.settings.period_s * 1e9).round() as i64;
        }
        let pose = match &self.settings.task {
            Task::Stream { path, rest_s } => {
                let (begins_s, ends_s) = path.span();
                let time_s = begins_s + self.ran_ns as f64 * 1e-9 - rest_s;
                path.pose_at(time_s.clamp(begins_s, ends_s)).unwrap_or(self.start)
            }
            Task::Guidance { .. } => {
                let ramp_in = match self.guidance {
                    Guidance::Running { since_ns, .. } => {
                        let passed_s = (now_ns - since_ns) as f64 * 1e-9;
                        (passed_s / self.settings.following.ramp_in_s.max(1e-9)).min(1.0)
                    }
                    _ => 1.0,
                };
                let target = self.target.filter(|_| self.motors_on);
                self.arm.follow(target.as_ref(), ramp_in, self.settings.period_s);
                self.arm.pose()
            }
        };
        self.past.push_back((now_ns, pose));
        while self.past.front().is_some_and(|(at_ns, _)| now_ns - at_ns > (MEMORY_S * 1e9) as i64) {
            self.past.pop_front();
        }
    }

    fn message(&mut self, now_ns: i64) -> EgmRobot {
        let generation = self.settings.generation;
        let measured_ns = now_ns - (self.settings.feedback.age_s * 1e9) as i64;
        let measured = self.true_pose(measured_ns).unwrap_or(self.start);
        let measured = self.noisy(&measured);
        let planned = self.set_point(now_ns).unwrap_or(self.start);
        let controller_ns = self.settings.clock.at_ns(now_ns);
        let lag_ns = (self.settings.feedback.servo_lag_s * 1e9) as i64;
        let is_7 = generation >= Generation::From7;
        let motors = if self.motors_on { MotorState::On } else { MotorState::Off };
        let rapid = if self.rapid_runs { RapidState::Running } else { RapidState::Stopped };
        EgmRobot {
            header: Some(EgmHeader::new(
                self.sequence,
                (controller_ns / 1_000_000) as u32,
                MessageType::Data,
            )),
            feed_back: Some(state(&measured, controller_ns, generation)),
            planned: Some(state(&planned, controller_ns + lag_ns, generation)),
            motor_state: Some(EgmMotorState { state: Some(motors.into()) }),
            mci_state: Some(EgmMciState { state: Some(self.mci().into()) }),
            mci_convergence_met: Some(self.is_near()),
            test_signals: None,
            rapid_exec_state: Some(EgmRapidCtrlExecState { state: Some(rapid.into()) }),
            measured_force: Some(Axes::from([0.0; 6]).with_flag(is_7.then_some(false))),
            utilization_rate: (generation >= Generation::From6_10).then_some(100.0 * self.arm.utilization()),
            move_index: is_7.then_some(1),
            collision_info: is_7.then(|| Collision::from([0.0; 6]).with_flag(Some(self.collided))),
            rapid_data: is_7.then(|| RapidData::default().with_flag(self.digital)),
            torque_ref: (generation >= Generation::From7_16).then(|| Axes::from([0.0; 6])),
        }
    }

    fn mci(&self) -> MciState {
        match self.guidance {
            Guidance::Running { .. } => MciState::Running,
            Guidance::Ended(GuidanceEnd::Timeout | GuidanceEnd::RangeLeft) => MciState::Error,
            Guidance::Connected | Guidance::Ended(GuidanceEnd::Converged) => MciState::Stopped,
        }
    }

    fn noisy(&mut self, pose: &Pose) -> Pose {
        let mut vector = |sigma: f64| {
            Vector3::from_fn(|_, _| {
                let sample: f64 = StandardNormal.sample(&mut self.rng);
                sample * sigma
            })
        };
        let position = pose.translation.vector + vector(self.settings.feedback.noise_m);
        let rotation = so3::exp(&vector(self.settings.feedback.noise_rad)) * pose.rotation;
        Pose::from_parts(position.into(), rotation)
    }
}

fn state(pose: &Pose, controller_ns: i64, generation: Generation) -> EgmFeedBack {
    let time_ns = controller_ns.max(0) as u64;
    let (sec, nsec) = (Some(time_ns / 1_000_000_000), time_ns % 1_000_000_000);
    let clock = EgmClock { sec, usec: Some(nsec / 1000) };
    let stamp = EgmTimestamp { sec, nsec: Some(nsec) };
    EgmFeedBack {
        joints: Some(Axes::from(joints::angles_deg(pose))),
        cartesian: Some(EgmPose::full(pose)),
        external_joints: None,
        time: (generation >= Generation::From6_07).then_some(clock),
        time_stamp: (generation >= Generation::From7_16).then_some(stamp),
    }
}

fn target_of(bytes: &[u8]) -> Result<Target, String> {
    if bytes.is_empty() {
        return Err("empty".to_owned());
    }
    let message = EgmSensor::decode(bytes).map_err(|error| error.to_string())?;
    if message.header.unwrap_or_default().mtype() != MessageType::Correction {
        return Err("mtype is not CORRECTION".to_owned());
    }
    let planned = message.planned.unwrap_or_default();
    let by_joints = planned.joints.is_some();
    let no_pose = if by_joints { "joint references: not simulated, only EGMRunPose is" } else { "no pose" };
    let pose = planned.cartesian.ok_or(no_pose)?.pose().map_err(|error| error.to_string())?;
    let mut velocity = Vector6::zeros();
    if let Some(speed) = message.speed_ref.and_then(|speed| speed.cartesians) {
        let speed = speed.as_slice();
        if speed.iter().any(|v| !v.is_finite()) {
            return Err("speedRef is not finite".to_owned());
        }
        let per_unit = [1e-3, 1e-3, 1e-3].into_iter().chain([1.0_f64.to_radians(); 3]);
        for ((place, value), per_unit) in velocity.iter_mut().zip(speed).zip(per_unit) {
            *place = value * per_unit;
        }
    }
    Ok(Target { pose, velocity })
}
