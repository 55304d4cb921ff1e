//! Estimates from the plates beside the seam points, and selects the answer.

use crate::assess::levels::SystematicLevels;
use crate::assess::observability::RANK_THRESHOLD;
use crate::assess::robot_field::RobotSigmas;
use crate::assess::seam_error::{self, SeamErrorSources};
use crate::assess::systematic::Systematic;
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
use crate::stripe::agreement::{AGREEMENT_SIGMAS, sigmas_apart};
use crate::stripe::fit::{StripeFit, StripeSolver};
use crate::stripe::flat_rank::AttitudeNoise;
use crate::stripe::frames::{StripeFrames, frames};
use crate::stripe::freed::without_bias;
use crate::stripe::outcome::{
    Answer, Apart, Because, LEAST_WITH_BOTH, StripeEstimate, StripeOutcome, decided,
};
use crate::stripe::outlier_counts::OutlierCounts;
use crate::stripe::planes::Planes;
use crate::stripe::seam_of_straight_lines::moved_without_forms;
use crate::stripe::shared_amplitudes::SharedAmplitudes;
use crate::stripe::systematic::SharedErrors;
use crate::stripe::whitening::SharedNoise;
use crate::stripe::{
    as_seam, flat_rank, form, motion_information, planes, robot_accuracy, shown, start, systematic,
    uncertainty,
};
use nalgebra::{DMatrix, DVector, SVector, Vector3};
use std::collections::BTreeMap;
use trueline_dataset::Recording;
use trueline_geometry::Trajectory;
use trueline_lsq::Information;

/// A finished estimate from seam points, with its inputs.
pub struct SeamEstimate<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// Its seam points, with the stamps used.
    pub observations: &'a Observations,
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
    /// Sizes of the errors that it shares with its stripes.
    pub amplitudes: SharedAmplitudes,
    /// Its systematic errors.
    pub systematic: &'a Systematic,
    /// Errors that seam points and stripes share.
    pub shared: SharedErrors<'a>,
    /// The detector bias that was removed from its seam points.
    pub bias: Option<&'a TakenBias>,
    /// Held components with their standard deviations, SI.
    pub held_sigmas: &'a [(usize, f64)],
    /// The assumed robot errors, where the residuals show larger ones; else `None`.
    pub robot_taken: Option<RobotSigmas>,
    /// Adds the uncertainty of the time offset from the stamps to a covariance.
    pub widened: &'a dyn Fn(DMatrix<f64>) -> DMatrix<f64>,
}

/// Uses the stripes of a recording as the user requests. `None` if there are none, or only seam points are requested.
///
/// # Errors
/// The stripes were requested and cannot be used.
pub fn estimate(seam: &SeamEstimate<'_>) -> Result<Option<StripeOutcome>, Error> {
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
        (false, true) if seam.amplitudes.noise_lasts => Because::NoiseLasts,
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
    let like = &seam.answer.parameters;
    let (times_s, shared) = (seam.robot_times_s, shared_noise(seam));
    let shape_prior = settings.shape_prior;
    let begin = start::start(observations, frames, like, like.shape)
        .map_err(|why| why.with_unusable(frames.unplaced()))?;
    let fixed = [settings.fixed, &start::held(&begin, &frames.without_plates)].concat();
    let solver = StripeSolver {
        observations,
        frames: &frames.list,
        shared,
        loss: settings.config.final_loss(),
        shape_prior,
        fixed: &fixed,
    };
    let fit = solver.fit(begin).map_err(|_| NoPlates::NoPlane)?;
    let OutlierCounts { stripes, rejected_stripes: rejected, .. } = fit.counts;
    if 2 * rejected > stripes {
        return Err(NoPlates::Scattered { rejected, stripes });
    }
    let all = fit.information(&fixed, RANK_THRESHOLD).ok_or(NoPlates::NoPlane)?;
    let taken = seam.robot_taken.filter(|taken| robot_accuracy::shown(&fit, &all, *taken).is_none());
    let about_s = motion_information::times_looked_at_s(&fit.problem, fit.state());
    let halves = observations.robot.halves(recording, times_s, &about_s);
    let pose_noise = pose_noise_information(&fit, halves.as_ref());
    let information = motion_information::shown_by_motion(&fit, (&all, &pose_noise), &fixed);
    let information = information.ok_or(NoPlates::NoPlane)?;
    let attitudes = AttitudeNoise { sigma_rad: shared.robot_sigma_rad, factor: fit.noise_factor };
    let seen = flat_rank::shown(&fit.problem, fit.state(), attitudes, &fixed);
    let seen = seen.ok_or(NoPlates::NoPlane)?;
    let noise = uncertainty::assess(&fit, (&information, &pose_noise), &shared).covariance
        * seam.amplitudes.noise_variance;
    let errors = errors(seam, &fit, &information);
    let explained = Explained { taken, levels: seam.shared.levels };
    let InSeam { answer: stripe, noise: noise_of_seam, errors: errors_of_seam } =
        answer(seam, &fit, (&information, &seen), (&noise, &errors), &explained).ok_or(NoPlates::Parallel)?;
    // Unobservable directions do not converge. The scan is refused for those.
    if stripe.seam_error.is_some() && !(fit.is_settled && fit.solution.termination.is_converged()) {
        return Err(NoPlates::NotConverged);
    }
    let all = noise + explained.left_of(&errors).covariance();
    let Planes { plates: planes, angles, steps } =
        planes::planes(observations, frames, fit.state(), (&all, &shown::both_null(&seen, &information)));
    let sigmas_apart = unexplained(seam, (frames, &fit), &stripe, (&noise_of_seam, &errors_of_seam));
    Ok(StripeEstimate {
        planes,
        angles,
        steps,
        sigmas_apart,
        apart: in_lengths(observations, &seam.answer.parameters, &stripe.parameters),
        noise_factor: fit.noise_factor,
        counts: fit.counts,
        explains_robot: taken.is_some(),
        seam: seam.answer.clone(),
        stripe,
    })
}

/// Systematic errors of the fit, with the sizes that the seam points show.
fn errors(seam: &SeamEstimate<'_>, fit: &StripeFit<'_>, information: &Information) -> Systematic {
    let (hessian, root) = (&fit.solution.equations.hessian, information.covariance_root());
    let mut errors =
        systematic::systematic(fit, information, &seam.shared).with_held(hessian, root, seam.held_sigmas);
    errors.robot *= seam.amplitudes.robot;
    errors.form = form::effect(fit, information, seam.amplitudes.form_sigma_m);
    errors
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

/// Whether the plates' forms explain apparent robot errors.
struct Explained {
    /// The assumed robot errors, if they do.
    taken: Option<RobotSigmas>,
    /// The apparent error levels.
    levels: SystematicLevels,
}

impl Explained {
    fn levels(&self) -> SystematicLevels {
        SystematicLevels { robot: self.taken.unwrap_or(self.levels.robot), ..self.levels }
    }

    /// The errors with the assumed robot errors. Each mode has three columns of position and three of attitude.
    fn left_of(&self, errors: &Systematic) -> Systematic {
        let mut left = errors.clone();
        let Some(taken) = self.taken else { return left };
        let seems = self.levels.robot;
        let part = |taken: f64, seems: f64| if seems > 0.0 { taken / seems } else { 1.0 };
        let parts = [part(taken.position_m, seems.position_m), part(taken.attitude_rad, seems.attitude_rad)];
        left.robot.column_iter_mut().enumerate().for_each(|(k, mut column)| column *= parts[k / 3 % 2]);
        left
    }
}

/// An answer converted to a seam, with the contributions of noise and of systematic errors.
struct InSeam {
    answer: Answer,
    noise: DMatrix<f64>,
    errors: Systematic,
}

/// The answer converted to a seam, from its information and observability.
fn answer(
    seam: &SeamEstimate<'_>,
    fit: &StripeFit<'_>,
    (information, seen): (&Information, &Information),
    (noise, errors): (&DMatrix<f64>, &Systematic),
    explained: &Explained,
) -> Option<InSeam> {
    let parameters = as_seam::parameters(fit.state(), &seam.answer.parameters)?;
    let slope = as_seam::slope(fit.state(), &seam.answer.parameters)?;
    let carried = |columns: &DMatrix<f64>| &slope * columns;
    let errors_of_seam = Systematic {
        robot: carried(&errors.robot),
        sensor: carried(&errors.sensor),
        sensor_shape: errors.sensor_shape.clone(),
        feature_bias: carried(&errors.feature_bias),
        held: carried(&errors.held),
        form: carried(&errors.form),
    };
    let errors_of_answer = explained.left_of(&errors_of_seam);
    let noise_of_seam = &slope * noise * slope.transpose();
    let noise_covariance = (seam.widened)(noise_of_seam.clone());
    let observability =
        shown::observability(&seam.answer.observability, fit, (information, seen), &parameters);
    let all_seen = observability.observable_components[..LINES].iter().all(|seen| *seen);
    let model = &slope * information.covariance() * slope.transpose();
    let sources = |hessian: &DMatrix<f64>| {
        let sources = SeamErrorSources {
            hessian,
            fixed: seam.settings.fixed,
            noise: &noise_of_seam,
            stamps_variance_s2: noise_covariance[(TIME_OFFSET, TIME_OFFSET)]
                - noise_of_seam[(TIME_OFFSET, TIME_OFFSET)],
            systematic: &errors_of_answer,
            levels: explained.levels(),
            speed_m_s: seam.settings.config.used_at.speed_m_s,
        };
        let list = seam.fit.placed.of(seam.observations);
        seam_error::predict(seam.observations, list, &parameters, &sources)
    };
    let hessian = Information::new(&model, seam.settings.fixed, 0.0).map(|inverse| inverse.covariance());
    let seam_error = hessian.filter(|_| all_seen).and_then(|hessian| sources(&hessian));
    let answer = Answer {
        covariance: &noise_covariance + errors_of_answer.covariance(),
        noise_covariance,
        observability,
        seam_error,
        parameters,
    };
    Some(InSeam { answer, noise: noise_of_seam, errors: errors_of_seam })
}

/// Distance of two answers: in time, and at the middle of the visible part.
fn in_lengths(observations: &Observations, one: &Parameters, other: &Parameters) -> Apart {
    let points = || observations.list.iter().map(|o| o.point_in_camera);
    let middle = points().sum::<Vector3<f64>>() / points().count().max(1) as f64;
    let in_tool = |of: &Parameters| of.tool_from_camera.transform_point(&middle.into());
    Apart {
        time_offset_s: other.time_offset_s - one.time_offset_s,
        point_m: (in_tool(other) - in_tool(one)).norm(),
    }
}

/// Files have stamps of a nanosecond and lengths of nanometres. Smaller differences between answers are not resolved, s, rad and m.
const ROUNDING_SI: f64 = 1e-9;

/// Distance of the answers, σ, without the part that the plates' forms explain.
fn unexplained(
    seam: &SeamEstimate<'_>,
    (frames, fit): (&StripeFrames, &StripeFit<'_>),
    stripe: &Answer,
    ends: (&DMatrix<f64>, &Systematic),
) -> Option<f64> {
    let disagree = |sigmas: &f64| *sigmas >= AGREEMENT_SIGMAS;
    let plain = apart(seam, stripe, ends, None);
    let by_forms =
        || moved_without_forms((seam.observations, seam.settings), seam.fit, &frames.list, fit.state());
    let explained = plain.filter(disagree).and_then(|_| apart(seam, stripe, ends, by_forms()));
    explained.filter(|sigmas| !disagree(sigmas)).or(plain)
}

/// Distance of the seam points' and the stripes' answers over the clock and hand-eye components that both determine. Both share robot, sensor and
/// detector. Of these errors only the difference of their effects counts. `by_forms` is the shift of the seam points' answer from the plates' forms,
/// if the points are intersections of straight lines.
fn apart(
    seam: &SeamEstimate<'_>,
    stripe: &Answer,
    (noise, errors): (&DMatrix<f64>, &Systematic),
    by_forms: Option<SVector<f64, LINES>>,
) -> Option<f64> {
    let seen = |answer: &Answer, k: usize| answer.observability.observable_components[k];
    let both: Vec<usize> = (0..LINES).filter(|k| seen(&seam.answer, *k) && seen(stripe, *k)).collect();
    let difference = stripe.parameters.minus(&seam.answer.parameters.guess());
    let chosen = DVector::from_iterator(both.len(), both.iter().map(|k| difference[*k]));
    let by_errors = errors.minus(seam.systematic, LINES).covariance();
    let covariance = DMatrix::from_fn(both.len(), both.len(), |i, j| {
        let place = (both[i], both[j]);
        let rounding = if i == j { ROUNDING_SI * ROUNDING_SI } else { 0.0 };
        let by_forms = by_forms.map_or(0.0, |moved| moved[place.0] * moved[place.1]);
        seam.noise[place] + noise[place] + by_errors[place] + by_forms + rounding
    });
    sigmas_apart(&chosen, &covariance)
}
