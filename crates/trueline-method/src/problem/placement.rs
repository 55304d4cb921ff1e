//! Pose of the sensor at an exposure.

use crate::input::observations::{Observation, Observations};
use crate::problem::parameters::Parameters;
use trueline_geometry::{Pose, Trajectory};
use trueline_model::Placement;

/// Pose of the sensor at the exposure of an observation. `None` outside the recording or in a gap.
#[must_use]
pub fn placement(
    observations: &Observations,
    observation: &Observation,
    at: &Parameters,
) -> Option<Placement> {
    let exposure_s = observation.stamp_s - at.time_offset_s;
    placement_at(&observations.robot.trajectory, exposure_s, &at.tool_from_camera)
}

/// The same on a path of the robot at an exposure, s.
#[must_use]
pub(crate) fn placement_at(
    trajectory: &Trajectory,
    exposure_s: f64,
    tool_from_camera: &Pose,
) -> Option<Placement> {
    Some(Placement::new(trajectory.segment_at(exposure_s)?, exposure_s, tool_from_camera))
}
