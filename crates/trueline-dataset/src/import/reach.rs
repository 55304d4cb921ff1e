//! Whether positions are as far from the base as a robot reaches: others were read in the wrong unit.

use crate::log_problem::LogProblem;
use crate::recording::RobotSample;

/// No robot reaches further, on a gantry neither, m.
const FURTHEST_M: f64 = 100.0;
/// No tool stays so near to the origin of its base all the while, m.
const NEAREST_M: f64 = 0.01;
/// A log of fewer poses is no scan; it may be of any place.
const LEAST_POSES: usize = 20;

/// Refuses positions that no robot has.
///
/// # Errors
/// The furthest position, where it is beyond every robot's reach, or within a robot's foot.
pub(super) fn check(robot: &[RobotSample]) -> Result<(), LogProblem> {
    let distance = |sample: &RobotSample| sample.base_from_tool.translation.vector.norm();
    let furthest_m = robot.iter().map(distance).fold(0.0, f64::max);
    let is_near = robot.len() >= LEAST_POSES && furthest_m < NEAREST_M;
    // A robot that is not measured at all says zero.
    if furthest_m == 0.0 || !is_near && furthest_m <= FURTHEST_M {
        Ok(())
    } else {
        Err(LogProblem::Reach { furthest_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueline_geometry::Pose;

    fn at(x_m: f64) -> [RobotSample; LEAST_POSES] {
        let base_from_tool = Pose::translation(x_m, 0.0, 0.0);
        [RobotSample { stamp_ns: 0, device_ns: None, base_from_tool }; LEAST_POSES]
    }

    #[test]
    fn metres_for_millimetres_are_refused_both_ways() {
        assert!(check(&at(1.25)).is_ok());
        assert!(matches!(check(&at(1250.0)), Err(LogProblem::Reach { .. })));
        assert!(matches!(check(&at(1.25e-3)), Err(LogProblem::Reach { .. })));
    }
}
