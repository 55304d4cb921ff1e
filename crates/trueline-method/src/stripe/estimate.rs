//! Estimates from the plates beside the seam points, and selects the answer.

use crate::adjustment::answer::{self, adjust_sights};
use crate::adjustment::settings::Settings;
use crate::assess::observability::RANK_THRESHOLD;
use crate::assess::outliers::Outliers;
use crate::assess::robot_accuracy::WORSE;
use crate::assess::robot_field::OfRobot;
use crate::assess::seam_error::{self, SharedError};
use crate::assess::share::Share;
use crate::config::{Measurements, ResidualKind};
use crate::error::Error;
use crate::error::no_plates::NoPlates;
use crate::hypotheses::feature_bias::TakenBias;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::Observations;
use crate::input::skip::Skip;
use crate::problem::parameters::{LINES, Parameters, TIME_OFFSET};
use crate::solve::fit::Fit;
use crate::solve::settings::FitSettings;
use crate::stripe::agreement::{self, Errors};
use crate::stripe::fit::{StripeFit, StripeSolver};
use crate::stripe::flat_rank::AttitudeNoise;
use crate::stripe::frames::{StripeFrames, frames};
use crate::stripe::freed::without_bias;
use crate::stripe::outcome::{
    Answer, Apart, Because, LEAST_WITH_BOTH, StripeAdjustment, StripeEstimate, StripeOutcome, decided,
};
use crate::stripe::outlier_counts::OutlierCounts;
use crate::stripe::planes::Planes;
use crate::stripe::plate_sights::PlateSights;
use crate::stripe::seam_of_straight_lines::moved_without_forms;
use crate::stripe::state::StripeState;
use crate::stripe::whitening::SharedNoise;
use crate::stripe::{as_seam, flat_rank, motion_information, planes, shown, start};
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use trueline_dataset::Recording;
use trueline_geometry::Trajectory;
use trueline_lsq::Information;

/// The answer of an adjustment of plates.
type Adjusted = answer::Answer<StripeState>;

/// A finished estimate from seam points, with its inputs.
pub(crate) struct SeamEstimate<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// Its seam points, with the stamps used and the path of the stripes: behind the recorded poses if these are commanded ones.
    pub observations: &'a Observations,
    /// The same with the path of the fit.
    pub recorded: &'a Observations,
    /// The robot stamps used, s.
    pub robot_times_s: &'a [f64],
    /// Settings of the fit.
    pub settings: &'a FitSettings<'a>,
    /// The fit.
    pub fit: &'a Fit,
    /// The answer.
    pub answer: Answer,
    /// Its covariance from noise alone.
    pub noise: &'a DMatrix<f64>,
    /// Its systematic errors.
    pub shares: &'a [Share],
    /// What the stripes are adjusted with beside noise.
    pub adjustment: Settings<'a>,
    /// The detector bias that was removed from its seam points.
    pub bias: Option<&'a TakenBias>,
    /// Whether the residuals of the seam points show larger errors of the robot than the assumed ones.
    pub robot_seems_worse: bool,
    /// Adds the uncertainty of the time offset from the stamps to a covariance.
    pub widened: &'a dyn Fn(DMatrix<f64>) -> DMatrix<f64>,
}

/// Uses the stripes of a recording as the user requests. `None` if there are none, or only seam points are requested.
///
/// # Errors
/// The stripes were requested and cannot be used.
pub(crate) fn estimate(seam: &SeamEstimate<'_>) -> Result<Option<StripeOutcome>, Error> {
    let _stage = tracing::debug_span!("stripes", stripes = seam.recording.stripes.len()).entered();
    let asked = seam.settings.config.measurements;
    let wanted = match asked {
        Measurements::Seam => return Ok(None),
        Measurements::Auto => Measurements::Stripe,
        Measurements::Stripe | Measurements::Both => asked,
    };
    let is_asked = asked != Measurements::Auto;
    if seam.settings.config.residual == ResidualKind::PointToLine {
        return if is_asked { Err(Error::StripesNeedSheet) } else { Ok(None) };
    }
    if seam.recording.stripes.is_empty() {
        return if is_asked { Err(Error::NoStripes) } else { Ok(None) };
    }
    if !seam.settings.config.drawn_lines.is_empty() {
        return if is_asked { Err(Error::StripesOfDrawnLine) } else { Ok(None) };
    }
    let mut frames = frames(seam.recording, seam.observations, wanted, seam.settings.config)?;
    if let Some(bias) = seam.bias {
        without_bias(&mut frames, seam.observations, seam.fit.parameters(), bias);
    }
    let kept = |because: Because, estimate: Option<StripeEstimate>| StripeOutcome {
        used: Measurements::Seam,
        because,
        frames: frames.total,
        with_both: frames.with_both,
        skipped: skipped(seam, &frames, estimate.as_ref()),
        stamped_later_s: frames.stamped_later_s,
        estimate: estimate.map(Box::new),
    };
    if seam.fit.prior.is_some() {
        return if is_asked {
            Err(Error::StripesHeldAtGuess)
        } else {
            Ok(Some(kept(Because::HeldAtGuess, None)))
        };
    }
    let estimate = match of_plates(seam, &frames) {
        Ok(estimate) => estimate,
        Err(why) if is_asked => return Err(Error::NoPlates { why }),
        Err(why) => return Ok(Some(kept(Because::Plates(why), None))),
    };
    let enough = frames.with_both as f64 >= LEAST_WITH_BOTH * frames.total as f64;
    let because = match (is_asked, enough) {
        (true, _) => Because::Asked,
        (false, false) => Because::TooFewFrames,
        (false, true) => decided(&estimate),
    };
    let used =
        if matches!(because, Because::Asked | Because::Agreement) { wanted } else { Measurements::Seam };
    Ok(Some(StripeOutcome { used, ..kept(because, Some(estimate)) }))
}

/// Unused stripes, by reason.
fn skipped(
    seam: &SeamEstimate<'_>,
    frames: &StripeFrames,
    estimate: Option<&StripeEstimate>,
) -> BTreeMap<Skip, usize> {
    let mut skipped = frames.skipped_at(seam.observations, seam.answer.parameters.time_offset_s);
    let along_sheet = estimate.map_or(0, |estimate| estimate.counts.along_sheet);
    if along_sheet > 0 {
        *skipped.entry(Skip::AlongPlane).or_insert(0) += along_sheet;
    }
    skipped
}

fn of_plates(seam: &SeamEstimate<'_>, frames: &StripeFrames) -> Result<StripeEstimate, NoPlates> {
    let SeamEstimate { recording, observations, settings, .. } = *seam;
    // A lagging robot is where it was commanded to be earlier: its path has the delay that the time offset of recorded poses contains.
    let lag_s = seam.adjustment.lag_s;
    let answer = &seam.answer.parameters;
    let like = &Parameters { time_offset_s: answer.time_offset_s - lag_s, ..answer.clone() };
    let shape_prior = settings.shape_prior;
    let begin = start::start(observations, frames, like, like.shape)
        .map_err(|why| why.with_unusable(frames.unplaced()))?;
    let fixed = [settings.fixed, &start::held(&begin, &frames.without_plates)].concat();
    let solver = StripeSolver {
        observations,
        frames: &frames.list,
        shared: shared_noise(seam),
        loss: settings.config.final_loss(),
        shape_prior,
        fixed: &fixed,
    };
    let fit = solver.fit(begin).map_err(|_| NoPlates::NoPlane)?;
    let OutlierCounts { stripes, rejected_stripes: rejected, .. } = fit.rejected.counts;
    if 2 * rejected > stripes {
        return Err(NoPlates::Scattered { rejected, stripes });
    }
    let (information, seen) = determined(seam, &fit, &fixed).ok_or(NoPlates::NoPlane)?;
    let unseen = shown::both_null(&seen, &information);
    let mut sights = PlateSights::of(&fit, unseen.clone());
    let exposures_s = sights.exposures_s(fit.state().time_offset_s);
    sights.halves = observations.robot.halves(recording, seam.robot_times_s, &exposures_s);
    let own = Settings { fixed: &fixed, noise_factor: fit.noise_factor, ..seam.adjustment };
    let adjusted = adjust_sights(sights, (fit.state(), shape_prior), &own, None);
    let mut adjusted = adjusted.ok_or(NoPlates::NotConverged)?;
    let Planes { plates: planes, angles, steps } =
        planes::planes(observations, frames, &adjusted.at, (&adjusted.covariance(), &unseen));
    adjusted.at.time_offset_s += lag_s;
    let InSeam { answer: stripe, noise, shares, of_robot } =
        in_seam(seam, &fit, &adjusted, (&information, &seen)).ok_or(NoPlates::Parallel)?;
    // Unobservable directions do not converge. The scan is refused for those.
    if stripe.seam_error.is_some() && !(fit.is_settled && fit.solution.termination.is_converged()) {
        return Err(NoPlates::NotConverged);
    }
    let of_seam = Errors { noise: seam.noise, shares: seam.shares };
    let errors = Errors { noise: &noise, shares: &shares };
    let by_forms = || moved_without_forms((seam.recorded, settings), seam.fit, &frames.list, &adjusted.at);
    let sigmas_apart = agreement::unexplained((&seam.answer, &of_seam), (&stripe, &errors), by_forms);
    let (noise_factor, robot) = (adjusted.amplitudes.noise_times(), adjusted.amplitudes.robot);
    Ok(StripeEstimate {
        planes,
        angles,
        steps,
        sigmas_apart,
        apart: {
            let points = observations.list.iter().map(|o| o.point_in_camera);
            let of = |at: &Parameters| (at.time_offset_s, at.tool_from_camera);
            Apart::at(points, [&seam.answer.parameters, &stripe.parameters].map(of))
        },
        noise_factor,
        counts: fit.rejected.counts,
        adjustment: Some(adjustment(&fit, adjusted)),
        explains_robot: seam.robot_seems_worse && robot.is_some_and(|robot| robot < WORSE),
        seam: seam.answer.clone(),
        stripe,
        of_robot,
    })
}

/// The errors that an adjustment found, with everything that it or the fit before it left out.
fn adjustment(fit: &StripeFit<'_>, adjusted: Adjusted) -> StripeAdjustment {
    let (before, mut amplitudes) = (adjusted.frames.outliers(), adjusted.amplitudes);
    // The adjustment takes one frame in several of a long scan.
    let every = fit.problem.frames.len().div_ceil(before.of.max(1)).max(1);
    let left_out_s: Vec<f64> = fit.rejected.stamps_s.iter().copied().step_by(every).collect();
    let frames = adjusted.frames.without(&left_out_s);
    amplitudes.out = frames.outliers();
    let own = amplitudes.outliers.count + amplitudes.out.count.saturating_sub(before.count);
    amplitudes.outliers = Outliers { count: own, of: amplitudes.out.of };
    StripeAdjustment {
        blocks: adjusted.blocks,
        log_evidence: -0.5 * adjusted.twice_negative_log,
        noise_factor: fit.noise_factor,
        of_joints: fit.rejected.of_joints.clone(),
        frames,
        amplitudes,
    }
}

/// The information of the motion, and that of flat plates without the attitudes' noise. `None` if it has no directions.
fn determined(
    seam: &SeamEstimate<'_>,
    fit: &StripeFit<'_>,
    fixed: &[usize],
) -> Option<(Information, Information)> {
    let all = fit.information(fixed, RANK_THRESHOLD)?;
    let about_s = motion_information::times_looked_at_s(&fit.problem, fit.state());
    let halves = seam.observations.robot.halves(seam.recording, seam.robot_times_s, &about_s);
    let pose_noise = pose_noise_information(fit, halves.as_ref());
    let information = motion_information::shown_by_motion(fit, (&all, &pose_noise), fixed)?;
    let sigma_rad = shared_noise(seam).robot_sigma_rad;
    let attitudes = AttitudeNoise { sigma_rad, factor: fit.noise_factor };
    Some((information, flat_rank::shown(&fit.problem, fit.state(), attitudes, fixed)?))
}

/// The noise that all stripes of a frame share.
fn shared_noise(seam: &SeamEstimate<'_>) -> SharedNoise {
    let SeamEstimate { recording, observations, settings, robot_times_s, .. } = *seam;
    SharedNoise {
        levels: NoiseLevels { factor: 1.0, ..settings.noise },
        robot_sigma_rad: observations.robot.rotation_noise_rad(recording, robot_times_s),
    }
}

/// The part of the information that is noise of the robot's poses. Zero if the stream is too short for an estimate.
fn pose_noise_information(fit: &StripeFit<'_>, halves: Option<&[Trajectory; 2]>) -> DMatrix<f64> {
    let size = fit.problem.unknowns.dimension();
    halves.map_or_else(|| DMatrix::zeros(size, size), |halves| motion_information::of_noise(fit, halves))
}

/// An answer converted to a seam, with the contributions of noise and of systematic errors.
struct InSeam {
    answer: Answer,
    noise: DMatrix<f64>,
    shares: Vec<Share>,
    of_robot: Option<OfRobot>,
}

/// The adjusted answer converted to a seam, with its information and observability.
fn in_seam(
    seam: &SeamEstimate<'_>,
    fit: &StripeFit<'_>,
    adjusted: &Adjusted,
    (information, seen): (&Information, &Information),
) -> Option<InSeam> {
    let parameters = as_seam::parameters(&adjusted.at, &seam.answer.parameters)?;
    let slope = as_seam::slope(&adjusted.at, &seam.answer.parameters)?;
    let carried = |share: &Share| Share { columns: &slope * &share.columns, ..share.clone() };
    let shares: Vec<Share> = adjusted.shares.iter().map(carried).collect();
    let noise = &slope * &adjusted.noise * slope.transpose();
    let noise_covariance = (seam.widened)(noise.clone());
    let stamps = &noise_covariance - &noise;
    let observability =
        shown::observability(&seam.answer.observability, fit, (information, seen), &parameters);
    let all_seen = observability.observable_components[..LINES].iter().all(|seen| *seen);
    let sources = SharedError {
        noise: &noise,
        stamps_variance_s2: stamps[(TIME_OFFSET, TIME_OFFSET)],
        shares: &shares,
        levels: seam.adjustment.levels,
        speed_m_s: seam.settings.config.used_at.speed_m_s,
    };
    let list = seam.fit.placed.of(seam.recorded);
    let seam_error = || seam_error::of_shares(seam.recorded, list, &parameters, &sources);
    let answer = Answer {
        seam_error: all_seen.then(seam_error).flatten(),
        covariance: &slope * adjusted.covariance() * slope.transpose() + stamps,
        noise_covariance,
        observability,
        parameters,
    };
    let of_robot = adjusted.of_robot().map(|robot| OfRobot { columns: &slope * robot.columns, ..robot });
    Some(InSeam { answer, noise, shares, of_robot })
}
