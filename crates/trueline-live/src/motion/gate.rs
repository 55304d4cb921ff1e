//! The gate before every command: a function of its state and of what was heard, nothing else.
//!
//! What leaves it is one of four: the path, laid at where the robot was when it began, at a rate that starts and stops
//! smoothly; rest where that ended; rest where the robot is; or nothing. Every one is inside the limits, whatever is heard,
//! and after a moving reference the last one is always rest. Speed, acceleration and jerk keep their limits as long as the
//! ride goes on or stops smoothly; where something is wrong, or the robot is silent, rest is asked for at once, and the
//! controller's own filters and limits brake.

use super::anchor::Anchor;
use super::checked_path::{CheckedPath, Reference};
use super::limits::MotionLimits;
use super::phase::{Ending, Phase, Wish};
use super::rhythm::{HeardFrame, Rhythm};
use super::ride::Ride;
use nalgebra::Vector3;
use trueline_geometry::Pose;

/// What was heard, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    /// The newest frame; `None` if none came.
    pub heard: Option<HeardFrame>,
    /// Now, on the steady clock, ns.
    pub now_ns: i64,
    /// What the operator wants.
    pub wish: Wish,
}

/// The gate's memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GateState {
    /// What it is about.
    pub phase: Phase,
    /// The last frame that was believed.
    heard: Option<HeardFrame>,
    rhythm: Rhythm,
    anchor: Anchor,
    /// What was sent last.
    sent: Option<Reference>,
    /// Holds of the ride because frames came late or not at all.
    pub pauses: u32,
    /// Frames that were not believed: the robot cannot have moved so far.
    pub jumps: u32,
}

impl GateState {
    /// Time between the robot's messages, s, once it is known.
    #[must_use]
    pub fn period_s(&self) -> Option<f64> {
        self.rhythm.period_s()
    }

    /// What was sent last.
    #[must_use]
    pub fn last_sent(&self) -> Option<Reference> {
        self.sent
    }

    /// Whether the controller said last that the robot is near its reference.
    #[must_use]
    pub fn was_converged(&self) -> bool {
        self.heard.is_some_and(|heard| heard.frame.converged)
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
/// Frames in time before a ride goes on.
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
        let fresh = |heard: &HeardFrame| (input.now_ns - heard.arrival_ns) as f64 * 1e-9 <= too_old_s;
        let (phase, wanted) = match input.heard.filter(fresh) {
            Some(heard) => self.with_frame(&mut state, heard, input.wish),
            None => self.without_frame(&mut state, input.now_ns, input.wish),
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
            _ => Phase::Holding { at, since_ns: now_ns, why: Ending::OutsideLimits },
        };
        Some(Reference::rest(at))
    }

    fn silence_s(&self, state: &GateState) -> f64 {
        state.period_s().map_or(SILENT_AT_FIRST_S, |period_s| SILENT_PERIODS * period_s)
    }

    /// Without a frame there is nothing to answer; but silence is noticed, and the operator is heard.
    fn without_frame(&self, state: &mut GateState, now_ns: i64, wish: Wish) -> Step {
        if wish == Wish::Silence || (wish == Wish::Stop && state.phase == Phase::Waiting) {
            return self.silence(state);
        }
        let Some(heard) = state.heard else { return (state.phase, None) };
        let silent_s = (now_ns - heard.arrival_ns) as f64 * 1e-9;
        let limit_s = match state.phase {
            Phase::Interrupted { .. } => self.timeout_s,
            _ => self.silence_s(state),
        };
        if silent_s > limit_s { self.fall_silent(state, silent_s) } else { (state.phase, None) }
    }

    fn with_frame(&self, state: &mut GateState, heard: HeardFrame, wish: Wish) -> Step {
        let robot = heard.frame.base_from_tool;
        if heard.is_first && !matches!(state.phase, Phase::Waiting | Phase::Silent { .. }) {
            state.heard = Some(heard);
            return hold(robot, &heard, self.ended(state).unwrap_or(Ending::Restarted));
        }
        if let Phase::Interrupted { ride } = state.phase {
            return self.take_up(state, ride, heard, wish);
        }
        let Some(before) = state.heard.replace(heard) else {
            state.rhythm = Rhythm::default();
            return (state.phase, None);
        };
        let silent_s = (heard.arrival_ns - before.arrival_ns) as f64 * 1e-9;
        if silent_s > self.silence_s(state) {
            state.heard = Some(before);
            return self.fall_silent(state, silent_s);
        }
        if self.has_jumped(state, &before, &heard) {
            state.heard = Some(before);
            state.jumps += 1;
            return (state.phase, None);
        }
        state.rhythm.learn(&heard);
        self.advance(state, &before, &heard, wish)
    }

    /// Whoever was being led gets one last word: rest at the last reference.
    fn fall_silent(&self, state: &mut GateState, silent_s: f64) -> Step {
        let why = self.ended(state).unwrap_or(Ending::RobotSilent { silent_s });
        let rest = |ride: &Ride| Some(Reference::rest(self.laid(state, ride).base_from_tool));
        match state.phase {
            Phase::Riding { ride, .. } => {
                let ride = Ride { asked: 0.0, rate: 0.0, ..ride };
                (Phase::Interrupted { ride }, rest(&ride))
            }
            Phase::Stopping { ride, .. } => (Phase::Silent { why }, rest(&ride)),
            Phase::Holding { at, .. } => (Phase::Silent { why }, Some(Reference::rest(at))),
            Phase::Interrupted { .. } | Phase::Silent { .. } => (Phase::Silent { why }, None),
            Phase::Waiting => {
                // What comes later begins anew.
                (state.heard, state.rhythm) = (None, Rhythm::default());
                (Phase::Waiting, None)
            }
        }
    }

    /// Goes on after an interruption: from rest, after some frames in time, if it is the same session of a controller that
    /// still follows, and the robot is where it was left.
    fn take_up(&self, state: &mut GateState, ride: Ride, heard: HeardFrame, wish: Wish) -> Step {
        let Some(before) = state.heard.replace(heard) else { return self.silence(state) };
        let arrivals_s = (heard.arrival_ns - before.arrival_ns) as f64 * 1e-9;
        let controller_s = heard.frame.device_ns.saturating_sub(before.frame.device_ns) as f64 * 1e-9;
        let continues = (controller_s - arrivals_s).abs() < self.silence_s(state);
        if arrivals_s > self.timeout_s || !continues {
            return self.fall_silent(state, arrivals_s);
        }
        state.pauses += 1;
        state.rhythm.settle();
        if wish == Wish::Silence {
            return self.silence(state);
        }
        let broken_off = self.broken_off(state, &ride, &heard);
        match broken_off.or((wish == Wish::Stop).then_some(Ending::Stopped)) {
            Some(why) => hold(heard.frame.base_from_tool, &heard, why),
            None => {
                let rest = Reference::rest(self.laid(state, &ride).base_from_tool);
                (Phase::Riding { ride, ending: false, paused_for: PAUSE_FRAMES }, Some(rest))
            }
        }
    }

    /// One last word of rest, if the last one was not.
    fn silence(&self, state: &GateState) -> Step {
        let why = self.ended(state).unwrap_or(Ending::Stopped);
        let moving = state.sent.filter(|sent| !sent.is_rest());
        (Phase::Silent { why }, moving.map(|sent| Reference::rest(sent.base_from_tool)))
    }

    /// Why it has ended, if it has.
    fn ended(&self, state: &GateState) -> Option<Ending> {
        match state.phase {
            Phase::Stopping { why, .. } | Phase::Holding { why, .. } | Phase::Silent { why } => Some(why),
            Phase::Waiting | Phase::Riding { .. } | Phase::Interrupted { .. } => None,
        }
    }

    fn has_jumped(&self, state: &GateState, before: &HeardFrame, now: &HeardFrame) -> bool {
        let passed_s = (now.arrival_ns - before.arrival_ns) as f64 * 1e-9;
        let passed_s = passed_s.max(state.period_s().unwrap_or(0.0));
        let (distance_m, angle_rad) = apart(&before.frame.base_from_tool, &now.frame.base_from_tool);
        // Written so that what is no number is a jump.
        let near = distance_m <= CATCH_UP * self.limits.speed_m_s * passed_s + JUMP_SLACK_M
            && angle_rad <= CATCH_UP * self.limits.turn_rad_s * passed_s + JUMP_SLACK_RAD;
        !near
    }

    fn advance(&self, state: &mut GateState, before: &HeardFrame, heard: &HeardFrame, wish: Wish) -> Step {
        let robot = heard.frame.base_from_tool;
        if wish == Wish::Silence {
            return self.silence(state);
        }
        match state.phase {
            Phase::Waiting => self.begin(state, heard, wish),
            Phase::Silent { why } => (Phase::Silent { why }, None),
            Phase::Holding { at, since_ns, why } => {
                let at = if heard.frame.is_guided() { at } else { robot };
                (Phase::Holding { at, since_ns, why }, Some(Reference::rest(at)))
            }
            Phase::Riding { ride, .. } | Phase::Interrupted { ride } | Phase::Stopping { ride, .. } => {
                if let Some(why) = self.broken_off(state, &ride, heard) {
                    return hold(robot, heard, why);
                }
                let period_s = state.period_s().unwrap_or(0.0);
                let arrivals_s = (heard.arrival_ns - before.arrival_ns) as f64 * 1e-9;
                let late = arrivals_s > LATE_PERIODS * period_s;
                let mut elapsed_s = state.rhythm.elapsed_s(before, heard, period_s);
                if late {
                    // Its time is lost, not made up for: the reference must not leap.
                    elapsed_s = elapsed_s.min(period_s);
                    state.rhythm.settle();
                }
                self.travel(state, heard, elapsed_s, (late, wish))
            }
        }
    }

    /// Before the scan the robot is told to stay where it is.
    fn begin(&self, state: &mut GateState, heard: &HeardFrame, wish: Wish) -> Step {
        let robot = heard.frame.base_from_tool;
        if wish == Wish::Stop {
            return hold(robot, heard, Ending::Stopped);
        }
        if !heard.frame.is_guided() || state.period_s().is_none() {
            return (Phase::Waiting, Some(Reference::rest(robot)));
        }
        let start = self.path.at(0.0).base_from_tool;
        let (distance_m, angle_rad) = apart(&start, &robot);
        if distance_m > self.limits.start_m || angle_rad > self.limits.start_rad {
            return hold(robot, heard, Ending::StartTooFar { distance_m, angle_rad });
        }
        state.anchor = Anchor::between(&start, &robot);
        state.rhythm.settle();
        let riding = Phase::Riding { ride: Ride::default(), ending: false, paused_for: 0 };
        (riding, Some(Reference::rest(robot)))
    }

    /// What leaves no time for a smooth stop.
    fn broken_off(&self, state: &GateState, ride: &Ride, heard: &HeardFrame) -> Option<Ending> {
        if !heard.frame.is_guided() {
            return Some(Ending::LeftGuidance);
        }
        if heard.frame.collided {
            return Some(Ending::Collision);
        }
        let reference = self.laid(state, ride).base_from_tool;
        let (distance_m, angle_rad) = apart(&reference, &heard.frame.base_from_tool);
        let near = distance_m <= self.limits.deviation_m && angle_rad <= self.limits.deviation_rad;
        (!near).then_some(Ending::Deviation { distance_m, angle_rad })
    }

    fn travel(
        &self,
        state: &mut GateState,
        heard: &HeardFrame,
        elapsed_s: f64,
        (late, wish): (bool, Wish),
    ) -> Step {
        let phase = match state.phase {
            Phase::Riding { ride, ending, paused_for } => {
                if let Some(percent) = heard.frame.utilization_percent.filter(|u| *u > 100.0) {
                    self.brake(ride, elapsed_s, Ending::Overload { percent })
                } else if wish == Wish::Stop {
                    self.brake(ride, elapsed_s, Ending::Stopped)
                } else {
                    state.pauses += u32::from(late);
                    let paused_for = if late { PAUSE_FRAMES } else { paused_for.saturating_sub(1) };
                    self.ride_on(ride, elapsed_s, ending, paused_for)
                }
            }
            Phase::Stopping { ride, why } => self.brake(ride, elapsed_s, why),
            other => other,
        };
        match phase {
            Phase::Riding { ride, ending: true, .. } if ride.rests() => {
                hold(self.laid(state, &ride).base_from_tool, heard, Ending::Travelled)
            }
            Phase::Stopping { ride, why } if ride.rests() => {
                hold(self.laid(state, &ride).base_from_tool, heard, why)
            }
            Phase::Riding { ride, .. } | Phase::Stopping { ride, .. } => {
                (phase, Some(self.laid(state, &ride)))
            }
            other => (other, None),
        }
    }

    fn brake(&self, ride: Ride, elapsed_s: f64, why: Ending) -> Phase {
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

    fn laid(&self, state: &GateState, ride: &Ride) -> Reference {
        state.anchor.lay(self.path.along(ride))
    }
}

fn hold(at: Pose, heard: &HeardFrame, why: Ending) -> Step {
    (Phase::Holding { at, since_ns: heard.arrival_ns, why }, Some(Reference::rest(at)))
}

fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    let distance: Vector3<f64> = a.translation.vector - b.translation.vector;
    (distance.norm(), a.rotation.angle_to(&b.rotation))
}
