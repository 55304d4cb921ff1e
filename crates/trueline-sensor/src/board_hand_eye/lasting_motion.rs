//! Information of the motion on the time offset, without the noise of the robot's rates.
//!
//! Rates are differences of noisy poses. Their noise has squares like a motion, and a robot that moves evenly would seem to show its time
//! offset. The rates before and after a sighting share the motion and not the noise, so their product does not contain it.

use super::joint::TargetProblem;
use super::pose_sighting::Sighting;
use super::robot_path::ToolState;
use super::unknowns::Unknowns;

/// How far before and after a sighting the rates are taken, s: further apart than poses that were smoothed together.
const APART_S: f64 = 0.05;

/// Information about the time offset that the sightings would have beside everything else being known, s⁻².
pub(super) fn time_information<S: Sighting>(problem: &TargetProblem<'_, S>, at: &Unknowns) -> f64 {
    let of = |k: usize| {
        let tool = problem.tool(k, at.time_offset_s)?;
        let with_rates = |shift_s: f64| {
            let ToolState { body_rate, velocity, .. } = problem.tool(k, at.time_offset_s + shift_s)?;
            problem.whitened_time_derivative(k, &ToolState { body_rate, velocity, ..tool }, at)
        };
        Some(with_rates(APART_S)?.dot(&with_rates(-APART_S)?))
    };
    (0..problem.used.len()).filter(|k| problem.used[*k]).filter_map(of).sum()
}
