//! The gate before every command: a function of its state and of what was received, nothing else.
//!
//! What leaves it is one of four: the path, laid at where the robot was when it began, at a rate that starts and stops
//! smoothly; rest where that ended; rest where the robot is; or nothing. Every one is inside the limits, whatever is received,
//! and after a moving reference the last one is always rest. Speed, acceleration and jerk keep their limits as long as the
//! motion goes on or stops smoothly; where something is wrong, or the robot is silent, rest is asked for at once, and the
//! controller's own filters and limits brake.

use super::anchor::Anchor;
use super::checked_path::{CheckedPath, Reference};
use super::cycle_clock::{CycleClock, ReceivedFrame};
use super::limits::MotionLimits;
use super::path_timing::PathState;
use super::phase::{EndReason, OperatorCommand, Phase};
use nalgebra::Vector3;
use trueline_geometry::Pose;

/// What was received, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    /// The newest frame; `None` if none came.
    pub received: Option<ReceivedFrame>,
    /// Now, on the steady clock, ns.
    pub now_ns: i64,
    /// What the operator wants.
    pub command: OperatorCommand,
}

/// The gate's memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GateState {
    /// What it is about.
    pub phase: Phase,
    /// The last frame that was believed.
    received: Option<ReceivedFrame>,
    cycle_clock: CycleClock,
    anchor: Anchor,
    /// What was sent last.
    sent: Option<Reference>,
    /// Holds of the motion because frames came late or not at all.
    pub pauses: u32,
    /// Frames that were not believed: the robot cannot have moved so far.
    pub jumps: u32,
}

impl GateState {
    /// Time between the robot's messages, s, once it is known.
    #[must_use]
    pub fn period_s(&self) -> Option<f64> {
        self.cycle_clock.period_s()
    }

    /// What was sent last.
    #[must_use]
    pub fn last_sent(&self) -> Option<Reference> {
        self.sent
    }

    /// Whether the controller said last that the robot is near its reference.
    #[must_use]
    pub fn was_converged(&self) -> bool {
        self.received.is_some_and(|received| received.frame.converged)
    }
}

/// The limits, the path, and the controller's patience.
#[derive(Clone, Debug)]
pub struct Gate {
    limits: MotionLimits,
    path: CheckedPath,
    timeout_s: f64,
}

/// After so many periods without a frame nothing is sent, and the controller's own timeout acts.
const SILENT_PERIODS: f64 = 5.0;
/// A frame that is later than this is a hold-up of this program or of the way.
const LATE_PERIODS: f64 = 3.0;
/// As long as the period is not known, this is silence, s.
const SILENT_AT_FIRST_S: f64 = 0.2;
/// Frames in time before the motion goes on.
const PAUSE_FRAMES: u32 = 25;
/// What the feedback may differ from one frame to the next beside the robot's own speed: noise and vibration, m.
const JUMP_SLACK_M: f64 = 0.002;
/// The same for the attitude, rad.
const JUMP_SLACK_RAD: f64 = 0.01;
/// The robot may catch up faster than its reference moves.
const CATCH_UP: f64 = 3.0;

type Step = (Phase, Option<Reference>);

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

    /// One step: the new state and what to send, if anything.
    #[must_use]
    pub fn step(&self, mut state: GateState, input: &Input) -> (GateState, Option<Reference>) {
        let too_old_s = self.silence_s(&state);
        let fresh =
            |received: &ReceivedFrame| (input.now_ns - received.arrival_ns) as f64 * 1e-9 <= too_old_s;
        let (phase, wanted) = match input.received.filter(fresh) {
            Some(received) => self.with_frame(&mut state, received, input.command),
            None => self.without_frame(&mut state, input.now_ns, input.command),
        };
        state.phase = phase;
        let sent = wanted.and_then(|wanted| self.allowed(&mut state, wanted, input.now_ns));
        state.sent = sent.or(state.sent);
        (state, sent)
    }

    /// The reference, if it is inside the limits. If it is not, whoever moves is brought to rest where he was sent last, which was
    /// inside.
    fn allowed(&self, state: &mut GateState, wanted: Reference, now_ns: i64) -> Option<Reference> {
        if self.limits.contain(&wanted.base_from_tool) {
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
        state.period_s().map_or(SILENT_AT_FIRST_S, |period_s| SILENT_PERIODS * period_s)
    }

    /// Without a frame there is nothing to answer; but silence is noticed, and the operator is listened to.
    fn without_frame(&self, state: &mut GateState, now_ns: i64, command: OperatorCommand) -> Step {
        if command == OperatorCommand::Silence
            || (command == OperatorCommand::Stop && state.phase == Phase::Waiting)
        {
            return self.silence(state);
        }
        let Some(received) = state.received else { return (state.phase, None) };
        let silent_s = (now_ns - received.arrival_ns) as f64 * 1e-9;
        let limit_s = match state.phase {
            Phase::Interrupted { .. } => self.timeout_s,
            _ => self.silence_s(state),
        };
        if silent_s > limit_s { self.fall_silent(state, silent_s) } else { (state.phase, None) }
    }

    fn with_frame(&self, state: &mut GateState, received: ReceivedFrame, command: OperatorCommand) -> Step {
        let robot = received.frame.base_from_tool;
        if received.is_first && !matches!(state.phase, Phase::Waiting | Phase::Silent { .. }) {
            state.received = Some(received);
            return hold(robot, &received, self.ended(state).unwrap_or(EndReason::Restarted));
        }
        if let Phase::Interrupted { on_path } = state.phase {
            return self.take_up(state, on_path, received, command);
        }
        let Some(before) = state.received.replace(received) else {
            state.cycle_clock = CycleClock::default();
            return (state.phase, None);
        };
        let silent_s = (received.arrival_ns - before.arrival_ns) as f64 * 1e-9;
        if silent_s > self.silence_s(state) {
            state.received = Some(before);
            return self.fall_silent(state, silent_s);
        }
        if self.has_jumped(state, &before, &received) {
            state.received = Some(before);
            state.jumps += 1;
            return (state.phase, None);
        }
        state.cycle_clock.learn(&received);
        self.advance(state, &before, &received, command)
    }

    /// Whoever was being led gets one last word: rest at the last reference.
    fn fall_silent(&self, state: &mut GateState, silent_s: f64) -> Step {
        let why = self.ended(state).unwrap_or(EndReason::RobotSilent { silent_s });
        let rest = |on_path: &PathState| Some(Reference::rest(self.laid(state, on_path).base_from_tool));
        match state.phase {
            Phase::Travelling { on_path, .. } => {
                let on_path = PathState { asked: 0.0, rate: 0.0, ..on_path };
                (Phase::Interrupted { on_path }, rest(&on_path))
            }
            Phase::Stopping { on_path, .. } => (Phase::Silent { why }, rest(&on_path)),
            Phase::Holding { at, .. } => (Phase::Silent { why }, Some(Reference::rest(at))),
            Phase::Interrupted { .. } | Phase::Silent { .. } => (Phase::Silent { why }, None),
            Phase::Waiting => {
                // What comes later begins anew.
                (state.received, state.cycle_clock) = (None, CycleClock::default());
                (Phase::Waiting, None)
            }
        }
    }

    /// Goes on after an interruption: from rest, after some frames in time, if it is the same session of a controller that
    /// still follows, and the robot is where it was left.
    fn take_up(
        &self,
        state: &mut GateState,
        on_path: PathState,
        received: ReceivedFrame,
        command: OperatorCommand,
    ) -> Step {
        let Some(before) = state.received.replace(received) else { return self.silence(state) };
        let arrivals_s = (received.arrival_ns - before.arrival_ns) as f64 * 1e-9;
        let controller_s = received.frame.device_ns.saturating_sub(before.frame.device_ns) as f64 * 1e-9;
        let continues = (controller_s - arrivals_s).abs() < self.silence_s(state);
        if arrivals_s > self.timeout_s || !continues {
            return self.fall_silent(state, arrivals_s);
        }
        state.pauses += 1;
        state.cycle_clock.settle();
        if command == OperatorCommand::Silence {
            return self.silence(state);
        }
        let broken_off = self.broken_off(state, &on_path, &received);
        match broken_off.or((command == OperatorCommand::Stop).then_some(EndReason::Stopped)) {
            Some(why) => hold(received.frame.base_from_tool, &received, why),
            None => {
                let rest = Reference::rest(self.laid(state, &on_path).base_from_tool);
                (Phase::Travelling { on_path, braking_for_end: false, paused_for: PAUSE_FRAMES }, Some(rest))
            }
        }
    }

    /// One last word of rest, if the last one was not.
    fn silence(&self, state: &GateState) -> Step {
        let why = self.ended(state).unwrap_or(EndReason::Stopped);
        let moving = state.sent.filter(|sent| !sent.is_rest());
        (Phase::Silent { why }, moving.map(|sent| Reference::rest(sent.base_from_tool)))
    }

    /// Why it has ended, if it has.
    fn ended(&self, state: &GateState) -> Option<EndReason> {
        match state.phase {
            Phase::Stopping { why, .. } | Phase::Holding { why, .. } | Phase::Silent { why } => Some(why),
            Phase::Waiting | Phase::Travelling { .. } | Phase::Interrupted { .. } => None,
        }
    }

    fn has_jumped(&self, state: &GateState, before: &ReceivedFrame, now: &ReceivedFrame) -> bool {
        let passed_s = (now.arrival_ns - before.arrival_ns) as f64 * 1e-9;
        let passed_s = passed_s.max(state.period_s().unwrap_or(0.0));
        let (distance_m, angle_rad) = apart(&before.frame.base_from_tool, &now.frame.base_from_tool);
        // Written so that what is no number is a jump.
        let near = distance_m <= CATCH_UP * self.limits.speed_m_s * passed_s + JUMP_SLACK_M
            && angle_rad <= CATCH_UP * self.limits.turn_rad_s * passed_s + JUMP_SLACK_RAD;
        !near
    }

    fn advance(
        &self,
        state: &mut GateState,
        before: &ReceivedFrame,
        received: &ReceivedFrame,
        command: OperatorCommand,
    ) -> Step {
        let robot = received.frame.base_from_tool;
        if command == OperatorCommand::Silence {
            return self.silence(state);
        }
        match state.phase {
            Phase::Waiting => self.begin(state, received, command),
            Phase::Silent { why } => (Phase::Silent { why }, None),
            Phase::Holding { at, since_ns, why } => {
                let at = if received.frame.is_guided() { at } else { robot };
                (Phase::Holding { at, since_ns, why }, Some(Reference::rest(at)))
            }
            Phase::Travelling { on_path, .. }
            | Phase::Interrupted { on_path }
            | Phase::Stopping { on_path, .. } => {
                if let Some(why) = self.broken_off(state, &on_path, received) {
                    return hold(robot, received, why);
                }
                let period_s = state.period_s().unwrap_or(0.0);
                let arrivals_s = (received.arrival_ns - before.arrival_ns) as f64 * 1e-9;
                let late = arrivals_s > LATE_PERIODS * period_s;
                let mut elapsed_s = state.cycle_clock.elapsed_s(before, received, period_s);
                if late {
                    // Its time is lost, not made up for: the reference must not leap.
                    elapsed_s = elapsed_s.min(period_s);
                    state.cycle_clock.settle();
                }
                self.travel(state, received, elapsed_s, (late, command))
            }
        }
    }

    /// Before the scan the robot is told to stay where it is.
    fn begin(&self, state: &mut GateState, received: &ReceivedFrame, command: OperatorCommand) -> Step {
        let robot = received.frame.base_from_tool;
        if command == OperatorCommand::Stop {
            return hold(robot, received, EndReason::Stopped);
        }
        if !received.frame.is_guided() || state.period_s().is_none() {
            return (Phase::Waiting, Some(Reference::rest(robot)));
        }
        let start = self.path.at(0.0).base_from_tool;
        let (distance_m, angle_rad) = apart(&start, &robot);
        if distance_m > self.limits.start_m || angle_rad > self.limits.start_rad {
            return hold(robot, received, EndReason::StartTooFar { distance_m, angle_rad });
        }
        state.anchor = Anchor::between(&start, &robot);
        state.cycle_clock.settle();
        let travelling =
            Phase::Travelling { on_path: PathState::default(), braking_for_end: false, paused_for: 0 };
        (travelling, Some(Reference::rest(robot)))
    }

    /// What leaves no time for a smooth stop.
    fn broken_off(
        &self,
        state: &GateState,
        on_path: &PathState,
        received: &ReceivedFrame,
    ) -> Option<EndReason> {
        if !received.frame.is_guided() {
            return Some(EndReason::LeftGuidance);
        }
        if received.frame.collided {
            return Some(EndReason::Collision);
        }
        let reference = self.laid(state, on_path).base_from_tool;
        let (distance_m, angle_rad) = apart(&reference, &received.frame.base_from_tool);
        let near = distance_m <= self.limits.deviation_m && angle_rad <= self.limits.deviation_rad;
        (!near).then_some(EndReason::Deviation { distance_m, angle_rad })
    }

    fn travel(
        &self,
        state: &mut GateState,
        received: &ReceivedFrame,
        elapsed_s: f64,
        (late, command): (bool, OperatorCommand),
    ) -> Step {
        let phase = match state.phase {
            Phase::Travelling { on_path, braking_for_end, paused_for } => {
                if let Some(percent) = received.frame.utilization_percent.filter(|u| *u > 100.0) {
                    self.brake(on_path, elapsed_s, EndReason::Overload { percent })
                } else if command == OperatorCommand::Stop {
                    self.brake(on_path, elapsed_s, EndReason::Stopped)
                } else {
                    state.pauses += u32::from(late);
                    let paused_for = if late { PAUSE_FRAMES } else { paused_for.saturating_sub(1) };
                    self.travel_on(on_path, elapsed_s, braking_for_end, paused_for)
                }
            }
            Phase::Stopping { on_path, why } => self.brake(on_path, elapsed_s, why),
            other => other,
        };
        match phase {
            Phase::Travelling { on_path, braking_for_end: true, .. } if on_path.rests() => {
                hold(self.laid(state, &on_path).base_from_tool, received, EndReason::Travelled)
            }
            Phase::Stopping { on_path, why } if on_path.rests() => {
                hold(self.laid(state, &on_path).base_from_tool, received, why)
            }
            Phase::Travelling { on_path, .. } | Phase::Stopping { on_path, .. } => {
                (phase, Some(self.laid(state, &on_path)))
            }
            other => (other, None),
        }
    }

    fn brake(&self, on_path: PathState, elapsed_s: f64, why: EndReason) -> Phase {
        Phase::Stopping { on_path: on_path.after(elapsed_s, self.path.ramp(), false), why }
    }

    /// Goes on as long as it could still stop before the path's end.
    fn travel_on(&self, on_path: PathState, elapsed_s: f64, braking_for_end: bool, paused_for: u32) -> Phase {
        let ramp = self.path.ramp();
        let gone_on = on_path.after(elapsed_s, ramp, true);
        let braking_for_end =
            braking_for_end || gone_on.path_s + gone_on.until_rest_s(ramp) > self.path.duration_s();
        let go = !braking_for_end && paused_for == 0;
        let on_path = if go { gone_on } else { on_path.after(elapsed_s, ramp, false) };
        Phase::Travelling { on_path, braking_for_end, paused_for }
    }

    fn laid(&self, state: &GateState, on_path: &PathState) -> Reference {
        state.anchor.lay(self.path.along(on_path))
    }
}

fn hold(at: Pose, received: &ReceivedFrame, why: EndReason) -> Step {
    (Phase::Holding { at, since_ns: received.arrival_ns, why }, Some(Reference::rest(at)))
}

fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    let distance: Vector3<f64> = a.translation.vector - b.translation.vector;
    (distance.norm(), a.rotation.angle_to(&b.rotation))
}
