//! How the solver converged, as the features show it that turned out to be no outliers.

use crate::assess::residuals::FeatureResidual;
use crate::input::observations::{Observation, Observations};
use crate::solve::iteration_record::{IterationRecord, rms_m};
use std::collections::HashSet;

/// The same steps with distances of those observations only that turned out to be no outliers: what is wild would hide how
/// the rest converges.
#[must_use]
pub(crate) fn without_outliers(
    mut steps: Vec<IterationRecord>,
    observations: &Observations,
    features: &[FeatureResidual],
) -> Vec<IterationRecord> {
    let wild: HashSet<u32> = features.iter().filter(|f| f.is_outlier()).map(|f| f.row).collect();
    if wild.is_empty() {
        return steps;
    }
    let list: Vec<Observation> =
        observations.list.iter().filter(|o| !wild.contains(&o.row)).copied().collect();
    for step in &mut steps {
        step.rms_m = rms_m(observations, &list, &step.parameters);
    }
    steps
}
