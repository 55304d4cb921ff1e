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
use crate::stripe::shared_amplitudes::SharedAmplitudes;
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
    let amplitudes = SharedAmplitudes::EXPECTED;
    let errors = SeamErrors { sums: &sums, systematic: &systematic, noise: &noise, amplitudes };
    judged(from, findings, (&problem, &errors))
}

/// Adjusts all errors, adds the stripes and the verdict.
fn judged(
    from: &Concluded<'_>,
    mut findings: Findings,
    (problem, errors): (&LineProblem<'_>, &SeamErrors<'_>),
) -> Result<Calibration, Error> {
    take_adjusted(from, problem, &mut findings);
    if let Some(amplitudes) = &findings.fit.amplitudes {
        // Both answers share part of their errors, and the columns do not separate them. Their difference is therefore given a larger uncertainty.
        let noise = findings.unknowns.covariance.clone();
        let systematic = errors.systematic.of_nothing();
        let amplitudes = SharedAmplitudes::of(amplitudes, &findings.unknowns.noise_covariance, errors.noise);
        let of_adjusted = SeamErrors { noise: &noise, systematic: &systematic, amplitudes, ..*errors };
        add_stripes(from, &mut findings, &of_adjusted)?;
    } else {
        add_stripes(from, &mut findings, errors)?;
    }
    // If the released fit is no better, it has no information on the held quantity.
    if let Some(released) =
        from.released.filter(|released| !verdict::residuals_are_too_large(&released.findings))
    {
        compare(&findings.config, &findings.unknowns.parameters, &mut findings.checks, released);
    }
    let verdict = verdict::of(&findings);
    Ok(Calibration { findings, verdict })
}
