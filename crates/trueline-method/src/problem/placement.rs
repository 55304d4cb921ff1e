//! Where the sensor was when an observation was exposed.

use crate::input::observations::{Observation, Observations};
use crate::problem::parameters::Parameters;
use trueline_geometry::Trajectory;
use trueline_model::Placement;

/// Where the sensor was at the exposure of an observation; `None` outside the recording or in a gap.
#[must_use]
pub fn placement(
    observations: &Observations,
    observation: &Observation,
    at: &Parameters,
    hint: &mut usize,
) -> Option<Placement> {
    placement_on(&observations.robot.trajectory, observation, at, hint)
}

/// The same on another path of the robot.
#[must_use]
pub fn placement_on(
    trajectory: &Trajectory,
    observation: &Observation,
    at: &Parameters,
    hint: &mut usize,
) -> Option<Placement> {
    let exposure_s = observation.stamp_s - at.time_offset_s;
    let index = trajectory.bracket(exposure_s, *hint)?;
    *hint = index;
    let segment = trajectory.segment(index)?;
    Some(Placement::new(segment, exposure_s, &at.tool_from_camera))
}
