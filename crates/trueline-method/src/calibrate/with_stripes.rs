//! Replaces the answer of the seam points by that of the whole stripes, if that is selected.

use crate::adjustment::settings::Settings;
use crate::assess::levels::SystematicLevels;
use crate::assess::robot_field::RobotField;
use crate::assess::seam_point_error;
use crate::assess::share::Share;
use crate::calibrate::answered::{Answered, with_sensor};
use crate::calibrate::concluded::Concluded;
use crate::calibrate::lagging::JOINT_LAGS_S;
use crate::config::Measurements;
use crate::error::Error;
use crate::findings::Findings;
use crate::input::observations::Observations;
use crate::stripe::estimate::{self, SeamEstimate};
use crate::stripe::outcome::{Answer, StripeOutcome};
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

/// Estimates from whole stripes, and replaces the answer if the stripes are selected. The residuals of the seam points remain those from
/// their own seam, because on bent plates the crossing of two stripes is not a point of the seam.
///
/// # Errors
/// Fails if stripes were requested and cannot be used.
pub(crate) fn add_stripes(
    from: &Concluded<'_>,
    findings: &mut Findings,
    errors: &SeamErrors,
) -> Result<(), Error> {
    let robot_times_s = from.sampling.robot_times_s(from.dejittered);
    let unknowns = &findings.unknowns;
    let held_sigmas = from.held_sigmas();
    let amplitudes = findings.fit.amplitudes.as_ref();
    let lag_s = amplitudes.map_or(0.0, |found| found.lag_s);
    let lagging = lagging(&from.assessed.drift_free.observations, lag_s);
    let (observations, lag_s) = match &lagging {
        Some(lagging) => (lagging, lag_s),
        None => (&from.assessed.drift_free.observations, 0.0),
    };
    findings.stripes = estimate::estimate(&SeamEstimate {
        recording: from.recording,
        observations,
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
        noise: &errors.noise,
        shares: &errors.shares,
        adjustment: Settings {
            lag_s,
            joint_lags_s: amplitudes.and_then(|found| found.joint_lags_m).map_or(0.0, |_| JOINT_LAGS_S),
            field: errors.field.as_ref(),
            // An edge point lies in the light of its stripe, whatever the radius of the edge is.
            levels: SystematicLevels { robot: from.robot_taken, edge_radius_m: 0.0, ..from.levels },
            ..from.adjustment(&held_sigmas, &[])
        },
        bias: from.bias.as_ref(),
        robot_seems_worse: from.robot_seems.is_some(),
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
    let of_robot = estimate.of_robot.clone();
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
    findings.unknowns =
        with_sensor(from, Answered { parameters, covariance, noise_covariance, observability, of_robot });
    Ok(())
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
