//! Conclusions from a fit: findings and verdict.

use crate::adjusted::{Adjusted, Unsolved, adjusted, residuals_of};
use crate::answered::{Answered, beside_cause, with_sensor};
use crate::assess::cause_kind::CauseKind;
use crate::assess::convergence;
use crate::assess::correlated_noise::Structure;
use crate::assess::cross_validation::{self, Subject};
use crate::assess::instead_of_sensor::{self, InsteadOfSensor};
use crate::assess::misfit_patterns::Patterns;
use crate::assess::observability::{Group, RANK_THRESHOLD};
use crate::assess::profile_likelihood::{self, Widening};
use crate::assess::residuals::{self, FeatureResidual, ResidualSummary};
use crate::assess::seam_error::{self, SeamError, SeamErrorSources};
use crate::assess::sensor_shape::SensorShape;
use crate::assess::systematic::{Systematic, SystematicSums};
use crate::assess::{outlier_segments, seam_point_error};
use crate::axes::finding as axes;
use crate::calibration::Calibration;
use crate::concluded::Concluded;
use crate::config::Measurements;
use crate::error::Error;
use crate::findings::{Checks, ClockFindings, Findings, FitFindings, Streams, Unknowns};
use crate::hypotheses::clock_drift::DriftFree;
use crate::hypotheses::feature_bias::FeatureBias;
use crate::hypotheses::search::Mirrored;
use crate::input::observations::origin_ns;
use crate::input::skip::Skip;
use crate::input::stops::Stops;
use crate::models::held::compare;
use crate::models::tried::{ModelTried, of_adjustment};
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use crate::solve::covariance::{self, Uncertainty};
use crate::solve::solver::Solver;
use crate::stripe::estimate::{self, SeamEstimate};
use crate::stripe::lasting::Lasting;
use crate::stripe::outcome::{Answer, StripeOutcome};
use crate::stripe::systematic::SharedErrors;
use crate::verdict;
use nalgebra::{DMatrix, SVector};
use trueline_dataset::Sensor;
use trueline_lsq::Termination;

/// All findings about a fit.
///
/// # Errors
/// Stripes that are asked for and cannot be used.
pub(crate) fn conclude(from: &Concluded<'_>) -> Result<Calibration, Error> {
    let _stage = tracing::debug_span!("conclude").entered();
    let (config, fit, observations) =
        (from.settings.config, &from.assessed.drift_free.fit, &from.assessed.drift_free.observations);
    let problem = fit.problem(observations, config);
    let (uncertainty, widening) = by_noise(from, &problem);
    let root = from.assessed.information.covariance_root();
    let sums = SystematicSums::of(&problem, fit.parameters(), root, &from.levels);
    let systematic = sums.systematic(&from.levels, from.inflation()).with_held(
        &fit.solution.equations.hessian,
        root,
        &from.held_sigmas(),
    );
    let mut unknowns = unknowns(from, &uncertainty, &systematic);
    unknowns.sensor = beside_cause(from, &unknowns);
    let (features, skipped) = residuals::evaluate(&problem, fit.parameters());
    if features.is_empty() {
        unknowns = unknowns.of_no_feature();
    }
    let mut checks = checks(from, &uncertainty, &unknowns, &features);
    if unknowns.observability.shows_all() {
        checks.seam_error = seam_error(from, &uncertainty, &systematic);
    }
    checks.cause = from.cause.clone();
    checks.instead_of_sensor = instead_of_sensor(from, &problem, &unknowns);
    checks.feature_bias = from.bias.as_ref().and_then(|taken| {
        let estimate = sums.bias(&taken.px, from.inflation())?;
        Some(FeatureBias::new(&estimate, taken.is_plain))
    });
    let streams = streams(from, skipped.get(&Skip::Repeated).copied().unwrap_or(0));
    let summary = residuals::summarise(&features, skipped);
    let findings = Findings {
        sensor_kind: from.recording.sensor.kind(),
        unknowns,
        fit: fit_findings(from, summary, features, (&uncertainty, widening)),
        checks,
        clock: clock(&from.assessed.drift_free),
        streams,
        stripes: None,
        curve: None,
        curve_untried: None,
        unused_on_curve: Vec::new(),
        axes: axes::of_all(from.recording, &[], None),
        stops: config.at_stops.then_some(Stops::Stated),
        sensor_of_its_own_scan: false,
        uncertainty_ignored: from.ignores_uncertainty(),
        inputs: from.recording.inputs.clone(),
        config: config.clone(),
        models_tried: vec![ModelTried::asked(from.settings, &from.levels, &from.assessed.drift_free)],
    };
    let errors = SeamErrors {
        sums: &sums,
        systematic: &systematic,
        noise: &uncertainty.covariance,
        lasting: Lasting::NOT,
    };
    judged(from, findings, (&problem, &errors))
}

/// What the fit of noise alone left.
fn fit_findings(
    from: &Concluded<'_>,
    residuals: ResidualSummary,
    features: Vec<FeatureResidual>,
    (uncertainty, widening): (&Uncertainty, Option<Widening>),
) -> FitFindings {
    let (fit, observations) = (&from.assessed.drift_free.fit, &from.assessed.drift_free.observations);
    let stamp_of = |f: &FeatureResidual| from.recording.features[f.row as usize].stamp_ns;
    FitFindings {
        residuals,
        feature_stamps_ns: features.iter().map(stamp_of).collect(),
        noise_factor: fit.noise.factor,
        structure: from.structure.clone(),
        widened_by: widening.map(|widening| widening.by),
        covariance_model_share: uncertainty.model_share,
        termination: fit.solution.termination,
        iterations: convergence::steps(&fit.iterations, observations, &features),
        sheet_fit_rms_m: observations.sheet_fit_rms_m,
        features,
        amplitudes: None,
    }
}

/// Other causes that could explain an apparent sensor error.
fn instead_of_sensor(
    from: &Concluded<'_>,
    problem: &LineProblem<'_>,
    unknowns: &Unknowns,
) -> Vec<InsteadOfSensor> {
    let is_open =
        |shape: &SensorShape| shape.is_off() && from.cause.is_none() && from.assessed.all_observable();
    let Some(shape) = unknowns.sensor.filter(is_open) else { return Vec::new() };
    let at = &unknowns.parameters;
    let patterns = Patterns::of(from.recording, problem, at, from.assessed.information.covariance_root());
    let mut instead = instead_of_sensor::find(&patterns, &shape, at, &unknowns.covariance);
    // What has no picture has no two halves of one.
    let has_picture = matches!(from.recording.sensor, Sensor::CameraLaser { .. });
    instead.retain(|cause| has_picture || cause.kind != CauseKind::SideBias);
    instead
}

/// The covariance by noise, and how it was widened where a quadratic does not hold.
fn by_noise(from: &Concluded<'_>, problem: &LineProblem<'_>) -> (Uncertainty, Option<Widening>) {
    let _stage = tracing::debug_span!("covariance").entered();
    let (fit, observations) = (&from.assessed.drift_free.fit, &from.assessed.drift_free.observations);
    let mut uncertainty =
        covariance::assess(problem, fit.parameters(), &fit.noise, &from.assessed.information);
    if let Structure::Correlated(noise) = &from.structure {
        uncertainty.covariance = noise.covariance.clone();
    }
    let solver = Solver { observations, settings: *from.settings };
    let is_seen = from.assessed.all_observable();
    let widening = profile_likelihood::widening(&solver, fit, &uncertainty.covariance).filter(|_| is_seen);
    if let Some(widening) = &widening {
        uncertainty.covariance += widening.covariance();
    }
    (uncertainty, widening)
}

fn clock(drift_free: &DriftFree) -> ClockFindings {
    ClockFindings {
        drift: drift_free.drift,
        drifted: drift_free.drifted,
        step: drift_free.step,
        stepped: drift_free.stepped,
        noise_factor_without_step: drift_free.noise_factor_without_step,
    }
}

/// Noise and systematic errors of the estimate from seam points.
struct SeamErrors<'a> {
    sums: &'a SystematicSums,
    systematic: &'a Systematic,
    noise: &'a DMatrix<f64>,
    lasting: Lasting,
}

/// With every error adjusted, with what the stripes say, and the verdict.
fn judged(
    from: &Concluded<'_>,
    mut findings: Findings,
    (problem, errors): (&LineProblem<'_>, &SeamErrors<'_>),
) -> Result<Calibration, Error> {
    take_adjusted(from, problem, &mut findings);
    if let Some(amplitudes) = &findings.fit.amplitudes {
        // The errors of both answers are the same in part, and are told apart by none of its columns: their difference is taken for less sure than it is.
        let noise = findings.unknowns.covariance.clone();
        let systematic = errors.systematic.of_nothing();
        // What lasts in the seam points lasts in the stripes of the same frames.
        let lasting = Lasting::of(amplitudes, &findings.unknowns.noise_covariance, errors.noise);
        let of_adjusted = SeamErrors { noise: &noise, systematic: &systematic, lasting, ..*errors };
        add_stripes(from, &mut findings, &of_adjusted)?;
    } else {
        add_stripes(from, &mut findings, errors)?;
    }
    // What fits no better when released has no information on what was held.
    if let Some(released) =
        from.released.filter(|released| !verdict::residuals_are_too_large(&released.findings))
    {
        compare(&findings.config, &findings.unknowns.parameters, &mut findings.checks, released);
    }
    let verdict = verdict::of(&findings);
    Ok(Calibration { findings, verdict })
}

/// Looks at whole stripes, and takes their answer where it is the one that is used. The residuals of the seam points stay those about
/// their own seam: on bent plates their crossing is no point of it.
fn add_stripes(from: &Concluded<'_>, findings: &mut Findings, errors: &SeamErrors<'_>) -> Result<(), Error> {
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
        lasting: errors.lasting,
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
    findings.unknowns =
        with_sensor(from, Answered { parameters, covariance, noise_covariance, observability });
    Ok(())
}

/// Takes the answer of the seam points as it is adjusted with all errors: residuals, checks and ± are its own.
fn take_adjusted(from: &Concluded<'_>, problem: &LineProblem<'_>, findings: &mut Findings) {
    if findings.fit.residuals.used == 0 {
        return;
    }
    let adjusted = match adjusted(from, problem) {
        Ok(Some(adjusted)) => adjusted,
        Ok(None) => return,
        // The ± of noise alone is not that of this cell.
        Err(Unsolved) => {
            findings.fit.termination = Termination::NoSolution;
            return;
        }
    };
    let Adjusted { answer, seam_error, is_open, tried, better, with_axes } = adjusted;
    findings.checks.better = findings.checks.better.or(better);
    let mut mirrors = from.ambiguity.rivals.iter().zip(&is_open).filter(|(rival, _)| rival.is_mirror);
    let is_told_apart = mirrors.next().is_some_and(|(_, is_open)| !is_open);
    if findings.checks.mirrored == Mirrored::Equal && is_told_apart {
        findings.checks.mirrored = Mirrored::ToldApart;
        // It was the mirror alone that left the rotation open.
        let seen = &mut findings.unknowns.observability;
        if seen.shows(Group::Rotation) {
            seen.observable_components[ROTATION..TRANSLATION].fill(true);
        }
    }
    let mut is_open = is_open.into_iter();
    findings.checks.ambiguity.rivals.retain(|_| is_open.next().unwrap_or(true));
    let begun = findings.models_tried.remove(0);
    let models = of_adjustment(&begun, &answer.blocks, &tried, answer.amplitudes.lag_s);
    findings.models_tried.splice(0..0, models);
    // Its own covariance needs no widening, and its own blocks leave nothing for parts of the scan to disagree about.
    (findings.fit.widened_by, findings.checks.held_out) = (None, None);
    let noise_covariance = from.with_time_offset_widened(answer.noise.clone());
    let covariance = answer.covariance() - &answer.noise + &noise_covariance;
    findings.axes = axes::of_all(from.recording, &answer.at.lines, answer.axes.as_ref());
    let observability = findings.unknowns.observability.clone().bounded(&covariance);
    let (config, observations) = (from.settings.config, &from.assessed.drift_free.observations);
    let list = from.assessed.drift_free.fit.placed.of(observations);
    let torch = || seam_point_error::predict(observations, list, &answer.at, &covariance, &config.used_at);
    findings.checks.seam_point_error = observability.shows_all().then(torch).flatten();
    findings.checks.seam_error = seam_error.filter(|_| observability.shows_all());
    let (features, skipped) = residuals_of(problem, with_axes.as_ref(), &answer.at);
    findings.fit.residuals = residuals::summarise(&features, skipped);
    findings.checks.outlier_segments = outlier_segments::find(
        observations,
        &features,
        &answer.at,
        &from.assessed.drift_free.fit.noise,
        config.offset_search_s,
    );
    // What is explained is no stretch apart.
    findings.checks.outlier_segments.retain(|segment| answer.leaves_out(segment.span_s));
    let stamp_of = |f: &FeatureResidual| from.recording.features[f.row as usize].stamp_ns;
    findings.fit.feature_stamps_ns = features.iter().map(stamp_of).collect();
    findings.fit.features = features;
    findings.fit.amplitudes = Some(answer.amplitudes);
    findings.unknowns =
        with_sensor(from, Answered { parameters: answer.at, covariance, noise_covariance, observability });
    findings.unknowns.sensor = beside_cause(from, &findings.unknowns);
    if !findings.unknowns.sensor.is_some_and(|shape| shape.is_off()) {
        findings.checks.instead_of_sensor.clear();
    }
}

fn unknowns(from: &Concluded<'_>, uncertainty: &Uncertainty, systematic: &Systematic) -> Unknowns {
    let noise_covariance = from.with_time_offset_widened(uncertainty.covariance.clone());
    let covariance = &noise_covariance + systematic.covariance();
    let answered = Answered {
        parameters: from.assessed.drift_free.fit.parameters().clone(),
        observability: from.assessed.observability.clone().bounded(&covariance),
        covariance,
        noise_covariance,
    };
    let held_at_guess = from.assessed.drift_free.fit.prior.is_some();
    Unknowns { held_at_guess, ..with_sensor(from, answered) }
}

fn seam_error(from: &Concluded<'_>, uncertainty: &Uncertainty, systematic: &Systematic) -> Option<SeamError> {
    let (fit, observations) = (&from.assessed.drift_free.fit, &from.assessed.drift_free.observations);
    let sources = SeamErrorSources {
        hessian: &fit.solution.equations.hessian,
        fixed: from.settings.fixed,
        noise: &uncertainty.covariance,
        stamps_variance_s2: {
            let widened = from.with_time_offset_widened(uncertainty.covariance.clone());
            widened[(TIME_OFFSET, TIME_OFFSET)] - uncertainty.covariance[(TIME_OFFSET, TIME_OFFSET)]
        },
        systematic,
        levels: from.levels,
        speed_m_s: from.settings.config.used_at.speed_m_s,
    };
    seam_error::predict(observations, fit.placed.of(observations), fit.parameters(), &sources)
}

fn checks(
    from: &Concluded<'_>,
    uncertainty: &Uncertainty,
    unknowns: &Unknowns,
    features: &[FeatureResidual],
) -> Checks {
    let (config, fit, observations) =
        (from.settings.config, &from.assessed.drift_free.fit, &from.assessed.drift_free.observations);
    let (at, observability) = (&unknowns.parameters, &unknowns.observability);
    let list = fit.placed.of(observations);
    let predict = || seam_point_error::predict(observations, list, at, &unknowns.covariance, &config.used_at);
    Checks {
        mirrored: from.mirrored,
        // Other answers of a scan that shows neither time offset nor rotation mean nothing.
        ambiguity: if [Group::TimeOffset, Group::Rotation].iter().any(|group| observability.shows(*group)) {
            from.ambiguity.clone()
        } else {
            from.ambiguity.without_rivals()
        },
        better: from.better,
        held_out: cross_validation::check(&subject(from, uncertainty), config),
        outlier_segments: outlier_segments::find(
            observations,
            features,
            at,
            &fit.noise,
            config.offset_search_s,
        ),
        seam_error: None,
        held_sensor: None,
        instead_of_sensor: Vec::new(),
        held_off: Vec::new(),
        drawn_line_shifts: Vec::new(),
        better_without_drawing_m: None,
        cause: None,
        lens: None,
        robot_taken: from.robot_taken,
        robot_seems: from.robot_seems,
        feature_bias: None,
        seam_point_error: observability.shows_all().then(predict).flatten(),
    }
}

fn streams(from: &Concluded<'_>, repeated_features: usize) -> Streams {
    let robot = &from.assessed.drift_free.observations.robot;
    Streams {
        robot: from.sampling.robot.report(from.dejittered.robot),
        images: from.sampling.images.report(from.dejittered.images),
        robot_rows: from.recording.robot.len(),
        features: from.recording.features.len() - repeated_features,
        robot_noise_m: robot.recorded_noise_m,
        robot_poses_repeated: robot.repeated,
        robot_smoothed: robot.smoothed,
        origin_ns: origin_ns(from.recording),
        images_ahead_s: from.recording.images_ahead_ns as f64 * 1e-9,
    }
}

fn subject<'a>(from: &'a Concluded<'_>, real: &Uncertainty) -> Subject<'a> {
    let model = from.assessed.information.covariance();
    let inflation = |k: usize| {
        let ratio = real.covariance[(k, k)] / model[(k, k)];
        if ratio.is_finite() { ratio } else { 1.0 }
    };
    Subject {
        observations: &from.assessed.drift_free.observations,
        fit: &from.assessed.drift_free.fit,
        fixed: from.settings.fixed,
        rank_threshold: RANK_THRESHOLD,
        seen: &from.assessed.observability.observable_components,
        inflation: SVector::from_fn(|k, _| inflation(k)),
    }
}
