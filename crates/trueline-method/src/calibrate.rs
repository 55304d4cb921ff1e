//! The recipe: a recording in, a calibration out.

use crate::assess::convergence::without_outliers;
use crate::assess::corrected_sensor::CorrectedSensor;
use crate::assess::correlated_noise::Structure;
use crate::assess::cross_validation::{self, Subject};
use crate::assess::identifiability::{Identifiability, assess_identifiability};
use crate::assess::misfit_cause::{self, CauseKind, MisfitCause};
use crate::assess::observability::RANK_THRESHOLD;
use crate::assess::residuals::{self, FeatureResidual};
use crate::assess::seam_error::{self, SeamError, SeamErrorSources};
use crate::assess::sensor_shape::SensorShape;
use crate::assess::systematic::{Systematic, SystematicLevels, SystematicSums};
use crate::calibration::Calibration;
use crate::config::{
    ASSUMED_ROBOT_ACCURACY_M, Config, HeldSigma, Hold, Measurements, ResidualKind, SensorMode,
};
use crate::error::Error;
use crate::findings::{Checks, ClockFindings, Findings, FitFindings, Streams, Unknowns};
use crate::hypotheses::ambiguity::Ambiguity;
use crate::hypotheses::clock_drift::{DriftFree, remove_drift};
use crate::hypotheses::feature_bias::{FeatureBias, TakenBias};
use crate::hypotheses::search::Mirrored;
use crate::hypotheses::timestamp_selection::{Stamped, with_best_stamps};
use crate::hypotheses::unbiased::{Shown, Unbiased, inflation, without_bias};
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{Observations, observe, origin_ns};
use crate::input::shape_knowledge::ShapeKnowledge;
use crate::input::skip::Skip;
use crate::input::timestamps::{Dejittered, Sampling};
use crate::problem::parameters::{LINES, Parameters, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::solve::covariance::{self, Uncertainty};
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use crate::stripe::corners::with_corners;
use crate::stripe::estimate::{self, SeamEstimate};
use crate::stripe::outcome::{Answer, StripeOutcome};
use crate::verdict;
use crate::{assess::outlier_segments, assess::seam_point_error, hypotheses::search};
use nalgebra::{DMatrix, SVector};
use trueline_dataset::{Guess, Recording};

/// Estimates time offset, hand-eye transform and lines from a recording.
///
/// `guess` is where to start; without it the start is found from nothing.
///
/// # Errors
/// [`Error`] if there is no estimate at all. A doubtful one is a [`Calibration`] that is not accepted.
pub fn calibrate(
    recording: &Recording,
    guess: Option<&Guess>,
    config: &Config,
) -> Result<Calibration, Error> {
    let cornered = with_corners(recording);
    let recording = cornered.as_ref().unwrap_or(recording);
    let sampling = Sampling::of(recording, origin_ns(recording));
    let observations = observe(recording, &sampling, config)?;
    check_overlap(&observations, config)?;
    let fixed = held_components(config, guess)?;
    let noise = NoiseLevels {
        robot_sigma_m: config.robot_sigma_m.unwrap_or(observations.robot.noise_m),
        stamp_sigma_s: sampling.stamp_sigma_s(config, Dejittered::default()),
        factor: 1.0,
    };
    let knowledge = ShapeKnowledge::of(recording, &observations);
    let shape_prior = knowledge.prior(config);
    let settings = FitSettings { config, noise, fixed: &fixed, prior: None, shape_prior };
    let found = search::find(&Solver { observations: &observations, settings }, guess)?;
    let recorded = Stamped { observations, fit: found.fit, dejittered: Dejittered::default() };
    let stamped = with_best_stamps(recording, &sampling, &settings, recorded)?;
    let noise =
        NoiseLevels { stamp_sigma_s: sampling.stamp_sigma_s(config, stamped.dejittered), ..settings.noise };
    let settings = FitSettings { noise, ..settings };
    let rate_sigma_ppm = sampling.rate_sigma_ppm(stamped.dejittered);
    let steady = remove_drift(stamped.observations, stamped.fit, &settings, rate_sigma_ppm)?;
    let times_s = sampling.robot_times_s(stamped.dejittered);
    let halves = steady.observations.robot.halves(recording, times_s);
    let Identifiability { fit, information, time_offset_share, observability } =
        assess_identifiability(&steady, &settings, guess, found.mirrored, halves.as_ref())?;
    let levels = systematic_levels(recording, &settings, &knowledge);
    let shown = Shown { steady: DriftFree { fit, ..steady }, information, observability };
    let Unbiased { mut shown, structure, cause, bias } = without_bias(shown, recording, &settings, &levels)?;
    if let Structure::Correlated(noise) = &structure {
        shown.steady.fit.solution.state = noise.at.clone();
    }
    conclude(&Concluded {
        recording,
        sampling: &sampling,
        dejittered: stamped.dejittered,
        settings: &settings,
        knowledge: &knowledge,
        mirrored: found.mirrored,
        ambiguity: found.ambiguity,
        better: found.better,
        levels: bias.map_or(levels, |bias| SystematicLevels { bias_is_estimated: true, ..bias.levels }),
        bias,
        shown: &shown,
        structure,
        cause,
        time_offset_share,
    })
}

/// All that a calibration is concluded from.
struct Concluded<'a> {
    recording: &'a Recording,
    sampling: &'a Sampling,
    dejittered: Dejittered,
    settings: &'a FitSettings<'a>,
    knowledge: &'a ShapeKnowledge,
    mirrored: Mirrored,
    ambiguity: Ambiguity,
    better: Option<Parameters>,
    shown: &'a Shown,
    levels: SystematicLevels,
    /// The bias that the features were freed of.
    bias: Option<TakenBias>,
    structure: Structure,
    cause: Option<MisfitCause>,
    time_offset_share: f64,
}

impl Concluded<'_> {
    fn inflation(&self) -> f64 {
        inflation(&self.structure, &self.shown.information)
    }
}

fn conclude(from: &Concluded<'_>) -> Result<Calibration, Error> {
    let (config, fit, observations) =
        (from.settings.config, &from.shown.steady.fit, &from.shown.steady.observations);
    let problem = fit.problem(observations, config);
    let mut uncertainty = covariance::assess(&problem, fit.parameters(), &fit.noise, &from.shown.information);
    if let Structure::Correlated(noise) = &from.structure {
        uncertainty.covariance = noise.covariance.clone();
    }
    let root = from.shown.information.covariance_root();
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
    let mut checks = checks(from, &uncertainty, &unknowns, &features);
    if from.shown.all_observable() {
        checks.seam_error = seam_error(from, &uncertainty, &systematic);
    }
    checks.held_sensor = held_sensor(from);
    checks.cause = from.cause.clone();
    checks.feature_bias = from.bias.and_then(|taken| {
        let estimate = sums.bias(&taken.px, from.inflation())?;
        Some(FeatureBias::new(&estimate, taken.is_plain))
    });
    let streams = streams(from, skipped.get(&Skip::Repeated).copied().unwrap_or(0));
    let stamp_of = |f: &FeatureResidual| from.recording.features[f.row as usize].stamp_ns;
    let setup = &from.recording.setup;
    let findings = Findings {
        unknowns,
        fit: FitFindings {
            residuals: residuals::summarise(&features, skipped),
            feature_stamps_ns: features.iter().map(stamp_of).collect(),
            noise_factor: fit.noise.factor,
            structure: from.structure.clone(),
            covariance_model_share: uncertainty.model_share,
            termination: fit.solution.termination,
            iterations: without_outliers(fit.iterations.clone(), observations, &features),
            sheet_fit_rms_m: observations.sheet_fit_rms_m,
            features,
        },
        checks,
        clock: ClockFindings {
            drift: from.shown.steady.drift,
            drifted: from.shown.steady.drifted,
            step: from.shown.steady.step,
            stepped: from.shown.steady.stepped,
        },
        streams,
        stripes: None,
        uncertainty_ignored: setup.uncertainty.is_some() && config.residual == ResidualKind::PointToLine,
        inputs: from.recording.inputs.clone(),
        config: config.clone(),
    };
    judged(from, findings)
}

/// With what the stripes say, and the verdict.
fn judged(from: &Concluded<'_>, mut findings: Findings) -> Result<Calibration, Error> {
    add_stripes(from, &mut findings)?;
    let verdict = verdict::of(&findings);
    Ok(Calibration { findings, verdict })
}

/// Looks at whole stripes, and takes their answer where it is the one that is used. The residuals of the seam points stay those about
/// their own seam: on bent plates their crossing is no point of it.
fn add_stripes(from: &Concluded<'_>, findings: &mut Findings) -> Result<(), Error> {
    let robot_times_s = from.sampling.robot_times_s(from.dejittered);
    let unknowns = &findings.unknowns;
    findings.stripes = estimate::estimate(&SeamEstimate {
        recording: from.recording,
        observations: &from.shown.steady.observations,
        robot_times_s,
        settings: from.settings,
        fit: &from.shown.steady.fit,
        answer: Answer {
            parameters: unknowns.parameters.clone(),
            covariance: unknowns.covariance.clone(),
            noise_covariance: unknowns.noise_covariance.clone(),
            observability: unknowns.observability.clone(),
            seam_error: findings.checks.seam_error,
        },
        levels: from.levels,
        held_sigmas: &held_sigmas(from.settings),
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
    let (config, fit, observations) =
        (from.settings.config, &from.shown.steady.fit, &from.shown.steady.observations);
    let all_seen = observability.observable_components[..LINES].iter().all(|seen| *seen);
    let list = fit.placed.of(observations);
    let torch = || seam_point_error::predict(observations, list, &parameters, &covariance, &config.used_at);
    findings.checks.at_torch = all_seen.then(torch).flatten();
    findings.checks.seam_error = seam_error;
    findings.unknowns = Unknowns {
        estimated: (0..parameters.dimension()).map(|k| !from.settings.fixed.contains(&k)).collect(),
        sensor: SensorShape::of(from.recording, &parameters, &covariance, from.knowledge),
        corrected: CorrectedSensor::of(from.recording, observations, &parameters),
        parameters,
        covariance,
        noise_covariance,
        observability,
        held_at_guess: false,
    };
    Ok(())
}

fn unknowns(from: &Concluded<'_>, uncertainty: &Uncertainty, systematic: &Systematic) -> Unknowns {
    let parameters = from.shown.steady.fit.parameters().clone();
    let noise_covariance = with_time_offset_widened(from, uncertainty.covariance.clone());
    let covariance = &noise_covariance + systematic.covariance();
    Unknowns {
        estimated: (0..parameters.dimension()).map(|k| !from.settings.fixed.contains(&k)).collect(),
        sensor: SensorShape::of(from.recording, &parameters, &covariance, from.knowledge),
        corrected: CorrectedSensor::of(from.recording, &from.shown.steady.observations, &parameters),
        parameters,
        covariance,
        noise_covariance,
        observability: from.shown.observability.clone(),
        held_at_guess: from.shown.steady.fit.prior.is_some(),
    }
}

/// What the shape of a sensor would be that was held; `None` where it was estimated.
fn held_sensor(from: &Concluded<'_>) -> Option<SensorShape> {
    let settings = from.settings;
    if settings.shape_prior.is_some() || !from.shown.all_observable() {
        return None;
    }
    let shape_prior = from.knowledge.prior_in(SensorMode::Prior, settings.config.residual);
    let observations = &from.shown.steady.observations;
    let solver = Solver { observations, settings: FitSettings { shape_prior, ..*settings } };
    let fit = shape_prior.and_then(|_| solver.refit(&from.shown.steady.fit).ok())?;
    let information = fit.information(settings.fixed, RANK_THRESHOLD)?;
    let problem = fit.problem(observations, settings.config);
    let root = information.covariance_root();
    let (at, noise) = match Structure::of(&problem, fit.parameters(), root) {
        Structure::Correlated(noise) => (noise.at.clone(), noise.covariance.clone()),
        _ => {
            let noise = covariance::assess(&problem, fit.parameters(), &fit.noise, &information);
            (fit.parameters().clone(), noise.covariance)
        }
    };
    let levels = SystematicLevels { held_shape: None, ..from.levels };
    let systematic = SystematicSums::of(&problem, fit.parameters(), root, &levels).with_bias_held();
    let covariance = noise + systematic.covariance();
    let cause = misfit_cause::find(from.recording, &problem, fit.parameters(), root)
        .filter(|cause| cause.kind != CauseKind::TiltBias);
    let shape = SensorShape::of(from.recording, &at, &covariance, from.knowledge)?;
    Some(shape.beside(cause.as_ref(), &at, &covariance))
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
    settings.fixed.iter().filter_map(|component| Some((*component, stated(component)?))).collect()
}

/// How large the errors that are no noise are taken to be.
fn systematic_levels(
    recording: &Recording,
    settings: &FitSettings<'_>,
    knowledge: &ShapeKnowledge,
) -> SystematicLevels {
    let config = settings.config;
    let stated = recording.setup.robot_accuracy_m;
    // A sensor that is held is still only as good as its file says, or as such sensors are.
    let is_held = settings.shape_prior.is_none();
    let is_doubted = knowledge.stated || config.sensor != SensorMode::Fixed;
    SystematicLevels {
        robot_accuracy_m: config.robot_accuracy_m.or(stated).unwrap_or(ASSUMED_ROBOT_ACCURACY_M),
        robot_is_stated: config.robot_accuracy_m.or(stated).is_some(),
        feature_bias_px: config.feature_bias_px,
        bias_is_estimated: false,
        held_shape: (is_held && is_doubted).then_some(knowledge.covariance),
    }
}

fn seam_error(from: &Concluded<'_>, uncertainty: &Uncertainty, systematic: &Systematic) -> Option<SeamError> {
    let (fit, observations) = (&from.shown.steady.fit, &from.shown.steady.observations);
    let sources = SeamErrorSources {
        hessian: &fit.solution.equations.hessian,
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
        (from.settings.config, &from.shown.steady.fit, &from.shown.steady.observations);
    let at = &unknowns.parameters;
    let list = fit.placed.of(observations);
    let predict = || seam_point_error::predict(observations, list, at, &unknowns.covariance, &config.used_at);
    Checks {
        mirrored: from.mirrored,
        ambiguity: from.ambiguity.clone(),
        better_time_offset_s: from.better.as_ref().map(|better| better.time_offset_s),
        held_out: cross_validation::check(&subject(from, uncertainty), config),
        disruptions: outlier_segments::find(observations, features, at, &fit.noise, config.offset_search_s),
        seam_error: None,
        held_sensor: None,
        cause: None,
        feature_bias: None,
        at_torch: from.shown.all_observable().then(predict).flatten(),
    }
}

fn streams(from: &Concluded<'_>, repeated_features: usize) -> Streams {
    let robot = &from.shown.steady.observations.robot;
    Streams {
        robot: from.sampling.robot.report(from.dejittered.robot),
        images: from.sampling.images.report(from.dejittered.images),
        robot_rows: from.recording.robot.len(),
        features: from.recording.features.len() - repeated_features,
        robot_noise_m: robot.recorded_noise_m,
        robot_poses_repeated: robot.repeated,
        robot_smoothed: robot.smoothed,
        origin_ns: origin_ns(from.recording),
    }
}

/// What the residuals cannot tell of the time offset: noise in its column, and what the stamps leave unsaid.
fn with_time_offset_widened(from: &Concluded<'_>, mut covariance: DMatrix<f64>) -> DMatrix<f64> {
    // Noise in its column makes it look better known than it is.
    let widen = from.time_offset_share.sqrt().recip();
    covariance.row_mut(TIME_OFFSET).scale_mut(widen);
    covariance.column_mut(TIME_OFFSET).scale_mut(widen);
    let late_sigma_s = from.shown.steady.observations.robot.late_sigma_s;
    let stamps_sigma_s = from.sampling.phase_sigma_s(from.dejittered).hypot(late_sigma_s);
    covariance[(TIME_OFFSET, TIME_OFFSET)] += stamps_sigma_s.powi(2);
    covariance
}

fn subject<'a>(from: &'a Concluded<'_>, real: &Uncertainty) -> Subject<'a> {
    let model = from.shown.information.covariance();
    let inflation = |k: usize| {
        let ratio = real.covariance[(k, k)] / model[(k, k)];
        if ratio.is_finite() { ratio } else { 1.0 }
    };
    Subject {
        observations: &from.shown.steady.observations,
        fit: &from.shown.steady.fit,
        fixed: from.settings.fixed,
        rank_threshold: RANK_THRESHOLD,
        seen: &from.shown.observability.observable_components,
        inflation: SVector::from_fn(|k, _| inflation(k)),
    }
}

fn check_overlap(observations: &Observations, config: &Config) -> Result<(), Error> {
    let (robot_start_s, robot_end_s) = observations.robot.trajectory.span();
    let stamps = || observations.list.iter().map(|o| o.stamp_s);
    let image_start_s = stamps().fold(f64::INFINITY, f64::min);
    let image_end_s = stamps().fold(f64::NEG_INFINITY, f64::max);
    let margin = config.offset_search_s;
    if image_start_s - margin > robot_end_s || image_end_s + margin < robot_start_s {
        return Err(Error::NoOverlap { robot_start_s, robot_end_s, image_start_s, image_end_s });
    }
    Ok(())
}

fn held_components(config: &Config, guess: Option<&Guess>) -> Result<Vec<usize>, Error> {
    let mut fixed = Vec::new();
    for hold in &config.hold {
        if guess.is_none() {
            return Err(Error::NothingToHold { held: hold.name() });
        }
        match hold {
            Hold::TimeOffset => fixed.push(TIME_OFFSET),
            Hold::HandEye => fixed.extend(ROTATION..LINES),
        }
    }
    Ok(fixed)
}
