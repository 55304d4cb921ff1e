//! Where the sensor was when an observation was exposed.

use crate::input::observations::{Observation, Observations};
use crate::problem::parameters::Parameters;
use trueline_geometry::{Pose, Trajectory};
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
pub(crate) fn placement_on(
    trajectory: &Trajectory,
    observation: &Observation,
    at: &Parameters,
    hint: &mut usize,
) -> Option<Placement> {
    placement_then(trajectory, observation.stamp_s - at.time_offset_s, &at.tool_from_camera, hint)
}

/// The same at an exposure, s.
#[must_use]
pub(crate) fn placement_then(
    trajectory: &Trajectory,
    exposure_s: f64,
    tool_from_camera: &Pose,
    hint: &mut usize,
) -> Option<Placement> {
    *hint = trajectory.bracket(exposure_s, *hint)?;
    Some(Placement::new(trajectory.segment(*hint)?, exposure_s, tool_from_camera))
}
