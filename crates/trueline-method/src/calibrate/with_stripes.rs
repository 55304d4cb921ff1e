//! Replaces the answer of the seam points by that of the whole stripes, if that is selected.

use crate::adjustment::settings::Settings;
use crate::assess::levels::SystematicLevels;
use crate::assess::robot_field::{RobotField, RobotSigmas};
use crate::assess::seam_error::SeamError;
use crate::assess::share::Share;
use crate::calibrate::answered::{Answered, take};
use crate::calibrate::concluded::Concluded;
use crate::calibrate::lagging::JOINT_LAGS_S;
use crate::config::Measurements;
use crate::error::Error;
use crate::findings::Findings;
use crate::input::observations::Observations;
use crate::models::{self, OfStripes};
use crate::stripe::estimate::{self, SeamEstimate};
use crate::stripe::outcome::{Answer, StripeAdjustment, StripeEstimate, StripeOutcome};
use nalgebra::DMatrix;
use trueline_geometry::lag;

/// Errors of the estimate from seam points.
pub(crate) struct SeamErrors {
    /// Covariance from noise.
    pub noise: DMatrix<f64>,
    /// Systematic errors.
    pub shares: Vec<Share>,
    /// The robot's errors; `None` of an ideal robot.
    pub field: Option<RobotField>,
}

/// Estimates from whole stripes, and replaces the answer with its checks if the stripes are selected. The residuals of the seam points remain those
/// from their own seam, because on bent plates the crossing of two stripes is not a point of the seam.
///
/// # Errors
/// Fails if stripes were requested and cannot be used.
pub(crate) fn add_stripes(
    from: &Concluded<'_>,
    findings: &mut Findings,
    errors: &SeamErrors,
) -> Result<(), Error> {
    findings.stripes = of_stripes(from, findings, errors)?;
    let Some(StripeOutcome { used, estimate: Some(estimate), .. }) = &findings.stripes else { return Ok(()) };
    let (used, is_answer, estimate) = (*used, *used != Measurements::Seam, estimate.as_ref());
    if let Some(StripeAdjustment { blocks, log_evidence, noise_factor, frames, .. }) = &estimate.adjustment {
        // Stripes that were not requested are tried by themselves.
        let measurements = if is_answer { used } else { Measurements::Stripe };
        let (log_evidence, noise_factor) = (*log_evidence, *noise_factor);
        let tried = OfStripes { measurements, blocks, log_evidence, noise_factor, is_answer };
        models::add_stripes(&mut findings.models_tried, tried);
        if is_answer && findings.fit.amplitudes.is_some() {
            // Seam points may fail where the stripes beside them do not.
            findings.checks.outlier_segments.retain(|segment| frames.leave_out(segment.span_s));
        }
    }
    if is_answer {
        if estimate.explains_robot {
            findings.checks.robot_seems = None;
        }
        let (answered, seam_error) = answered(estimate);
        take(from, findings, answered, seam_error);
    }
    Ok(())
}

/// The estimate from the stripes beside that from the seam points.
fn of_stripes(
    from: &Concluded<'_>,
    findings: &Findings,
    errors: &SeamErrors,
) -> Result<Option<StripeOutcome>, Error> {
    let unknowns = &findings.unknowns;
    let held_sigmas = from.held_sigmas();
    let amplitudes = findings.fit.amplitudes.as_ref();
    let lag_s = amplitudes.map_or(0.0, |found| found.lag_s);
    let lagging = lagging(&from.assessed.drift_free.observations, lag_s);
    let (observations, lag_s) = match &lagging {
        Some(lagging) => (lagging, lag_s),
        None => (&from.assessed.drift_free.observations, 0.0),
    };
    let recorded = &from.assessed.drift_free.observations;
    let field = field(from, errors);
    estimate::estimate(&SeamEstimate {
        recording: from.recording,
        observations,
        recorded,
        robot_times_s: from.sampling.robot_times_s(from.dejittered),
        settings: from.settings,
        fit: &from.assessed.drift_free.fit,
        answer: Answer {
            parameters: unknowns.parameters.clone(),
            covariance: unknowns.covariance.clone(),
            noise_covariance: unknowns.noise_covariance.clone(),
            observability: unknowns.observability.clone(),
            seam_error: findings.checks.seam_error,
        },
        noise: &errors.noise,
        shares: &errors.shares,
        adjustment: Settings {
            lag_s,
            joint_lags_s: amplitudes.and_then(|found| found.joint_lags_m).map_or(0.0, |_| JOINT_LAGS_S),
            field: field.as_ref(),
            // An edge point lies in the light of its stripe, whatever the radius of the edge is.
            levels: SystematicLevels { robot: from.robot_taken, edge_radius_m: 0.0, ..from.levels },
            ..from.adjustment(&held_sigmas, &[])
        },
        bias: from.bias.as_ref(),
        robot_seems_worse: from.robot_seems.is_some(),
        widened: &|covariance| from.with_time_offset_widened(covariance),
    })
}

/// The robot's errors, of the assumed size. Where seam points show larger ones, the stripes test whether these are the robot's: whether they need
/// clearly more than that size, or, of a robot that is stated to be ideal, clearly more than the seam points.
fn field(from: &Concluded<'_>, errors: &SeamErrors) -> Option<RobotField> {
    let of_seam = errors.field.clone()?;
    let is_ideal = from.robot_taken == RobotSigmas::default();
    Some(if is_ideal { of_seam } else { of_seam.of_size(from.robot_taken) })
}

/// The answer of the stripes, and its predicted error of a later seam point.
fn answered(estimate: &StripeEstimate) -> (Answered, Option<SeamError>) {
    let Answer { parameters, covariance, noise_covariance, observability, seam_error } =
        estimate.stripe.clone();
    let observability = observability.bounded(&covariance);
    let of_robot = estimate.of_robot.clone();
    (Answered { parameters, covariance, noise_covariance, observability, of_robot }, seam_error)
}

/// The scan with the robot behind its recorded poses by a lag, s. `None` without one.
fn lagging(observations: &Observations, lag_s: f64) -> Option<Observations> {
    if lag_s <= 0.0 {
        return None;
    }
    let mut lagging = observations.clone();
    lagging.robot.trajectory = lag::first_order(&observations.robot.trajectory, lag_s).ok()?;
    Some(lagging)
}
