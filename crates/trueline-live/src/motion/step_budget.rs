//! Largest distance of a reference from the one before: the limits times the time passed, independent of reports.
//!
//! Time is saved up as it passes and spent by every step. Between two references at any distance in time there is never
//! more than limits × (time between them + saved time).

use super::limits::MotionLimits;
use trueline_geometry::{Pose, so3};

/// Time that came late and may be made up for, s: three periods of a controller that speaks every 4 ms.
pub(super) const MADE_UP_S: f64 = 0.012;
/// Allowed excess of a step's time over the path's time at its limits, s: rounding, and h³|ω × α|/12, the angle between the
/// axis of a step's rotation and that of ω (4 ms, 1 rad/s, 5 rad/s²: 3e-8 rad, of a tool of 0.5 m 5e-8 s). Of 250 mm/s it is
/// 25 nm.
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
        // Written so that NaN is refused.
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

    /// A step was made; at most a period and the delay stay saved.
    pub(super) fn spend(&mut self, from: Option<&Pose>, to: &Pose, limits: &MotionLimits, period_s: f64) {
        let took_s = from.map_or(0.0, |from| takes_s(from, to, limits));
        self.spare_s = (self.spare_s - took_s).clamp(0.0, MADE_UP_S + period_s);
    }
}

fn takes_s(from: &Pose, to: &Pose, limits: &MotionLimits) -> f64 {
    let turn = so3::log(&(to.rotation * from.rotation.inverse()));
    limits.least_time_s(&(to.translation.vector - from.translation.vector), &turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitVector3, Vector3};

    /// 0.1 m/s, 0.5 rad/s; 0.4 m about the origin.
    fn limits() -> MotionLimits {
        MotionLimits {
            box_m: [Vector3::repeat(-1.0), Vector3::repeat(1.0)],
            tool_axis: UnitVector3::new_normalize(Vector3::z()),
            cone_rad: 3.0,
            reach_m: 0.4,
            speed_m_s: 0.1,
            acceleration_m_s2: 1.0,
            jerk_m_s3: 10.0,
            turn_rad_s: 0.5,
            turn_acceleration_rad_s2: 5.0,
            deviation_m: 0.01,
            deviation_rad: 0.1,
            start_m: 0.01,
            start_rad: 0.1,
        }
    }

    fn at(x_m: f64, turn_rad: f64) -> Pose {
        Pose::new(Vector3::new(x_m, 0.2, 0.3), Vector3::new(0.0, 0.0, turn_rad))
    }

    fn after(passed_ns: i64) -> StepBudget {
        let mut budget = StepBudget::default();
        budget.pass(1_000);
        assert_eq!(budget.spare_s(), 0.0, "nothing has passed before the first look at the clock");
        budget.pass(1_000 + passed_ns);
        budget
    }

    #[test]
    fn time_is_saved_up_as_it_passes_and_a_clock_that_goes_back_gives_none() {
        let mut budget = after(4_000_000);
        assert!((budget.spare_s() - 0.004).abs() < 1e-15);
        budget.pass(3_000_000);
        assert!((budget.spare_s() - 0.004).abs() < 1e-15, "a millisecond back");
        budget.pass(4_001_000);
        assert!((budget.spare_s() - 0.004).abs() < 1e-15, "and the same millisecond again");
        budget.pass(5_001_000);
        assert!((budget.spare_s() - 0.005).abs() < 1e-15);
    }

    #[test]
    fn a_step_takes_its_way_over_its_speed_and_the_rest_stays() {
        let (from, l) = (at(0.0, 0.0), limits());
        let mut budget = after(10_000_000);
        // 1 mm at 0.1 m/s are 10 ms.
        assert!(
            budget.has_time(&from, &at(0.001, 0.0), &l) && !budget.has_time(&from, &at(0.001_001, 0.0), &l)
        );
        // 5 mrad at 0.5 rad/s are 10 ms; their 2 mm at the reach of 0.4 m at 250 mm/s are 8.
        assert!(
            budget.has_time(&from, &at(0.0, 0.005), &l) && !budget.has_time(&from, &at(0.0, 0.005_005), &l)
        );
        assert!(!budget.has_time(&from, &at(f64::NAN, 0.0), &l));
        budget.spend(Some(&from), &at(0.0006, 0.0), &l, 0.004);
        assert!((budget.spare_s() - 0.004).abs() < 1e-12, "6 of 10 ms are spent");
        budget.spend(Some(&from), &at(0.0006, 0.0), &l, 0.004);
        assert_eq!(budget.spare_s(), 0.0, "no debt is kept: it was refused, or is rounding");
    }

    #[test]
    fn no_more_than_a_period_and_what_came_late_is_saved_up() {
        let (here, l) = (at(0.0, 0.0), limits());
        let mut budget = after(500_000_000);
        assert!((budget.spare_s() - 0.5).abs() < 1e-12, "while nothing is sent");
        budget.spend(Some(&here), &here, &l, 0.004);
        assert!((budget.spare_s() - 0.016).abs() < 1e-15, "12 ms and a period of 4 ms");
        let mut first = after(500_000_000);
        first.spend(None, &here, &l, 0.0);
        assert!((first.spare_s() - 0.012).abs() < 1e-15);
    }

    #[test]
    fn what_is_too_far_is_gone_toward_for_as_long_as_there_is_time() {
        let (from, to, l) = (at(0.1, 0.2), at(0.104, 0.21), limits());
        let budget = after(10_000_000);
        // 4 mm take 40 ms; a quarter of this has passed.
        let reached = budget.toward(&from, &to, &l);
        assert!((reached.translation.vector - at(0.101, 0.0).translation.vector).norm() < 1e-12);
        assert!(reached.rotation.angle_to(&at(0.0, 0.2025).rotation) < 1e-12);
        let near = at(0.1005, 0.2);
        assert_eq!(budget.toward(&from, &near, &l), near, "5 ms: all the way");
    }
}
