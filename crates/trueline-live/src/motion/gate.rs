//! The gate before every command: a function of its state and of the received messages, nothing else.
//!
//! Its output is one of four: the path, placed at the robot's pose at its start, with a smooth start and stop; rest at the
//! path's end; rest at the robot's pose; or nothing. Every one is inside the limits, whatever is received. None is further
//! from the one before than the limits allow in the time between them. After a moving reference the last one is always
//! rest. Speed, acceleration and jerk keep their limits while the motion continues or stops smoothly. After a fault or
//! silence of the robot, rest is commanded at once, and the controller's own filters and limits brake.

use super::anchor::Anchor;
use super::checked_path::{CheckedPath, Reference};
use super::cycle_clock::{CycleClock, ReceivedFrame};
use super::limits::MotionLimits;
use super::path_timing::PathState;
use super::phase::{EndReason, OperatorCommand, Phase, SLOWEST_S};
use super::step_budget::StepBudget;
use nalgebra::Vector3;
use trueline_geometry::Pose;

/// A received message, and its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    /// The newest frame; `None` if none came.
    pub received: Option<ReceivedFrame>,
    /// Now, on the steady clock, ns.
    pub now_ns: i64,
    /// The operator's command.
    pub command: OperatorCommand,
}

/// The gate's memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GateState {
    /// Phase of the guidance.
    pub phase: Phase,
    /// The last frame that was believed.
    received: Option<ReceivedFrame>,
    pub(super) cycle_clock: CycleClock,
    pub(super) anchor: Anchor,
    pub(super) budget: StepBudget,
    /// The last message sent.
    sent: Option<Reference>,
    /// Holds of the motion because frames came late or not at all.
    pub pauses: u32,
    /// Frames that were not believed: the robot cannot have moved so far.
    pub jumps: u32,
}

impl GateState {
    /// Time between the robot's messages, s, once known.
    #[must_use]
    pub fn period_s(&self) -> Option<f64> {
        self.cycle_clock.period_s()
    }

    /// The last message sent.
    #[must_use]
    pub(crate) fn last_sent(&self) -> Option<Reference> {
        self.sent
    }

    /// Whether the controller's last report was that the robot is near its reference.
    #[must_use]
    pub fn was_converged(&self) -> bool {
        self.received.is_some_and(|received| received.frame.converged)
    }

    /// Why it has ended, if it has.
    fn ended(&self) -> Option<EndReason> {
        match self.phase {
            Phase::Stopping { why, .. } | Phase::Holding { why, .. } | Phase::Silent { why } => Some(why),
            Phase::Waiting | Phase::Travelling { .. } | Phase::Interrupted { .. } => None,
        }
    }
}

/// The limits, the path, and the controller's patience.
#[derive(Clone, Debug)]
pub struct Gate {
    pub(super) limits: MotionLimits,
    pub(super) path: CheckedPath,
    timeout_s: f64,
}

/// After this many periods without a frame nothing is sent, and the controller's own timeout acts.
const SILENT_PERIODS: f64 = 5.0;
/// A frame that is later than this is a hold-up of this program or of the network.
pub(super) const LATE_PERIODS: f64 = 3.0;
/// As long as the period is not known, this is silence, s.
const SILENT_AT_FIRST_S: f64 = 0.2;
/// Frames in time before motion continues.
pub(super) const PAUSE_FRAMES: u32 = 25;
/// Allowed difference of the feedback from frame to frame beyond the robot's own speed: noise and vibration, m.
const JUMP_SLACK_M: f64 = 0.002;
/// The same for the attitude, rad.
const JUMP_SLACK_RAD: f64 = 0.01;
/// The robot may catch up faster than its reference moves.
const CATCH_UP: f64 = 3.0;

pub(super) type Step = (Phase, Option<Reference>);

impl Gate {
    /// A gate for a path that was checked against these limits; the controller ends a guidance after so long without an answer
    /// (`\CommTimeout`), s.
    #[must_use]
    pub fn new(limits: MotionLimits, path: CheckedPath, timeout_s: f64) -> Self {
        Self { limits, path, timeout_s }
    }

    /// The path.
    #[must_use]
    pub fn path(&self) -> &CheckedPath {
        &self.path
    }

    /// One step: the new state and the message to send, if any.
    #[must_use]
    pub fn step(&self, mut state: GateState, input: &Input) -> (GateState, Option<Reference>) {
        state.budget.pass(input.now_ns);
        let too_old_s = self.silence_s(&state);
        let fresh = |received: &ReceivedFrame| seconds(received.arrival_ns, input.now_ns) <= too_old_s;
        let (phase, wanted) = match input.received.filter(fresh) {
            Some(received) => self.with_frame(&mut state, received, input.command),
            None => self.without_frame(&mut state, input.now_ns, input.command),
        };
        state.phase = phase;
        let sent = wanted.and_then(|wanted| self.allowed(&mut state, wanted, input.now_ns));
        if let Some(sent) = sent {
            let from = state.sent.map(|before| before.base_from_tool);
            let period_s = state.period_s().unwrap_or(0.0).min(SLOWEST_S);
            state.budget.spend(from.as_ref(), &sent.base_from_tool, &self.limits, period_s);
            state.sent = Some(sent);
        }
        (state, sent)
    }

    /// The reference, if it is inside the limits and no further away than there was time for. If it is not, a motion is brought to
    /// rest at the last reference, which was.
    fn allowed(&self, state: &mut GateState, wanted: Reference, now_ns: i64) -> Option<Reference> {
        let to = &wanted.base_from_tool;
        let in_time =
            state.sent.is_none_or(|sent| state.budget.has_time(&sent.base_from_tool, to, &self.limits));
        if in_time && self.limits.contain(to) {
            return Some(wanted);
        }
        let moving = state.sent.filter(|sent| !sent.is_rest())?;
        let at = moving.base_from_tool;
        state.phase = match state.phase {
            Phase::Holding { why, since_ns, .. } => Phase::Holding { at, since_ns, why },
            Phase::Silent { why } => Phase::Silent { why },
            _ => Phase::Holding { at, since_ns: now_ns, why: EndReason::OutsideLimits },
        };
        Some(Reference::rest(at))
    }

    fn silence_s(&self, state: &GateState) -> f64 {
        let silence_s = state.period_s().map_or(SILENT_AT_FIRST_S, |period_s| SILENT_PERIODS * period_s);
        silence_s.min(self.timeout_s)
    }

    /// Without a frame there is nothing to answer; but silence is noticed, and the operator is listened to.
    fn without_frame(&self, state: &mut GateState, now_ns: i64, command: OperatorCommand) -> Step {
        if command == OperatorCommand::Silence
            || (command == OperatorCommand::Stop && state.phase == Phase::Waiting)
        {
            return self.silence(state);
        }
        let Some(received) = state.received else { return (state.phase, None) };
        let silent_s = seconds(received.arrival_ns, now_ns);
        let limit_s = match state.phase {
            Phase::Interrupted { .. } => self.timeout_s,
            _ => self.silence_s(state),
        };
        if silent_s > limit_s { self.fall_silent(state, silent_s) } else { (state.phase, None) }
    }

    fn with_frame(&self, state: &mut GateState, received: ReceivedFrame, command: OperatorCommand) -> Step {
        let Some(before) = state.received else {
            (state.received, state.cycle_clock) = (Some(received), CycleClock::default());
            return (state.phase, None);
        };
        if received.is_first {
            return self.new_session(state, &before, received);
        }
        if let Phase::Interrupted { on_path } = state.phase {
            return self.take_up(state, on_path, (&before, received), command);
        }
        let silent_s = seconds(before.arrival_ns, received.arrival_ns);
        if silent_s > self.silence_s(state) {
            return self.fall_silent(state, silent_s);
        }
        if self.has_jumped(state, &before, &received) {
            state.jumps += 1;
            return (state.phase, None);
        }
        state.received = Some(received);
        state.cycle_clock.learn(&received);
        self.advance(state, &before, &received, command)
    }

    /// The controller began anew: nothing is guided any more. It is held at its reported pose, or at the last reference if
    /// that pose is impossible.
    fn new_session(&self, state: &mut GateState, before: &ReceivedFrame, received: ReceivedFrame) -> Step {
        let jumped = self.has_jumped(state, before, &received);
        state.received = Some(received);
        if matches!(state.phase, Phase::Waiting | Phase::Silent { .. }) {
            state.cycle_clock = CycleClock::default();
            return (state.phase, None);
        }
        state.jumps += u32::from(jumped);
        let robot = received.frame.base_from_tool;
        let at = state.sent.filter(|_| jumped).map_or(robot, |sent| sent.base_from_tool);
        self.hold(state, at, &received, state.ended().unwrap_or(EndReason::Restarted))
    }

    /// A robot under guidance gets one final hold at the last reference.
    fn fall_silent(&self, state: &mut GateState, silent_s: f64) -> Step {
        let why = state.ended().unwrap_or(EndReason::RobotSilent { silent_s });
        let rest = |on_path: &PathState| Some(Reference::rest(self.laid(state, on_path).base_from_tool));
        match state.phase {
            Phase::Travelling { on_path, .. } => {
                let on_path = PathState { asked: 0.0, rate: 0.0, ..on_path };
                (Phase::Interrupted { on_path }, rest(&on_path))
            }
            Phase::Stopping { on_path, .. } => (Phase::Silent { why }, rest(&on_path)),
            Phase::Holding { at, .. } => (Phase::Silent { why }, Some(self.rest_toward(state, &at))),
            Phase::Interrupted { .. } | Phase::Silent { .. } => (Phase::Silent { why }, None),
            Phase::Waiting => {
                // Later messages start anew.
                (state.received, state.cycle_clock) = (None, CycleClock::default());
                (Phase::Waiting, None)
            }
        }
    }

    /// Resumes after an interruption, from rest, after some frames in time. It must be the same session of a controller that
    /// still follows, and the robot must be at its last pose. Frames that waited somewhere on the way report an old pose:
    /// they are skipped until a fresh one comes.
    fn take_up(
        &self,
        state: &mut GateState,
        on_path: PathState,
        (before, received): (&ReceivedFrame, ReceivedFrame),
        command: OperatorCommand,
    ) -> Step {
        if command == OperatorCommand::Silence {
            return self.silence(state);
        }
        let arrivals_s = seconds(before.arrival_ns, received.arrival_ns);
        let controller_s = received.frame.device_ns.saturating_sub(before.frame.device_ns) as f64 * 1e-9;
        let ahead_s = controller_s - arrivals_s;
        if arrivals_s > self.timeout_s || ahead_s > self.silence_s(state) {
            return self.fall_silent(state, arrivals_s);
        }
        if ahead_s < -LATE_PERIODS * state.period_s().unwrap_or(0.0) {
            return (state.phase, None);
        }
        if self.has_jumped(state, before, &received) {
            return self.disbelieve(state, before, &received);
        }
        state.received = Some(received);
        state.pauses += 1;
        state.cycle_clock.settle();
        let broken_off = self.broken_off(state, &on_path, &received);
        match broken_off.or((command == OperatorCommand::Stop).then_some(EndReason::Stopped)) {
            Some(why) => self.hold(state, received.frame.base_from_tool, &received, why),
            None => {
                let rest = Reference::rest(self.laid(state, &on_path).base_from_tool);
                let paused_for = PAUSE_FRAMES;
                (Phase::Travelling { on_path, braking_for_end: false, paused_for }, Some(rest))
            }
        }
    }

    /// A leap while it rests: if nothing else comes before the timeout, that is the end.
    fn disbelieve(&self, state: &mut GateState, before: &ReceivedFrame, received: &ReceivedFrame) -> Step {
        state.jumps += 1;
        let passed_s = seconds(before.arrival_ns, received.arrival_ns);
        if passed_s + self.silence_s(state) < self.timeout_s {
            return (state.phase, None);
        }
        let (distance_m, angle_rad) = apart(&before.frame.base_from_tool, &received.frame.base_from_tool);
        (Phase::Silent { why: EndReason::NotBelieved { distance_m, angle_rad } }, None)
    }

    /// One final hold, if the last reference was a movement.
    fn silence(&self, state: &GateState) -> Step {
        let why = state.ended().unwrap_or(EndReason::Stopped);
        let moving = state.sent.filter(|sent| !sent.is_rest());
        (Phase::Silent { why }, moving.map(|sent| Reference::rest(sent.base_from_tool)))
    }

    /// Whether the robot cannot have moved so far. It may catch up for as long as is no silence; in a longer one it moves at
    /// its reference's speed at most.
    fn has_jumped(&self, state: &GateState, before: &ReceivedFrame, now: &ReceivedFrame) -> bool {
        let passed_s = seconds(before.arrival_ns, now.arrival_ns).max(state.period_s().unwrap_or(0.0));
        let caught_up_s = passed_s.min(self.silence_s(state));
        let may_s = passed_s + (CATCH_UP - 1.0) * caught_up_s;
        let (distance_m, angle_rad) = apart(&before.frame.base_from_tool, &now.frame.base_from_tool);
        // Written so that NaN counts as a jump.
        let near = distance_m <= self.limits.speed_m_s * may_s + JUMP_SLACK_M
            && angle_rad <= self.limits.turn_rad_s * may_s + JUMP_SLACK_RAD;
        !near
    }

    fn advance(
        &self,
        state: &mut GateState,
        before: &ReceivedFrame,
        received: &ReceivedFrame,
        command: OperatorCommand,
    ) -> Step {
        if command == OperatorCommand::Silence {
            return self.silence(state);
        }
        match state.phase {
            Phase::Waiting => self.begin(state, received, command),
            Phase::Silent { why } => (Phase::Silent { why }, None),
            Phase::Holding { at, since_ns, why } => self.go_on_holding(state, (at, since_ns, why), received),
            Phase::Travelling { .. } | Phase::Interrupted { .. } | Phase::Stopping { .. } => {
                self.travel(state, before, received, command)
            }
        }
    }

    /// Before the scan the robot is commanded to stay in place.
    fn begin(&self, state: &mut GateState, received: &ReceivedFrame, command: OperatorCommand) -> Step {
        let robot = received.frame.base_from_tool;
        if command == OperatorCommand::Stop {
            return self.hold(state, robot, received, EndReason::Stopped);
        }
        let Some(rest) = self.echo(state, &robot) else { return (Phase::Waiting, None) };
        let period_s = state.period_s().filter(|_| received.frame.is_guided());
        let Some(period_s) = period_s else { return (Phase::Waiting, Some(rest)) };
        if period_s > SLOWEST_S {
            return self.hold(state, rest.base_from_tool, received, EndReason::TooSlow { period_s });
        }
        let start = self.path.at(0.0).base_from_tool;
        let (distance_m, angle_rad) = apart(&start, &rest.base_from_tool);
        if distance_m > self.limits.start_m || angle_rad > self.limits.start_rad {
            let why = EndReason::StartTooFar { distance_m, angle_rad };
            return self.hold(state, rest.base_from_tool, received, why);
        }
        state.anchor = Anchor::between(&start, &rest.base_from_tool);
        state.cycle_clock.settle();
        let on_path = PathState::default();
        (Phase::Travelling { on_path, braking_for_end: false, paused_for: 0 }, Some(rest))
    }

    /// Held at its pose; a robot without guidance is followed, because its controller does not listen. One that is guided
    /// and yet elsewhere is left to its controller's timeout: any reference would move it.
    fn go_on_holding(
        &self,
        state: &GateState,
        (at, since_ns, why): (Pose, i64, EndReason),
        received: &ReceivedFrame,
    ) -> Step {
        let robot = received.frame.base_from_tool;
        if !received.frame.is_guided() {
            let rest = self.echo(state, &robot);
            let at = rest.map_or(at, |rest| rest.base_from_tool);
            return (Phase::Holding { at, since_ns, why }, rest);
        }
        let (distance_m, angle_rad) = apart(&at, &robot);
        if distance_m > self.limits.deviation_m || angle_rad > self.limits.deviation_rad {
            return self.silence(state);
        }
        (Phase::Holding { at, since_ns, why }, Some(self.rest_toward(state, &at)))
    }

    /// Rest at a place, or as near to it as there was time for.
    fn rest_toward(&self, state: &GateState, at: &Pose) -> Reference {
        let reached = |sent: Reference| state.budget.toward(&sent.base_from_tool, at, &self.limits);
        Reference::rest(state.sent.map_or(*at, reached))
    }

    /// Rest where the robot is; nothing if the last reference was too far from there for the time that has passed.
    fn echo(&self, state: &GateState, robot: &Pose) -> Option<Reference> {
        let rest = self.rest_toward(state, robot);
        let (distance_m, angle_rad) = apart(&rest.base_from_tool, robot);
        (distance_m <= JUMP_SLACK_M && angle_rad <= JUMP_SLACK_RAD).then_some(rest)
    }

    pub(super) fn hold(&self, state: &GateState, at: Pose, received: &ReceivedFrame, why: EndReason) -> Step {
        (Phase::Holding { at, since_ns: received.arrival_ns, why }, Some(self.rest_toward(state, &at)))
    }
}

pub(super) fn seconds(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 * 1e-9
}

/// Distance, m, and angle, rad.
pub(super) fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    let distance: Vector3<f64> = a.translation.vector - b.translation.vector;
    (distance.norm(), a.rotation.angle_to(&b.rotation))
}
