//! Findings of the fit that treats all residuals as noise.

use crate::assess::cause_kind::CauseKind;
use crate::assess::confounded_causes::{self, ConfoundedCause};
use crate::assess::correlated_noise::Structure;
use crate::assess::cross_validation::{self, Subject};
use crate::assess::misfit_patterns::Patterns;
use crate::assess::observability::{Group, RANK_THRESHOLD};
use crate::assess::profile_likelihood::{self, Widening};
use crate::assess::residuals::{self, FeatureResidual, ResidualSummary};
use crate::assess::robot_field::{OfRobot, RobotField};
use crate::assess::seam_error::{self, SeamError, SeamErrorSources};
use crate::assess::sensor_shape::SensorShape;
use crate::assess::systematic::{Systematic, SystematicSums};
use crate::assess::{convergence, outlier_segments, seam_point_error};
use crate::axes::finding as axes;
use crate::calibrate::answered::{Answered, beside_cause, with_sensor};
use crate::calibrate::asked::asked;
use crate::calibrate::concluded::Concluded;
use crate::findings::{Checks, ClockFindings, Findings, FitFindings, Streams, Unknowns};
use crate::hypotheses::clock_drift::DriftFree;
use crate::hypotheses::feature_bias::FeatureBias;
use crate::input::observations::origin_ns;
use crate::input::skip::Skip;
use crate::input::stops::Stops;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::TIME_OFFSET;
use crate::solve::covariance::{self, Uncertainty};
use crate::solve::solver::Solver;
use nalgebra::{DMatrix, SVector};
use trueline_dataset::Sensor;

/// The findings of the fit that treats all residuals as noise, and the errors of its answer.
pub(crate) struct NoiseAlone {
    /// The findings.
    pub findings: Findings,
    /// Effect of each systematic error on the fit.
    pub sums: SystematicSums,
    /// Systematic errors of the answer.
    pub systematic: Systematic,
    /// Covariance from noise.
    pub noise: DMatrix<f64>,
}

/// Concludes from the fit that treats all residuals as noise.
pub(crate) fn of(from: &Concluded<'_>, problem: &LineProblem<'_>) -> NoiseAlone {
    let (config, fit) = (from.settings.config, &from.assessed.drift_free.fit);
    let (uncertainty, widening) = by_noise(from, problem);
    let root = from.assessed.information.covariance_root();
    let sums = SystematicSums::of(problem, fit.parameters(), root, &from.levels);
    let systematic = sums.systematic(&from.levels, from.inflation()).with_held(
        &fit.solution.equations.hessian,
        root,
        &from.held_sigmas(),
    );
    let of_robot = |field: &RobotField| OfRobot { field: field.clone(), columns: systematic.robot.clone() };
    let of_robot = sums.field.as_ref().map(of_robot);
    let mut unknowns = unknowns(from, &uncertainty, &systematic, of_robot);
    unknowns.sensor = beside_cause(from, &unknowns);
    let (features, skipped) = residuals::evaluate(problem, fit.parameters());
    if features.is_empty() {
        unknowns = unknowns.of_no_feature();
    }
    let mut checks = checks(from, &uncertainty, &unknowns, &features);
    if unknowns.observability.shows_all() {
        checks.seam_error = seam_error(from, &uncertainty, &systematic);
    }
    checks.cause = from.cause.clone();
    checks.confounded_causes = confounded_causes(from, problem, &unknowns);
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
        models_tried: vec![asked(from.settings, &from.levels, &from.assessed.drift_free)],
    };
    NoiseAlone { findings, sums, systematic, noise: uncertainty.covariance }
}

/// Residuals, noise and convergence of that fit.
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
fn confounded_causes(
    from: &Concluded<'_>,
    problem: &LineProblem<'_>,
    unknowns: &Unknowns,
) -> Vec<ConfoundedCause> {
    let is_open =
        |shape: &SensorShape| shape.is_off() && from.cause.is_none() && from.assessed.all_observable();
    let Some(shape) = unknowns.sensor.filter(is_open) else { return Vec::new() };
    let at = &unknowns.parameters;
    let patterns = Patterns::of(from.recording, problem, at, from.assessed.information.covariance_root());
    let mut instead = confounded_causes::find(&patterns, &shape, at, &unknowns.covariance);
    // A bias with opposite signs in the two halves of a picture needs a picture.
    let has_picture = matches!(from.recording.sensor, Sensor::CameraLaser { .. });
    instead.retain(|cause| has_picture || cause.kind != CauseKind::SideBias);
    instead
}

/// Covariance from noise, widened where the likelihood is not quadratic.
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

fn unknowns(
    from: &Concluded<'_>,
    uncertainty: &Uncertainty,
    systematic: &Systematic,
    of_robot: Option<OfRobot>,
) -> Unknowns {
    let noise_covariance = from.with_time_offset_widened(uncertainty.covariance.clone());
    let covariance = &noise_covariance + systematic.covariance();
    let answered = Answered {
        parameters: from.assessed.drift_free.fit.parameters().clone(),
        observability: from.assessed.observability.clone().bounded(&covariance),
        covariance,
        noise_covariance,
        of_robot,
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
        // If a scan determines neither time offset nor rotation, its rival answers are meaningless.
        ambiguity: if [Group::TimeOffset, Group::Rotation].iter().any(|group| observability.shows(*group)) {
            from.ambiguity.clone()
        } else {
            from.ambiguity.without_rivals()
        },
        better: from.better.clone(),
        held_out: cross_validation::check(&subject(from, uncertainty), config),
        outlier_segments: outlier_segments::find(
            observations,
            features,
            at,
            &fit.noise,
            config.offset_search_s,
        ),
        part_moved_m: None,
        seam_error: None,
        held_sensor: None,
        confounded_causes: Vec::new(),
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
