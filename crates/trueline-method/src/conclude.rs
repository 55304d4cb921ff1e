//! What a fit says: its findings and the verdict.

use crate::assess::cause_kind::CauseKind;
use crate::assess::convergence;
use crate::assess::corrected_sensor::CorrectedSensor;
use crate::assess::correlated_noise::Structure;
use crate::assess::cross_validation::{self, Subject};
use crate::assess::file_frame::{FileFrame, HandEyeOfFile, StatedSensor};
use crate::assess::instead_of_sensor::{self, InsteadOfSensor};
use crate::assess::misfit_cause::MisfitCause;
use crate::assess::misfit_patterns::Patterns;
use crate::assess::observability::{Group, Observability, RANK_THRESHOLD};
use crate::assess::profile_likelihood::{self, Widening};
use crate::assess::residuals::{self, FeatureResidual};
use crate::assess::robot_field::RobotSigmas;
use crate::assess::seam_error::{self, SeamError, SeamErrorSources};
use crate::assess::sensor_shape::SensorShape;
use crate::assess::systematic::{Systematic, SystematicLevels, SystematicSums};
use crate::assess::{outlier_segments, seam_point_error};
use crate::calibration::Calibration;
use crate::config::{HeldSigma, Measurements, ResidualKind};
use crate::error::Error;
use crate::findings::{Checks, ClockFindings, Findings, FitFindings, Streams, Unknowns};
use crate::hypotheses::ambiguity::Ambiguity;
use crate::hypotheses::clock_drift::DriftFree;
use crate::hypotheses::feature_bias::{FeatureBias, TakenBias};
use crate::hypotheses::search::{BetterMinimum, Mirrored};
use crate::hypotheses::unbiased::{Assessed, inflation};
use crate::input::observations::origin_ns;
use crate::input::shape_knowledge::ShapeKnowledge;
use crate::input::skip::Skip;
use crate::input::stops::Stops;
use crate::input::timestamps::{Dejittered, Sampling};
use crate::models::held::compare;
use crate::models::tried::ModelTried;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::{LINES, Parameters, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::solve::covariance::{self, Uncertainty};
use crate::solve::drawn_lines;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use crate::stripe::estimate::{self, SeamEstimate};
use crate::stripe::outcome::{Answer, StripeOutcome};
use crate::stripe::systematic::SharedErrors;
use crate::verdict;
use nalgebra::{DMatrix, SVector};
use trueline_dataset::{Recording, Sensor};

/// All that a calibration is concluded from.
pub(crate) struct Concluded<'a> {
    pub(crate) recording: &'a Recording,
    pub(crate) sampling: &'a Sampling,
    pub(crate) dejittered: Dejittered,
    pub(crate) settings: &'a FitSettings<'a>,
    pub(crate) knowledge: &'a ShapeKnowledge,
    pub(crate) mirrored: Mirrored,
    pub(crate) ambiguity: Ambiguity,
    pub(crate) better: Option<BetterMinimum>,
    pub(crate) assessed: &'a Assessed,
    pub(crate) levels: SystematicLevels,
    /// How far the robot was taken to be off.
    pub(crate) robot_taken: RobotSigmas,
    /// What its residuals show, where that is plainly worse.
    pub(crate) robot_seems: Option<RobotSigmas>,
    /// The bias that the features were freed of.
    pub(crate) bias: Option<TakenBias>,
    pub(crate) structure: Structure,
    pub(crate) cause: Option<MisfitCause>,
    pub(crate) time_offset_share: f64,
    /// The same scan with the sensor and the lines released, where they are held.
    pub(crate) released: Option<&'a Calibration>,
}

impl Concluded<'_> {
    fn inflation(&self) -> f64 {
        inflation(&self.structure, &self.assessed.information)
    }
}

/// Everything that is said of a fit.
///
/// # Errors
/// Stripes that are asked for and cannot be used.
pub(crate) fn conclude(from: &Concluded<'_>) -> Result<Calibration, Error> {
    let (config, fit, observations) =
        (from.settings.config, &from.assessed.drift_free.fit, &from.assessed.drift_free.observations);
    let problem = fit.problem(observations, config);
    let (uncertainty, widening) = by_noise(from, &problem);
    let root = from.assessed.information.covariance_root();
    let sums = SystematicSums::of(&problem, fit.parameters(), root, &from.levels);
    let systematic = sums.systematic(&from.levels, from.inflation()).with_held(
        &fit.solution.equations.hessian,
        root,
        &held_sigmas(from.settings),
    );
    let mut unknowns = unknowns(from, &uncertainty, &systematic);
    let covariance = &unknowns.covariance;
    unknowns.sensor =
        unknowns.sensor.map(|shape| shape.beside(from.cause.as_ref(), &unknowns.parameters, covariance));
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
    let stamp_of = |f: &FeatureResidual| from.recording.features[f.row as usize].stamp_ns;
    let is_stated = from.recording.setup.uncertainty.is_some();
    let findings = Findings {
        unknowns,
        fit: FitFindings {
            residuals: residuals::summarise(&features, skipped),
            feature_stamps_ns: features.iter().map(stamp_of).collect(),
            noise_factor: fit.noise.factor,
            structure: from.structure.clone(),
            widened_by: widening.map(|widening| widening.by),
            covariance_model_share: uncertainty.model_share,
            termination: fit.solution.termination,
            iterations: convergence::steps(&fit.iterations, observations, &features),
            sheet_fit_rms_m: observations.sheet_fit_rms_m,
            features,
        },
        checks,
        clock: clock(&from.assessed.drift_free),
        streams,
        stripes: None,
        stops: config.at_stops.then_some(Stops::Stated),
        sensor_of_its_own_scan: false,
        uncertainty_ignored: is_stated && config.residual == ResidualKind::PointToLine,
        inputs: from.recording.inputs.clone(),
        config: config.clone(),
        models_tried: vec![ModelTried::asked(from.settings, &from.levels, &from.assessed.drift_free)],
    };
    let errors = SeamErrors { sums: &sums, systematic: &systematic, noise: &uncertainty.covariance };
    judged(from, findings, &errors)
}

/// What may be there in place of a sensor that seems off, where no cause is known.
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

/// What the estimate from seam points owes to noise and to errors that are no noise.
struct SeamErrors<'a> {
    sums: &'a SystematicSums,
    systematic: &'a Systematic,
    noise: &'a DMatrix<f64>,
}

/// With what the stripes say, and the verdict.
fn judged(
    from: &Concluded<'_>,
    mut findings: Findings,
    errors: &SeamErrors<'_>,
) -> Result<Calibration, Error> {
    add_stripes(from, &mut findings, errors)?;
    // What fits no better when released tells nothing of what was held.
    if let Some(released) =
        from.released.filter(|released| !verdict::residuals_are_too_large(&released.findings))
    {
        compare(&findings.config, &mut findings.checks, released);
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
        systematic: errors.systematic,
        shared: SharedErrors {
            levels: from.levels,
            field: errors.sums.field.as_ref(),
            tilt: errors.sums.tilt,
            bias: errors.sums.bias_error(&from.levels, from.inflation()),
        },
        bias: from.bias.as_ref(),
        held_sigmas: &held_sigmas(from.settings),
        robot_taken: from.robot_seems.map(|_| from.robot_taken),
        widened: &|covariance| with_time_offset_widened(from, covariance),
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

/// An answer without what it says of the sensor.
struct Answered {
    parameters: Parameters,
    covariance: DMatrix<f64>,
    noise_covariance: DMatrix<f64>,
    observability: Observability,
}

/// With what it says of the sensor; the transform is that of the stated file.
fn with_sensor(from: &Concluded<'_>, answered: Answered) -> Unknowns {
    let Answered { parameters, covariance, noise_covariance, observability } = answered;
    let observations = &from.assessed.drift_free.observations;
    let shows_hand_eye = observability.shows_hand_eye();
    // A transform that is held is what the user stated of his file.
    let is_held = from.settings.fixed.iter().any(|k| (ROTATION..LINES).contains(k));
    let stated = StatedSensor::of(observations, &parameters).filter(|_| shows_hand_eye && !is_held);
    let frame = stated.as_ref().map_or_else(FileFrame::of_estimate, |stated| stated.frame);
    Unknowns {
        estimated: (0..parameters.dimension()).map(|k| !from.settings.fixed.contains(&k)).collect(),
        sensor: SensorShape::of(from.recording, &parameters, &covariance, from.knowledge),
        corrected: CorrectedSensor::of(from.recording, observations, &parameters, &covariance)
            .filter(|_| shows_hand_eye),
        stated,
        written: None,
        of_file: HandEyeOfFile::of(frame, &parameters, &covariance, &noise_covariance),
        parameters,
        covariance,
        noise_covariance,
        observability,
        held_at_guess: false,
        has_time_offset: !from.settings.config.at_stops,
    }
}

fn unknowns(from: &Concluded<'_>, uncertainty: &Uncertainty, systematic: &Systematic) -> Unknowns {
    let noise_covariance = with_time_offset_widened(from, uncertainty.covariance.clone());
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

/// The components that are held and not known exactly, each with its standard deviation, SI.
fn held_sigmas(settings: &FitSettings<'_>) -> Vec<(usize, f64)> {
    let HeldSigma { time_s, rotation_rad, translation_m } = settings.config.held_sigma;
    let stated = |component: &usize| match *component {
        TIME_OFFSET => time_s,
        ROTATION..TRANSLATION => rotation_rad,
        TRANSLATION..LINES => translation_m,
        _ => None,
    };
    let of_groups = settings.fixed.iter().filter_map(|component| Some((*component, stated(component)?)));
    of_groups.chain(drawn_lines::sigmas(&settings.config.drawn_lines)).collect()
}

fn seam_error(from: &Concluded<'_>, uncertainty: &Uncertainty, systematic: &Systematic) -> Option<SeamError> {
    let (fit, observations) = (&from.assessed.drift_free.fit, &from.assessed.drift_free.observations);
    let sources = SeamErrorSources {
        hessian: &fit.solution.equations.hessian,
        fixed: from.settings.fixed,
        noise: &uncertainty.covariance,
        stamps_variance_s2: {
            let widened = with_time_offset_widened(from, uncertainty.covariance.clone());
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

/// What the residuals cannot tell of the time offset: noise in its column, and what the stamps leave unsaid.
fn with_time_offset_widened(from: &Concluded<'_>, mut covariance: DMatrix<f64>) -> DMatrix<f64> {
    if from.settings.fixed.contains(&TIME_OFFSET) {
        return covariance;
    }
    // Noise in its column makes it look better known than it is, and with it all that goes with it: of a share s the optimum's
    // variance is that of the gradient, 1, over the square of the curvature that motion gives, s².
    let variance = covariance[(TIME_OFFSET, TIME_OFFSET)];
    if from.time_offset_share < 1.0 && variance > 0.0 {
        let along = covariance.column(TIME_OFFSET).into_owned();
        covariance.ger((from.time_offset_share.powi(-2) - 1.0) / variance, &along, &along, 1.0);
    }
    let late_sigma_s = from.assessed.drift_free.observations.robot.late_sigma_s;
    let stamps_sigma_s = from.sampling.phase_sigma_s(from.dejittered).hypot(late_sigma_s);
    covariance[(TIME_OFFSET, TIME_OFFSET)] += stamps_sigma_s.powi(2);
    covariance
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
