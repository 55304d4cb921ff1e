//! Which observations can be placed on the robot's path, whatever a solve does.

use crate::input::observations::{Observation, Observations};
use std::ops::Range;

/// The part of an observation that cannot be evaluated (outside the recording, in a gap, or the line
/// along the sheet), in squared standard deviations: as bad as a residual of 1000 σ. A redescending loss
/// has long saturated there, so that a search gains nothing by pushing features off the recording.
pub(crate) const UNUSABLE_SQUARED: f64 = 1e6;

/// Observations that take part in a solve.
#[derive(Clone, Debug)]
pub enum UsableObservations {
    /// An unbroken part of the list: nothing is copied.
    Part(Range<usize>),
    /// What a recording with gaps leaves.
    Chosen(Vec<Observation>),
}

impl UsableObservations {
    /// The observations whose exposure stays inside the robot's recording, and out of its gaps, for every
    /// time offset within `margin_s` of the one given: a solve that moves no further never loses or gains one.
    #[must_use]
    pub fn within(observations: &Observations, time_offset_s: f64, margin_s: f64) -> Self {
        let trajectory = &observations.robot.trajectory;
        let mut hints = [0; 2];
        let mut inside = |o: &Observation| {
            let exposure_s = o.stamp_s - time_offset_s;
            let mut brackets = [0; 2];
            for ((end_s, hint), bracket) in
                [exposure_s - margin_s, exposure_s + margin_s].into_iter().zip(&mut hints).zip(&mut brackets)
            {
                let Some(index) = trajectory.bracket(end_s, *hint) else {
                    return false;
                };
                (*hint, *bracket) = (index, index);
            }
            (brackets[0]..=brackets[1]).all(|index| trajectory.segment(index).is_some())
        };
        let list = &observations.list;
        let start = list.iter().position(&mut inside).unwrap_or(list.len());
        let end = start + list[start..].iter().position(|o| !inside(o)).unwrap_or(list.len() - start);
        let rest: Vec<Observation> = list[end..].iter().filter(|o| inside(o)).copied().collect();
        if rest.is_empty() {
            return Self::Part(start..end);
        }
        Self::Chosen([&list[start..end], &rest].concat())
    }

    /// The observations themselves, by rising stamp.
    #[must_use]
    pub fn of<'a>(&'a self, observations: &'a Observations) -> &'a [Observation] {
        match self {
            Self::Part(range) => &observations.list[range.clone()],
            Self::Chosen(list) => list,
        }
    }

    /// How many there are.
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
