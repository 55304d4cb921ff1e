//! The gate before every command: a function of its state and of what was heard, nothing else.
//!
//! What leaves it is one of four: the path, laid at where the robot was when it began, at a rate that starts and stops
//! smoothly; rest where that ended; rest where the robot is; or nothing. None of them is outside the limits, whatever is
//! heard: the path was checked before ([`CheckedPath`]), and a pose outside box or cone is never sent.

use super::checked_path::{CheckedPath, Reference};
use super::limits::MotionLimits;
use super::phase::{Ending, Phase, Wish};
use super::ride::Ride;
use crate::robot_frame::RobotFrame;
use nalgebra::{UnitQuaternion, Vector3};
use trueline_geometry::Pose;

/// What was heard, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    /// The newest frame; `None` if none came.
    pub frame: Option<RobotFrame>,
    /// Now, or when the frame came, on the steady clock, ns.
    pub steady_ns: i64,
    /// What the operator wants.
    pub wish: Wish,
}

/// The gate's memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GateState {
    /// What it is about.
    pub phase: Phase,
    /// The last frame that was believed, and when it came.
    heard: Option<(RobotFrame, i64)>,
    anchor: Anchor,
    /// Holds of the ride because this program was late.
    pub pauses: u32,
    /// Frames that were not believed: the robot cannot have moved so far.
    pub jumps: u32,
}

impl Default for GateState {
    fn default() -> Self {
        Self { phase: Phase::Waiting, heard: None, anchor: Anchor::default(), pauses: 0, jumps: 0 }
    }
}

/// Where the path was laid.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Anchor {
    shift_m: Vector3<f64>,
    /// In the tool.
    turn: UnitQuaternion<f64>,
}

impl Default for Anchor {
    fn default() -> Self {
        Self { shift_m: Vector3::zeros(), turn: UnitQuaternion::identity() }
    }
}

impl Anchor {
    fn between(path_start: &Pose, robot: &Pose) -> Self {
        Self {
            shift_m: robot.translation.vector - path_start.translation.vector,
            turn: path_start.rotation.inverse() * robot.rotation,
        }
    }

    fn lay(&self, mut reference: Reference) -> Reference {
        reference.base_from_tool.translation.vector += self.shift_m;
        reference.base_from_tool.rotation *= self.turn;
        reference
    }
}

/// The limits, the path, and the rhythm of the robot.
#[derive(Clone, Debug)]
pub struct Gate {
    limits: MotionLimits,
    path: CheckedPath,
    period_s: f64,
}

/// After so many periods without a frame nothing is sent, and the controller's own timeout acts.
const SILENT_PERIODS: f64 = 5.0;
/// After so long the controller's own timeout has acted, and nothing goes on, s (`\CommTimeout` as `trueline rapid` has it).
const LONGEST_SILENCE_S: f64 = 0.2;
/// A frame that is later than this is a hold-up of this program or of the way.
const LATE_PERIODS: f64 = 3.0;
/// Frames in time before a ride goes on.
const PAUSE_FRAMES: u32 = 25;
/// What the feedback may differ from one frame to the next beside the robot's own speed: noise and vibration, m.
const JUMP_SLACK_M: f64 = 0.002;
/// The same for the attitude, rad.
const JUMP_SLACK_RAD: f64 = 0.01;
/// The robot may catch up faster than its reference moves.
const CATCH_UP: f64 = 3.0;

impl Gate {
    /// A gate for a path that was checked against these limits; the robot sends a frame each period.
    #[must_use]
    pub fn new(limits: MotionLimits, path: CheckedPath, period_s: f64) -> Self {
        Self { limits, path, period_s }
    }

    /// The path.
    #[must_use]
    pub fn path(&self) -> &CheckedPath {
        &self.path
    }

    /// One step: the new state and what to send, if anything.
    #[must_use]
    pub fn step(&self, mut state: GateState, input: &Input) -> (GateState, Option<Reference>) {
        if let Some(silent_s) = self.silent_s(&state, input.steady_ns) {
            return match (state.phase, input.frame) {
                (Phase::Interrupted { ride }, Some(frame)) => {
                    self.take_up(state, &ride, frame, silent_s, input)
                }
                (Phase::Interrupted { .. }, None) if silent_s <= LONGEST_SILENCE_S => (state, None),
                _ => self.fall_silent(state, silent_s),
            };
        }
        let Some(frame) = input.frame else { return self.without_frame(state, input) };
        if self.has_jumped(&state, &frame, input.steady_ns) {
            state.jumps += 1;
            return (state, None);
        }
        let before = state.heard.replace((frame, input.steady_ns));
        let Some((before, before_ns)) = before else { return (state, None) };
        let elapsed_s = self.elapsed_s(&before, &frame, input.steady_ns - before_ns);
        let (phase, reference) = self.advance(&mut state, &frame, elapsed_s, input);
        state.phase = phase;
        (state, reference.filter(|r| self.limits.contain(&r.base_from_tool)))
    }

    /// How long nothing was heard, if too long.
    fn silent_s(&self, state: &GateState, now_ns: i64) -> Option<f64> {
        let (_, heard_ns) = state.heard?;
        let silent_s = (now_ns - heard_ns) as f64 * 1e-9;
        (silent_s > SILENT_PERIODS * self.period_s).then_some(silent_s)
    }

    /// Whoever was being led gets one last word: rest at the last reference.
    fn fall_silent(&self, mut state: GateState, silent_s: f64) -> (GateState, Option<Reference>) {
        let why = Ending::RobotSilent { silent_s };
        let (phase, last) = match state.phase {
            Phase::Riding { ride, .. } => {
                let ride = Ride { asked: 0.0, rate: 0.0, ..ride };
                (Phase::Interrupted { ride }, Some(self.laid(&state, &ride).base_from_tool))
            }
            Phase::Stopping { ride, .. } => {
                (Phase::Silent { why }, Some(self.laid(&state, &ride).base_from_tool))
            }
            Phase::Holding { at, why, .. } => (Phase::Silent { why }, Some(at)),
            Phase::Interrupted { .. } => (Phase::Silent { why }, None),
            Phase::Waiting => (Phase::Waiting, None),
            Phase::Silent { why } => (Phase::Silent { why }, None),
        };
        if !matches!(phase, Phase::Interrupted { .. }) {
            // What comes later begins anew.
            state.heard = None;
        }
        state.phase = phase;
        (state, last.map(Reference::rest).filter(|r| self.limits.contain(&r.base_from_tool)))
    }

    /// Goes on after an interruption: from rest, after some frames in time, if it is the same session of a controller that
    /// still follows, and the robot is where it was left.
    fn take_up(
        &self,
        mut state: GateState,
        ride: &Ride,
        frame: RobotFrame,
        silent_s: f64,
        input: &Input,
    ) -> (GateState, Option<Reference>) {
        let continues = state.heard.is_some_and(|(before, before_ns)| {
            let controller_s = frame.device_ns.saturating_sub(before.device_ns) as f64 * 1e-9;
            let arrivals_s = (input.steady_ns - before_ns) as f64 * 1e-9;
            let ahead = frame.sequence.wrapping_sub(before.sequence);
            (controller_s - arrivals_s).abs() < SILENT_PERIODS * self.period_s && ahead <= u32::MAX / 2
        });
        if silent_s > LONGEST_SILENCE_S || !continues {
            return self.fall_silent(state, silent_s);
        }
        let robot = frame.base_from_tool;
        let broken_off = match input.wish {
            Wish::Go => self.broken_off(&state, ride, &frame),
            Wish::Stop | Wish::Silence => Some(Ending::Stopped),
        };
        state.heard = Some((frame, input.steady_ns));
        state.pauses += 1;
        let rest = match broken_off {
            Some(why) => {
                state.phase = Phase::Holding { at: robot, since_ns: input.steady_ns, why };
                robot
            }
            None => {
                state.phase = Phase::Riding { ride: *ride, ending: false, paused_for: PAUSE_FRAMES };
                self.laid(&state, ride).base_from_tool
            }
        };
        (state, Some(Reference::rest(rest)).filter(|r| self.limits.contain(&r.base_from_tool)))
    }

    /// Without a frame there is nothing to answer; only the wish for silence is carried out at once.
    fn without_frame(&self, mut state: GateState, input: &Input) -> (GateState, Option<Reference>) {
        let at = match (input.wish, state.heard) {
            (Wish::Silence, Some((heard, _))) => heard.base_from_tool,
            _ => return (state, None),
        };
        let (phase, last) = self.silence(&state, at);
        state.phase = phase;
        (state, last)
    }

    fn silence(&self, state: &GateState, robot: Pose) -> (Phase, Option<Reference>) {
        let last = match state.phase {
            Phase::Waiting | Phase::Silent { .. } => None,
            Phase::Riding { .. } | Phase::Interrupted { .. } | Phase::Stopping { .. } => Some(robot),
            Phase::Holding { at, .. } => Some(at),
        };
        let why = match state.phase {
            Phase::Stopping { why, .. } | Phase::Holding { why, .. } | Phase::Silent { why } => why,
            Phase::Waiting | Phase::Riding { .. } | Phase::Interrupted { .. } => Ending::Stopped,
        };
        (Phase::Silent { why }, last.map(Reference::rest).filter(|r| self.limits.contain(&r.base_from_tool)))
    }

    fn has_jumped(&self, state: &GateState, frame: &RobotFrame, now_ns: i64) -> bool {
        let Some((before, before_ns)) = &state.heard else { return false };
        let passed_s = ((now_ns - before_ns) as f64 * 1e-9).max(self.period_s);
        let (distance_m, angle_rad) = apart(&before.base_from_tool, &frame.base_from_tool);
        distance_m > CATCH_UP * self.limits.speed_m_s * passed_s + JUMP_SLACK_M
            || angle_rad > CATCH_UP * self.limits.turn_rad_s * passed_s + JUMP_SLACK_RAD
    }

    /// Time between two frames: by the controller's clock, which knows best, unless it was set.
    fn elapsed_s(&self, before: &RobotFrame, now: &RobotFrame, arrivals_ns: i64) -> f64 {
        let arrivals_s = (arrivals_ns as f64 * 1e-9).max(0.0);
        let controller_s = now.device_ns.saturating_sub(before.device_ns) as f64 * 1e-9;
        let plausible =
            controller_s > 0.0 && (controller_s - arrivals_s).abs() < LATE_PERIODS * self.period_s;
        if plausible { controller_s } else { arrivals_s }
    }

    fn advance(
        &self,
        state: &mut GateState,
        frame: &RobotFrame,
        elapsed_s: f64,
        input: &Input,
    ) -> (Phase, Option<Reference>) {
        let robot = frame.base_from_tool;
        if input.wish == Wish::Silence {
            return self.silence(state, robot);
        }
        match state.phase {
            Phase::Waiting => self.begin(state, frame, input),
            Phase::Silent { why } => (Phase::Silent { why }, None),
            Phase::Holding { at, since_ns, why } => {
                let at = if frame.is_guided() { at } else { robot };
                (Phase::Holding { at, since_ns, why }, Some(Reference::rest(at)))
            }
            Phase::Riding { ride, .. } | Phase::Interrupted { ride } | Phase::Stopping { ride, .. } => {
                if let Some(why) = self.broken_off(state, &ride, frame) {
                    let holding = Phase::Holding { at: robot, since_ns: input.steady_ns, why };
                    return (holding, Some(Reference::rest(robot)));
                }
                self.travel(state, frame, elapsed_s, input)
            }
        }
    }

    /// Before the scan the robot is told to stay where it is.
    fn begin(&self, state: &mut GateState, frame: &RobotFrame, input: &Input) -> (Phase, Option<Reference>) {
        let robot = frame.base_from_tool;
        let stay = Some(Reference::rest(robot));
        if input.wish == Wish::Stop {
            return (Phase::Holding { at: robot, since_ns: input.steady_ns, why: Ending::Stopped }, stay);
        }
        if !frame.is_guided() {
            return (Phase::Waiting, stay);
        }
        let start = self.path.at(0.0).base_from_tool;
        let (distance_m, angle_rad) = apart(&start, &robot);
        if distance_m > self.limits.start_m || angle_rad > self.limits.start_rad {
            let why = Ending::StartTooFar { distance_m, angle_rad };
            return (Phase::Holding { at: robot, since_ns: input.steady_ns, why }, stay);
        }
        state.anchor = Anchor::between(&start, &robot);
        (Phase::Riding { ride: Ride::default(), ending: false, paused_for: 0 }, stay)
    }

    /// What leaves no time for a smooth stop.
    fn broken_off(&self, state: &GateState, ride: &Ride, frame: &RobotFrame) -> Option<Ending> {
        if !frame.is_guided() {
            return Some(Ending::LeftGuidance);
        }
        if frame.collided {
            return Some(Ending::Collision);
        }
        let reference = self.laid(state, ride).base_from_tool;
        let (distance_m, angle_rad) = apart(&reference, &frame.base_from_tool);
        let off = distance_m > self.limits.deviation_m || angle_rad > self.limits.deviation_rad;
        off.then_some(Ending::Deviation { distance_m, angle_rad })
    }

    fn travel(
        &self,
        state: &mut GateState,
        frame: &RobotFrame,
        elapsed_s: f64,
        input: &Input,
    ) -> (Phase, Option<Reference>) {
        let overload = frame.utilization_percent.filter(|u| *u > 100.0);
        let phase = match state.phase {
            Phase::Riding { ride, .. } if overload.is_some() => {
                let why = Ending::Overload { percent: overload.unwrap_or_default() };
                self.brake(ride, elapsed_s, why)
            }
            Phase::Riding { ride, .. } if input.wish == Wish::Stop => {
                self.brake(ride, elapsed_s, Ending::Stopped)
            }
            Phase::Riding { ride, ending, paused_for } => {
                let late = elapsed_s > LATE_PERIODS * self.period_s;
                state.pauses += u32::from(late);
                let paused_for = if late { PAUSE_FRAMES } else { paused_for.saturating_sub(1) };
                // A late frame must not make the reference leap: its time is lost, not made up for.
                let elapsed_s = if late { self.period_s } else { elapsed_s };
                self.ride_on(ride, elapsed_s, ending, paused_for)
            }
            Phase::Stopping { ride, why } => self.brake(ride, elapsed_s, why),
            other => other,
        };
        match phase {
            Phase::Riding { ride, ending: true, .. } if ride.rests() => {
                self.hold(state, &ride, Ending::Travelled, input)
            }
            Phase::Stopping { ride, why } if ride.rests() => self.hold(state, &ride, why, input),
            Phase::Riding { ride, .. } | Phase::Stopping { ride, .. } => {
                (phase, Some(self.laid(state, &ride)))
            }
            other => (other, None),
        }
    }

    fn brake(&self, ride: Ride, elapsed_s: f64, why: Ending) -> Phase {
        let elapsed_s = elapsed_s.min(LATE_PERIODS * self.period_s);
        Phase::Stopping { ride: ride.after(elapsed_s, self.path.ramp(), false), why }
    }

    /// Goes on as long as it could still stop before the path's end.
    fn ride_on(&self, ride: Ride, elapsed_s: f64, ending: bool, paused_for: u32) -> Phase {
        let ramp = self.path.ramp();
        let gone_on = ride.after(elapsed_s, ramp, true);
        let ending = ending || gone_on.path_s + gone_on.until_rest_s(ramp) > self.path.duration_s();
        let go = !ending && paused_for == 0;
        let ride = if go { gone_on } else { ride.after(elapsed_s, ramp, false) };
        Phase::Riding { ride, ending, paused_for }
    }

    fn hold(&self, state: &GateState, ride: &Ride, why: Ending, input: &Input) -> (Phase, Option<Reference>) {
        let at = self.laid(state, ride).base_from_tool;
        (Phase::Holding { at, since_ns: input.steady_ns, why }, Some(Reference::rest(at)))
    }

    fn laid(&self, state: &GateState, ride: &Ride) -> Reference {
        state.anchor.lay(self.path.along(ride))
    }
}

fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    ((a.translation.vector - b.translation.vector).norm(), a.rotation.angle_to(&b.rotation))
}
