//! The recipe: a recording in, a calibration out.

mod about_axes;
mod adjusted;
mod answered;
mod asked;
mod basins;
mod clamped;
mod conclude;
mod concluded;
mod curved;
mod held;
pub(crate) mod identifiability;
mod in_common;
mod lagging;
mod lens;
mod noise_alone;
mod with_stripes;

use crate::assess::correlated_noise::Structure;
use crate::assess::excitation;
use crate::assess::levels::SystematicLevels;
use crate::assess::robot_accuracy;
use crate::assess::robot_field::RobotSigmas;
use crate::calibrate::about_axes::calibrated;
use crate::calibrate::conclude::conclude;
use crate::calibrate::concluded::Concluded;

use crate::calibrate::held::{all_released, freed, held_sensor, released};
use crate::calibrate::identifiability::{Identifiability, assess_identifiability};
use crate::calibration::Calibration;
use crate::config::{Config, Hold, SensorMode, Target};
use crate::curve::cad::checked;
use crate::error::Error;
use crate::hypotheses::clock_drift::{DriftFree, remove_drift};
use crate::hypotheses::search;
use crate::hypotheses::timestamp_selection::{Stamped, with_best_stamps};
use crate::hypotheses::unbiased::{Assessed, Unbiased, without_bias};
use crate::input::feature_noise;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{MIN_IMAGES, Observations, observe_by, origin_ns};
use crate::input::shape_knowledge::ShapeKnowledge;
use crate::input::stops;
use crate::input::timestamps::Sampling;
use crate::models::{Because, beside};
use crate::problem::parameters::{LINES, ROTATION, TIME_OFFSET};
use crate::solve::drawn_lines;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use crate::stripe::corners::with_corners;
use tracing::field;
use trueline_dataset::{Guess, Recording};
use trueline_geometry::Trajectory;

/// Estimates time offset, hand-eye transform and lines from a recording.
///
/// `guess` is the start. Without it the start is found from the data. If the robot stands at each reading there is no time offset, and its guess is
/// ignored.
///
/// # Errors
/// [`Error`] if there is no estimate at all. A doubtful estimate is a [`Calibration`] that is not accepted.
pub fn calibrate(
    recording: &Recording,
    guess: Option<&Guess>,
    config: &Config,
) -> Result<Calibration, Error> {
    let span = tracing::info_span!("calibrate", steps = field::Empty, status = field::Empty);
    let calibration = span.in_scope(|| estimate(recording, guess, config));
    if let Ok(calibration) = &calibration {
        span.record("steps", calibration.findings.fit.iterations.len());
        span.record("status", field::debug(calibration.status()));
    }
    calibration
}

/// The same as part of a larger computation: one trial of many, or a repeated estimate during a scan.
///
/// # Errors
/// Those of [`calibrate`].
pub(crate) fn estimate(
    recording: &Recording,
    guess: Option<&Guess>,
    config: &Config,
) -> Result<Calibration, Error> {
    if let Some(cad) = &config.seam_cad {
        checked(cad)?;
    }
    if !recording.axes.is_empty() {
        return with_axes(recording, guess, config);
    }
    let Some((by_stops, stops)) = stops::of(recording, config)? else {
        let over_lines = |config: &Config| over_time(recording, guess, config);
        return curved::answered(recording, guess, config, &over_lines);
    };
    if config.asks_for_curve() {
        return Err(Error::NoCurve { why: curved::AT_STOPS });
    }
    let guess = guess.map(stops::guess);
    let answer = over_time(&by_stops, guess.as_ref(), &stops::options(config))?.at_stops(stops);
    let is_line = config.target == Target::Line;
    Ok(if is_line { answer } else { curved::untried(answer, curved::AT_STOPS) })
}

/// The same in a cell with external axes. A robot that stands at each reading is not detected here, because the axes may move.
fn with_axes(recording: &Recording, guess: Option<&Guess>, config: &Config) -> Result<Calibration, Error> {
    let is_stated = recording.at_stops || config.at_stops;
    let stops = if is_stated { stops::of(recording, config)? } else { None };
    let Some((by_stops, stops)) = stops else {
        return calibrated(recording, config, &|placed, config| over_time(placed, guess, config));
    };
    let guess = guess.map(stops::guess);
    let options = stops::options(config);
    let found = calibrated(&by_stops, &options, &|placed, config| over_time(placed, guess.as_ref(), config));
    Ok(found?.at_stops(stops))
}

/// The same as a function of the recording's time stamps.
fn over_time(recording: &Recording, guess: Option<&Guess>, config: &Config) -> Result<Calibration, Error> {
    if config.sensor == SensorMode::Prior && recording.is_in_its_sensors_uncertainty() {
        // The shape was estimated from this scan. The optimum with the shape held is therefore the joint one, and the shape's covariance completes
        // the uncertainties.
        let held = Config { sensor: SensorMode::Fixed, ..config.clone() };
        return Ok(over_time(recording, guess, &held)?.with_sensor_of_its_own_scan());
    }
    let test = released_of(recording, guess, config);
    let as_stated = with_stated_lens(recording, guess, config, test.as_ref())?;
    if released(config, recording).is_some() {
        return Ok(with_models_of(as_stated, test.as_ref()));
    }
    let as_stated = with_models_of(as_stated, test.as_ref());
    // An adjusted answer estimates a sensor that is further off than its file states. The warning reports by how much.
    let is_adjusted = as_stated.findings.fit.amplitudes.is_some();
    let freed = freed(config, &as_stated).filter(|_| !is_adjusted);
    let freed = freed.and_then(|freed| over_time(recording, guess, &freed).ok());
    if freed.as_ref().is_some_and(|freed| held_sensor(config, freed).is_some_and(|shape| shape.is_off())) {
        let stated = with_stated_lens(recording, guess, config, freed.as_ref())?;
        return Ok(with_models_of(stated, freed.as_ref()));
    }
    let as_stated = with_models_of(as_stated, freed.as_ref());
    lens::corrected(as_stated, recording, |with_lens, guess| {
        with_stated_lens(with_lens, Some(guess), config, None)
    })
}

/// The same scan with the held quantities released; `None` if there are none. A release of --fix is used only if the scan determines
/// everything without it.
fn released_of(recording: &Recording, guess: Option<&Guess>, config: &Config) -> Option<Calibration> {
    // A calibration of the released options releases nothing further.
    let with = |config: Config| over_time(recording, guess, &config).ok();
    let shows_all = |found: &Calibration| found.findings.unknowns.observability.shows_all();
    let all = all_released(config, recording).and_then(with).filter(shows_all);
    all.or_else(|| released(config, recording).and_then(with))
}

/// With the models of a calibration that tested held quantities.
fn with_models_of(mut answer: Calibration, test: Option<&Calibration>) -> Calibration {
    let models = test.map_or(&[][..], |test| &test.findings.models_tried);
    answer.findings.models_tried.extend(beside(models, Because::TestsWhatIsHeld));
    answer
}

fn with_stated_lens(
    recording: &Recording,
    guess: Option<&Guess>,
    config: &Config,
    released: Option<&Calibration>,
) -> Result<Calibration, Error> {
    let cornered = cornered(recording)?;
    let recording = cornered.as_ref().unwrap_or(recording);
    let sampling = Sampling::of(recording, origin_ns(recording));
    feature_noise::check(recording, config).map_err(|why| Error::FeatureNoiseUnused { why })?;
    let dejittered = sampling.of_arrival(config);
    let observations = observe_by(dejittered, recording, &sampling, config)?;
    check_overlap(&observations, config)?;
    let fixed = held_components(config, guess)?;
    let robot_sigma_m = config.robot_sigma_m.unwrap_or(observations.robot.noise_m);
    let stamp_sigma_s = sampling.stamp_sigma_s(config, dejittered);
    let noise = NoiseLevels { robot_sigma_m, stamp_sigma_s, factor: 1.0 };
    let knowledge = ShapeKnowledge::of(recording, &observations);
    let shape_prior = knowledge.prior(config);
    let settings = FitSettings { config, noise, fixed: &fixed, prior: None, shape_prior };
    let found = search::find(&Solver { observations: &observations, settings }, guess)?;
    let drawn = drawn_lines::components(&config.drawn_lines, observations.line_count)?;
    let fixed = [fixed.as_slice(), &drawn].concat();
    let settings = FitSettings { fixed: &fixed, ..settings };
    let solver = Solver { observations: &observations, settings };
    let fit = drawn_lines::fit_to(&solver, found.fit, &config.drawn_lines)?;
    let first = Stamped { observations, fit, dejittered };
    let stamped = with_best_stamps(recording, &sampling, &settings, first)?;
    let noise =
        NoiseLevels { stamp_sigma_s: sampling.stamp_sigma_s(config, stamped.dejittered), ..settings.noise };
    let settings = FitSettings { noise, ..settings };
    let rate_sigma_ppm = sampling.rate_sigma_ppm(stamped.dejittered);
    let drift_free = remove_drift(stamped.observations, stamped.fit, &settings, rate_sigma_ppm)?;
    let Identifiability { fit, information, time_offset_share, observability } = {
        let halves = halves(&drift_free, recording, sampling.robot_times_s(stamped.dejittered));
        assess_identifiability(&drift_free, &settings, guess, found.mirrored, halves.as_ref())?
    };
    let levels = SystematicLevels::of(recording, config, &knowledge, settings.shape_prior.is_none());
    let assessed = Assessed { drift_free: DriftFree { fit, ..drift_free }, information, observability };
    let (unbiased, seems) = alone(assessed, recording, &settings, &levels)?;
    let levels = beside_stops(unbiased.levels(levels), &unbiased.assessed, config);
    let robot_seems = released.map_or(seems, |released| released.findings.checks.robot_seems);
    let Unbiased { assessed, structure, cause, bias } = unbiased;
    conclude(&Concluded {
        recording,
        sampling: &sampling,
        dejittered: stamped.dejittered,
        settings: &settings,
        knowledge: &knowledge,
        mirrored: found.mirrored,
        ambiguity: found.ambiguity,
        better: found.better,
        levels: SystematicLevels { robot: robot_seems.unwrap_or(levels.robot), ..levels },
        robot_taken: levels.robot,
        robot_seems,
        bias,
        assessed: &assessed,
        structure,
        cause: released.map_or(cause, |released| released.findings.checks.cause.clone()),
        time_offset_share,
        released,
    })
}

/// At stops the residuals contain what the robot errs by from one to the next: the rest of its errors changes slowly. With external axes the adjustment
/// separates the two.
fn beside_stops(levels: SystematicLevels, assessed: &Assessed, config: &Config) -> SystematicLevels {
    let DriftFree { observations, fit, .. } = &assessed.drift_free;
    if !config.at_stops || observations.robot.axes.is_some() {
        return levels;
    }
    let list = fit.placed.of(observations);
    let (count, unknowns) = (2.0 * list.len() as f64, assessed.information.rank() as f64);
    let squares_per_freedom = fit.noise.factor.powi(2) * (count / (count - unknowns)).max(1.0);
    let of_features: f64 = list.iter().map(|o| o.covariance[0] + o.covariance[2]).sum();
    let beyond = of_features / count.max(1.0) * (squares_per_freedom - 1.0).max(0.0);
    SystematicLevels { robot: levels.robot.beside(beyond.sqrt()), ..levels }
}

/// Adds the separate tests for a bias of the features and for a worse robot. An adjustment of all errors makes both unnecessary.
fn alone(
    assessed: Assessed,
    recording: &Recording,
    settings: &FitSettings<'_>,
    levels: &SystematicLevels,
) -> Result<(Unbiased, Option<RobotSigmas>), Error> {
    let _stage = tracing::debug_span!("bias").entered();
    let fit = &assessed.drift_free.fit;
    if adjusted::applies(recording, settings.config, fit, levels) {
        return Ok((Unbiased::beside_all(assessed, recording, settings), None));
    }
    let unbiased = without_bias(assessed, recording, settings, levels)?;
    let seems = robot_seems(&unbiased, settings, unbiased.levels(*levels).robot);
    Ok((unbiased, seems))
}

/// A recording of stripes with their intersections as seam points, if there are enough of them.
fn cornered(recording: &Recording) -> Result<Option<Recording>, Error> {
    let cornered = with_corners(recording);
    match cornered.as_ref().map_or(MIN_IMAGES, |cornered| cornered.features.len()) {
        crossings if crossings < MIN_IMAGES => Err(Error::NoCrossings { crossings, needed: MIN_IMAGES }),
        _ => Ok(cornered),
    }
}

/// The robot's path by every other sample and by those between, if requested.
fn halves(drift_free: &DriftFree, recording: &Recording, times_s: &[f64]) -> Option<[Trajectory; 2]> {
    let DriftFree { observations, fit, .. } = drift_free;
    let list = fit.placed.of(observations);
    let about_s = excitation::times_looked_at_s(list, fit.parameters().time_offset_s);
    observations.robot.halves(recording, times_s, &about_s)
}

/// The residuals are searched for robot errors only above this multiple of the expected noise, or if neighbours are correlated.
const LARGE: f64 = 1.2;

/// Robot errors from residuals that are not noise. `None` if they are noise or have another cause.
fn robot_seems(unbiased: &Unbiased, settings: &FitSettings<'_>, taken: RobotSigmas) -> Option<RobotSigmas> {
    let Unbiased { assessed, structure, .. } = unbiased;
    let fit = &assessed.drift_free.fit;
    let is_large = matches!(structure, Structure::Correlated(_)) || fit.noise.factor > LARGE;
    if !is_large || unbiased.is_explained() || !assessed.all_observable() {
        return None;
    }
    let problem = fit.problem(&assessed.drift_free.observations, settings.config);
    robot_accuracy::shown(&problem, fit.parameters(), assessed.information.covariance_root(), taken)
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
        let is_absent = config.at_stops && *hold == Hold::TimeOffset;
        if guess.is_none() && !is_absent {
            return Err(Error::NothingToHold { held: hold.name() });
        }
        match hold {
            Hold::TimeOffset => fixed.push(TIME_OFFSET),
            Hold::HandEye => fixed.extend(ROTATION..LINES),
        }
    }
    Ok(fixed)
}
