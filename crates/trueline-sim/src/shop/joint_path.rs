//! The joints over time: a path of the tool, solved for the arm that the controller has.

use trueline_geometry::Pose;
use trueline_geometry::arm::inverse::angles_for;
use trueline_geometry::arm::six_axes::{AXES, Angles, Arm};

/// Time between two solutions, s; the joints are cubic between them.
const STEP_S: f64 = 0.008;
/// The wrist stays this far from its singularity, rad.
const WRIST_RAD: f64 = 0.15;
/// Part of each joint's range that a path may use.
const OF_RANGE: f64 = 0.97;

/// Joint angles over time, rad.
pub(crate) struct JointPath {
    start_s: f64,
    angles: Vec<Angles>,
}

impl JointPath {
    /// The joints along a path of the flange between two times, s, near `first` at the beginning; `None` where the arm cannot follow.
    pub(crate) fn along(
        arm: &Arm,
        base_from_flange: &dyn Fn(f64) -> Pose,
        [start_s, end_s]: [f64; 2],
        first: &Angles,
    ) -> Option<Self> {
        let count = ((end_s - start_s) / STEP_S).ceil() as usize + 4;
        // One step more on both sides, for the slopes.
        let start_s = start_s - STEP_S;
        let mut angles: Vec<Angles> = Vec::with_capacity(count);
        for k in 0..count {
            let near = match *angles.as_slice() {
                [.., a, b] => std::array::from_fn(|k| 2.0 * b[k] - a[k]),
                [a] => a,
                [] => *first,
            };
            let found = angles_for(arm, &base_from_flange(start_s + k as f64 * STEP_S), &near)?;
            let in_range = arm.used_of_range(&found).iter().all(|used| *used <= OF_RANGE);
            // Angles are checked now and then: a path does not jump over a singularity within a tenth of a second.
            let wrist_is_free = k % 12 != 0 || arm.state(&found).wrist_rad() > WRIST_RAD;
            if !(in_range && wrist_is_free) {
                return None;
            }
            angles.push(found);
        }
        Some(Self { start_s, angles })
    }

    /// The joints in the middle of the path.
    pub(crate) fn middle(&self) -> Angles {
        self.angles[self.angles.len() / 2]
    }

    /// The joints at a time since the start of the scan, s: a cubic with the slopes of central differences. At rest beyond the ends.
    pub(crate) fn at(&self, time_s: f64) -> Angles {
        let last = self.angles.len() - 3;
        let position = ((time_s - self.start_s) / STEP_S).clamp(1.0, last as f64 + 1.0);
        let index = (position.floor() as usize).min(last);
        let u = position - index as f64;
        let [before, from, to, after] = [0, 1, 2, 3].map(|k| &self.angles[index - 1 + k]);
        std::array::from_fn::<f64, AXES, _>(|k| {
            let (slope, next) = (0.5 * (to[k] - before[k]), 0.5 * (after[k] - from[k]));
            let rise = to[k] - from[k];
            from[k] + u * (slope + u * (3.0 * rise - 2.0 * slope - next + u * (slope + next - 2.0 * rise)))
        })
    }
}
