//! Information of the motion on the time offset, without the noise of the robot's rates.
//!
//! Rates are differences of noisy poses. Their noise has squares like a motion, and a robot that moves evenly would seem to show its time
//! offset. The rates before and after a sighting share the motion and not the noise, so their product does not contain it.

use super::joint::TargetProblem;
use super::pose_sighting::Sighting;
use super::robot_path::ToolState;
use super::unknowns::Unknowns;
use nalgebra::SVector;

/// How far before and after a sighting the rates are taken, s: further apart than poses that were smoothed together.
const APART_S: f64 = 0.05;

/// Information about the time offset that the sightings would have beside everything else being known, s⁻².
pub(super) fn time_information<S: Sighting>(problem: &TargetProblem<'_, S>, at: &Unknowns) -> f64 {
    let with_rates = |k: usize, shift_s: f64| {
        let tool = problem.tool(k, at.time_offset_s)?;
        let later = problem.tool(k, at.time_offset_s + shift_s)?;
        problem.whitened_time_derivative(k, &with_rates_of(&tool, &later), at)
    };
    shared((0..problem.used.len()).filter(|k| problem.used[*k]), with_rates)
}

/// A tool where one is, that moves as another does.
pub(crate) fn with_rates_of(tool: &ToolState, other: &ToolState) -> ToolState {
    let ToolState { body_rate, velocity, .. } = *other;
    ToolState { body_rate, velocity, ..*tool }
}

/// The sum over readings of what their whitened time derivatives share with the rates before and after them, s⁻².
pub(crate) fn shared<const N: usize>(
    readings: impl Iterator<Item = usize>,
    with_rates: impl Fn(usize, f64) -> Option<SVector<f64, N>>,
) -> f64 {
    readings.filter_map(|k| Some(with_rates(k, APART_S)?.dot(&with_rates(k, -APART_S)?))).sum()
}
