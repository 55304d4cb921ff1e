//! How the solver converged, as the features show it that turned out to be no outliers.

use crate::assess::residuals::FeatureResidual;
use crate::input::observations::{Observation, Observations};
use crate::problem::parameters::Parameters;
use crate::solve::iteration_record::IterationRecord;
use std::borrow::Cow;
use std::collections::HashSet;
use trueline_lsq::Iteration;

/// The solver's steps with the distances of those observations only that turned out to be no outliers: what is wild would hide how
/// the rest converges.
#[must_use]
pub(crate) fn steps(
    steps: &[Iteration<Parameters>],
    observations: &Observations,
    features: &[FeatureResidual],
) -> Vec<IterationRecord> {
    let wild: HashSet<u32> = features.iter().filter(|f| f.is_outlier()).map(|f| f.row).collect();
    let list: Cow<'_, [Observation]> = if wild.is_empty() {
        Cow::Borrowed(&observations.list)
    } else {
        observations.list.iter().filter(|o| !wild.contains(&o.row)).copied().collect()
    };
    steps.iter().map(|step| IterationRecord::of(observations, &list, step)).collect()
}
