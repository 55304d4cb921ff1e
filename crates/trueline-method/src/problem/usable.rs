//! Selects the observations that can be placed on the robot's path during a whole solve.

use crate::input::observations::{Observation, Observations};
use std::ops::Range;

/// Squared residual of an observation that cannot be evaluated (outside the recording, in a gap, or with the line along the sheet), in squared
/// standard deviations: that of 1000 σ. A redescending loss has long saturated there, so a search gains nothing by pushing features off the
/// recording.
pub(crate) const UNUSABLE_SQUARED: f64 = 1e6;

/// Observations used in a solve.
#[derive(Clone, Debug)]
pub enum UsableObservations {
    /// A contiguous part of the list, without a copy.
    Part(Range<usize>),
    /// A selection, if the recording has gaps.
    Chosen(Vec<Observation>),
}

impl UsableObservations {
    /// The observations whose exposure is inside the robot's recording, and outside its gaps, for every time offset within `margin_s` of the given
    /// one. A solve that stays within the margin never loses or gains an observation.
    #[must_use]
    pub fn within(observations: &Observations, time_offset_s: f64, margin_s: f64) -> Self {
        let trajectory = &observations.robot.trajectory;
        if trajectory.is_unbroken() {
            let (first_s, last_s) = trajectory.span();
            let exposure_s = |o: &Observation| o.stamp_s - time_offset_s;
            let start = observations.list.partition_point(|o| exposure_s(o) - margin_s < first_s);
            let end = observations.list.partition_point(|o| exposure_s(o) + margin_s <= last_s);
            return Self::Part(start..end.max(start));
        }
        let inside = |o: &Observation| {
            let exposure_s = o.stamp_s - time_offset_s;
            let [first, last] = [exposure_s - margin_s, exposure_s + margin_s].map(|s| trajectory.bracket(s));
            first
                .zip(last)
                .is_some_and(|(first, last)| (first..=last).all(|k| trajectory.segment(k).is_some()))
        };
        let list = &observations.list;
        let start = list.iter().position(inside).unwrap_or(list.len());
        let end = start + list[start..].iter().position(|o| !inside(o)).unwrap_or(list.len() - start);
        let rest: Vec<Observation> = list[end..].iter().filter(|o| inside(o)).copied().collect();
        if rest.is_empty() {
            return Self::Part(start..end);
        }
        Self::Chosen([&list[start..end], &rest].concat())
    }

    /// The observations, by rising stamp.
    #[must_use]
    pub fn of<'a>(&'a self, observations: &'a Observations) -> &'a [Observation] {
        match self {
            Self::Part(range) => &observations.list[range.clone()],
            Self::Chosen(list) => list,
        }
    }

    /// Their number.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Part(range) => range.len(),
            Self::Chosen(list) => list.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::UsableObservations;
    use crate::config::Config;
    use crate::input::observations::{observe, origin_ns};
    use crate::input::timestamps::Sampling;
    use trueline_sim::{Preset, simulate};

    /// On an unbroken path no single look-up is needed. Against a look-up of each observation.
    #[test]
    fn on_an_unbroken_path_those_are_usable_that_have_poses_before_and_after() {
        let recording = simulate(&Preset::Quick.scenario(), 2).unwrap();
        let sampling = Sampling::of(&recording, origin_ns(&recording));
        let observed = observe(&recording, &sampling, &Config::default()).unwrap();
        let path = &observed.robot.trajectory;
        assert!(path.is_unbroken());
        for offset_s in [0.0, 0.5, -0.5, 5.0, -5.0, 1e3, -1e3] {
            for margin_s in [1e-5, 0.05] {
                let has_pose = |time_s: f64| path.pose_at(time_s).is_some();
                let plain = observed.list.iter().filter(|o| {
                    let exposure_s = o.stamp_s - offset_s;
                    has_pose(exposure_s - margin_s) && has_pose(exposure_s + margin_s)
                });
                let rows: Vec<u32> = plain.map(|o| o.row).collect();
                let found = UsableObservations::within(&observed, offset_s, margin_s);
                assert_eq!(found.of(&observed).iter().map(|o| o.row).collect::<Vec<_>>(), rows);
                assert!(matches!(found, UsableObservations::Part(_)));
            }
        }
    }
}
