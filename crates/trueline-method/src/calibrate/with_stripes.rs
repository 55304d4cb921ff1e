//! Replaces the answer of the seam points by that of the whole stripes, if that is selected.

use crate::assess::seam_point_error;
use crate::assess::systematic::{Systematic, SystematicSums};
use crate::calibrate::answered::{Answered, with_sensor};
use crate::calibrate::concluded::Concluded;
use crate::config::Measurements;
use crate::error::Error;
use crate::findings::Findings;
use crate::stripe::estimate::{self, SeamEstimate};
use crate::stripe::outcome::{Answer, StripeOutcome};
use crate::stripe::shared_amplitudes::SharedAmplitudes;
use crate::stripe::systematic::SharedErrors;
use nalgebra::DMatrix;

/// Noise and systematic errors of the estimate from seam points.
pub(crate) struct SeamErrors<'a> {
    /// Effect of each systematic error on the fit.
    pub sums: &'a SystematicSums,
    /// Systematic errors of the answer.
    pub systematic: &'a Systematic,
    /// Covariance from noise.
    pub noise: &'a DMatrix<f64>,
    /// Amplitudes of the errors shared with the stripes.
    pub amplitudes: SharedAmplitudes,
}

/// Estimates from whole stripes, and replaces the answer if the stripes are selected. The residuals of the seam points remain those from
/// their own seam, because on bent plates the crossing of two stripes is not a point of the seam.
///
/// # Errors
/// Fails if stripes were requested and cannot be used.
pub(crate) fn add_stripes(
    from: &Concluded<'_>,
    findings: &mut Findings,
    errors: &SeamErrors<'_>,
) -> Result<(), Error> {
    let robot_times_s = from.sampling.robot_times_s(from.dejittered);
    let unknowns = &findings.unknowns;
    findings.stripes = estimate::estimate(&SeamEstimate {
        recording: from.recording,
        observations: &from.assessed.drift_free.observations,
        robot_times_s,
        settings: from.settings,
        fit: &from.assessed.drift_free.fit,
        answer: Answer {
            parameters: unknowns.parameters.clone(),
            covariance: unknowns.covariance.clone(),
            noise_covariance: unknowns.noise_covariance.clone(),
            observability: unknowns.observability.clone(),
            seam_error: findings.checks.seam_error,
        },
        noise: errors.noise,
        amplitudes: errors.amplitudes,
        systematic: errors.systematic,
        shared: SharedErrors {
            levels: from.levels,
            field: errors.sums.field.as_ref(),
            tilt: errors.sums.tilt,
            bias: errors.sums.bias_error(&from.levels, from.inflation()),
        },
        bias: from.bias.as_ref(),
        held_sigmas: &from.held_sigmas(),
        robot_taken: from.robot_seems.map(|_| from.robot_taken),
        widened: &|covariance| from.with_time_offset_widened(covariance),
    })?;
    let Some(StripeOutcome {
        used: Measurements::Stripe | Measurements::Both, estimate: Some(estimate), ..
    }) = &findings.stripes
    else {
        return Ok(());
    };
    let Answer { parameters, covariance, noise_covariance, observability, seam_error } =
        estimate.stripe.clone();
    let observability = observability.bounded(&covariance);
    if estimate.explains_robot {
        findings.checks.robot_seems = None;
    }
    let (config, fit, observations) =
        (from.settings.config, &from.assessed.drift_free.fit, &from.assessed.drift_free.observations);
    let all_seen = observability.shows_all();
    let list = fit.placed.of(observations);
    let torch = || seam_point_error::predict(observations, list, &parameters, &covariance, &config.used_at);
    findings.checks.seam_point_error = all_seen.then(torch).flatten();
    findings.checks.seam_error = seam_error.filter(|_| all_seen);
    findings.unknowns = with_sensor(
        from,
        Answered { parameters, covariance, noise_covariance, observability, of_robot: None },
    );
    Ok(())
}
