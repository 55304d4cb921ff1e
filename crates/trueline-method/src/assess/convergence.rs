//! Convergence of the solver, measured on the features that are inliers at the end.

use crate::assess::residuals::FeatureResidual;
use crate::input::observations::{Observation, Observations};
use crate::problem::parameters::Parameters;
use crate::solve::iteration_record::IterationRecord;
use std::borrow::Cow;
use std::collections::HashSet;
use trueline_lsq::Iteration;

/// With more observations than this …
const MOST: usize = 12_000;
/// … a subset of about this number of frames is used. Its RMS equals that of all to 1 %.
const FOLLOWED: usize = 6_000;

/// The solver's steps with the distances of the final inliers only, because outliers would hide the convergence.
#[must_use]
pub(crate) fn steps(
    steps: &[Iteration<Parameters>],
    observations: &Observations,
    features: &[FeatureResidual],
) -> Vec<IterationRecord> {
    let wild: HashSet<u32> = features.iter().filter(|f| f.is_outlier()).map(|f| f.row).collect();
    let all = observations.list.len();
    let every = if all > MOST { (all / FOLLOWED) as u32 } else { 1 };
    let is_followed = |o: &&Observation| o.frame.is_multiple_of(every) && !wild.contains(&o.row);
    let list: Cow<'_, [Observation]> = if wild.is_empty() && every == 1 {
        Cow::Borrowed(&observations.list)
    } else {
        observations.list.iter().filter(is_followed).copied().collect()
    };
    steps.iter().map(|step| IterationRecord::of(observations, &list, step)).collect()
}
