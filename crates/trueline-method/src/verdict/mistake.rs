//! Detects wrong data: residuals far above the noise without another cause.
//!
//! A wrong unit or order leaves residuals of hundreds of standard deviations. Other results of the fit (mirrored attitudes, rivals, unobservable
//! unknowns) then belong to a wrong model and follow from the mistake.

use super::limits::{MOST_NOISE_FACTOR, NOISE_FACTOR};
use crate::findings::Findings;

/// Whether the likeliest explanation is a mistake in the data.
pub(super) fn is_likely(f: &Findings) -> bool {
    residuals_are_too_large(f) && !others_leave(f).any(|left| left <= MOST_NOISE_FACTOR)
}

/// Whether the inliers are no majority and no other minimum is better. The fit then describes a minority.
pub(super) fn most_are_outliers(f: &Findings) -> bool {
    let outliers = f.outliers();
    2 * outliers.count > outliers.of && others_leave(f).next().is_none()
}

/// Noise factors of the other explanations.
pub(crate) fn others_leave(f: &Findings) -> impl Iterator<Item = f64> {
    let better = f.checks.better.as_ref().map(|better| better.noise_factor);
    let rival = f.checks.ambiguity.runner_up.filter(|rival| rival.test.reversed());
    [better, rival.map(|rival| rival.noise_factor), f.clock.noise_factor_without_step].into_iter().flatten()
}

/// Whether the residuals are not noise: they follow the motion, or are larger than any edge explains.
pub(crate) fn residuals_are_too_large(f: &Findings) -> bool {
    if f.checks.better_without_drawing_m.is_some() {
        // The residuals come from the drawing, within its uncertainty. Without it they are small.
        return false;
    }
    let factor = f.fit.noise_factor;
    if let Some(amplitudes) = f.adjusted() {
        // A search that leaves so much noise is trusted within its window alone: beyond it an adjustment can explain an alias.
        let is_beyond = f.unknowns.parameters.time_offset_s.abs() > f.config.offset_search_s;
        let is_alias = is_beyond && factor > MOST_NOISE_FACTOR;
        return is_alias || amplitudes.are_beyond() || amplitudes.noise_times() > MOST_NOISE_FACTOR;
    }
    let stripes_are = f.stripe_noise_factor().is_some_and(|factor| factor > MOST_NOISE_FACTOR);
    stripes_are || factor > MOST_NOISE_FACTOR || factor > NOISE_FACTOR && !f.fit.structure.may_be_noise()
}
