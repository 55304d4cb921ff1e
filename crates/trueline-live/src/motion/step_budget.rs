//! How far a reference may be from the one before: what the limits allow in the time that has passed, whatever is reported.
//!
//! Time is saved up as it passes and spent by every step. Between two references that were sent, however far apart, lies
//! never more than limits × (time between them + what may be saved up).

use super::limits::MotionLimits;
use trueline_geometry::{Pose, so3};

/// Time that came late and may be made up for, s: three periods of a controller that speaks every 4 ms.
pub(super) const MADE_UP_S: f64 = 0.012;
/// What a step may take longer, s, than the time in which the path goes it at its limits: rounding, and h³|ω × α|/12 by which the
/// axis of a step's turn is off that of ω (4 ms, 1 rad/s, 5 rad/s²: 3e-8 rad, of a tool of 0.5 m 5e-8 s). Of 250 mm/s it is 25 nm.
const ROUNDING_S: f64 = 1e-7;

/// Time saved up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct StepBudget {
    spare_s: f64,
    now_ns: Option<i64>,
}

impl StepBudget {
    /// Time passes, on the steady clock, ns.
    pub(super) fn pass(&mut self, now_ns: i64) {
        let passed_ns = self.now_ns.map_or(0, |before_ns| now_ns.saturating_sub(before_ns).max(0));
        self.spare_s += passed_ns as f64 * 1e-9;
        self.now_ns = Some(self.now_ns.map_or(now_ns, |before_ns| before_ns.max(now_ns)));
    }

    /// Time that a step may take now, s.
    pub(super) fn spare_s(&self) -> f64 {
        self.spare_s
    }

    /// Whether there is time for a step.
    pub(super) fn has_time(&self, from: &Pose, to: &Pose, limits: &MotionLimits) -> bool {
        // Written so that what is no number is refused.
        takes_s(from, to, limits) <= self.spare_s + ROUNDING_S
    }

    /// The pose on the way that can be reached now.
    pub(super) fn toward(&self, from: &Pose, to: &Pose, limits: &MotionLimits) -> Pose {
        let takes_s = takes_s(from, to, limits);
        if takes_s <= self.spare_s {
            return *to;
        }
        let share = self.spare_s / takes_s;
        let turn = so3::log(&(to.rotation * from.rotation.inverse()));
        let position = from.translation.vector.lerp(&to.translation.vector, share);
        Pose::from_parts(position.into(), so3::exp(&(turn * share)) * from.rotation)
    }

    /// A step was made; a period and what came late stay saved up at most.
    pub(super) fn spend(&mut self, from: Option<&Pose>, to: &Pose, limits: &MotionLimits, period_s: f64) {
        let took_s = from.map_or(0.0, |from| takes_s(from, to, limits));
        self.spare_s = (self.spare_s - took_s).clamp(0.0, MADE_UP_S + period_s);
    }
}

fn takes_s(from: &Pose, to: &Pose, limits: &MotionLimits) -> f64 {
    let turn = so3::log(&(to.rotation * from.rotation.inverse()));
    limits.least_time_s(&(to.translation.vector - from.translation.vector), &turn)
}
