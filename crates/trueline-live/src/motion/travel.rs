//! The gate while the robot is on the path: on, braking, or why that is broken off.

use super::checked_path::Reference;
use super::cycle_clock::ReceivedFrame;
use super::gate::{Gate, GateState, LATE_PERIODS, PAUSE_FRAMES, Step, apart, seconds};
use super::path_timing::PathState;
use super::phase::{EndReason, OperatorCommand, Phase};

impl Gate {
    /// A frame while the robot is on the path.
    pub(super) fn travel(
        &self,
        state: &mut GateState,
        before: &ReceivedFrame,
        received: &ReceivedFrame,
        command: OperatorCommand,
    ) -> Step {
        let on_path = match state.phase {
            Phase::Travelling { on_path, .. }
            | Phase::Interrupted { on_path }
            | Phase::Stopping { on_path, .. } => on_path,
            Phase::Waiting | Phase::Holding { .. } | Phase::Silent { .. } => return (state.phase, None),
        };
        if let Some(why) = self.broken_off(state, &on_path, received) {
            return self.hold(state, received.frame.base_from_tool, received, why);
        }
        let period_s = state.period_s().unwrap_or(0.0);
        let late = seconds(before.arrival_ns, received.arrival_ns) > LATE_PERIODS * period_s;
        let mut elapsed_s = state.cycle_clock.elapsed_s(before, received, period_s);
        if late {
            // Its time is lost, not made up for: the reference must not leap.
            elapsed_s = elapsed_s.min(period_s);
            state.cycle_clock.settle();
        }
        let elapsed_s = elapsed_s.min(state.budget.spare_s());
        let phase = self.travelled(state, received, elapsed_s, (late, command));
        match phase {
            Phase::Travelling { on_path, braking_for_end: true, .. } if on_path.rests() => {
                self.hold(state, self.laid(state, &on_path).base_from_tool, received, EndReason::Travelled)
            }
            Phase::Stopping { on_path, why } if on_path.rests() => {
                self.hold(state, self.laid(state, &on_path).base_from_tool, received, why)
            }
            Phase::Travelling { on_path, .. } | Phase::Stopping { on_path, .. } => {
                (phase, Some(self.laid(state, &on_path)))
            }
            other => (other, None),
        }
    }

    /// Reason that leaves no time for a smooth stop.
    pub(super) fn broken_off(
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

    fn travelled(
        &self,
        state: &mut GateState,
        received: &ReceivedFrame,
        elapsed_s: f64,
        (late, command): (bool, OperatorCommand),
    ) -> Phase {
        match state.phase {
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
        }
    }

    fn brake(&self, on_path: PathState, elapsed_s: f64, why: EndReason) -> Phase {
        Phase::Stopping { on_path: on_path.after(elapsed_s, self.path.ramp(), false), why }
    }

    /// Continues as long as it could still stop before the path's end.
    fn travel_on(&self, on_path: PathState, elapsed_s: f64, braking_for_end: bool, paused_for: u32) -> Phase {
        let ramp = self.path.ramp();
        let gone_on = on_path.after(elapsed_s, ramp, true);
        let braking_for_end =
            braking_for_end || gone_on.path_s + gone_on.until_rest_s(ramp) > self.path.duration_s();
        let go = !braking_for_end && paused_for == 0;
        let on_path = if go { gone_on } else { on_path.after(elapsed_s, ramp, false) };
        Phase::Travelling { on_path, braking_for_end, paused_for }
    }

    /// The path at its present place.
    pub(super) fn laid(&self, state: &GateState, on_path: &PathState) -> Reference {
        state.anchor.lay(self.path.along(on_path))
    }
}
