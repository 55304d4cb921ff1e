//! Conclusions from a fit: findings and verdict.

use crate::calibrate::adjusted::take_adjusted;
use crate::calibrate::concluded::Concluded;
use crate::calibrate::held::compare;
use crate::calibrate::noise_alone::{self, NoiseAlone};
use crate::calibrate::with_stripes::{SeamErrors, add_stripes};
use crate::calibration::Calibration;
use crate::error::Error;
use crate::findings::Findings;
use crate::hypotheses::clock_drift::DriftFree;
use crate::problem::line_problem::LineProblem;
use crate::verdict;

/// All findings about a fit.
///
/// # Errors
/// The stripes were requested and cannot be used.
pub(crate) fn conclude(from: &Concluded<'_>) -> Result<Calibration, Error> {
    let _stage = tracing::debug_span!("conclude").entered();
    let DriftFree { fit, observations, .. } = &from.assessed.drift_free;
    let problem = fit.problem(observations, from.settings.config);
    let NoiseAlone { findings, sums, systematic, noise } = noise_alone::of(from, &problem);
    judged(from, findings, &problem, SeamErrors { noise, shares: systematic.shares(), field: sums.field })
}

/// Adjusts all errors, adds the stripes and the verdict.
fn judged(
    from: &Concluded<'_>,
    mut findings: Findings,
    problem: &LineProblem<'_>,
    of_noise_alone: SeamErrors,
) -> Result<Calibration, Error> {
    let errors = take_adjusted(from, problem, &mut findings).unwrap_or(of_noise_alone);
    add_stripes(from, &mut findings, &errors)?;
    // If the released fit is no better, it has no information on the held quantity.
    if let Some(released) =
        from.released.filter(|released| !verdict::residuals_are_too_large(&released.findings))
    {
        compare(&findings.config, &findings.unknowns.parameters, &mut findings.checks, released);
    }
    let verdict = verdict::of(&findings);
    Ok(Calibration { findings, verdict })
}
