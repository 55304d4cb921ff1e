//! Adjusts the seam-point answer together with every systematic error.

use crate::adjustment::answer::{Answer, Settings, adjust};
use crate::assess::levels::SystematicLevels;
use crate::assess::observability::Group;
use crate::assess::residuals::{self, FeatureResidual};
use crate::assess::seam_error::{self, SeamError, SharedError};
use crate::assess::{outlier_segments, seam_point_error};
use crate::axes::finding as axes;
use crate::axes::finding::{self, sigmas_before};
use crate::calibrate::answered::{Answered, beside_cause, with_sensor};
use crate::calibrate::concluded::Concluded;
use crate::config::{ASSUMED_WAVINESS_M, Config, ResidualKind};
use crate::findings::Findings;
use crate::hypotheses::ambiguity::RivalAnswer;
use crate::hypotheses::clock_drift::DriftFree;
use crate::hypotheses::search::{BetterMinimum, Mirrored};
use crate::input::noise_levels::Whitener;
use crate::input::observations::{Observation, Observations};
use crate::input::robot_motion::RobotMotion;
use crate::input::skip::Skip;
use crate::models::of_adjustment;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::{Parameters, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::solve::fit::Fit;
use std::collections::BTreeMap;
use trueline_dataset::Recording;
use trueline_geometry::trajectory::TrajectoryError;
use trueline_geometry::{Trajectory, lag};
use trueline_lsq::Termination;

/// An adjusted answer and the seam error that follows from it.
struct Adjusted {
    /// The answer.
    pub answer: Answer,
    /// Predicted error of a later seam point; `None` if the field is empty.
    pub seam_error: Option<SeamError>,
    /// For each rival of the optimum: whether it is still about as likely after a full adjustment.
    pub is_open: Vec<bool>,
    /// A plainly likelier rival that the guess or a statement excluded.
    pub better: Option<BetterMinimum>,
    /// The scan with its external axes where they were found; `None` without axes.
    pub with_axes: Option<Observations>,
    /// Each lag that was tried (s), with minus twice its log likelihood.
    pub tried: Vec<(f64, f64)>,
}

/// Whether there is something to adjust.
#[must_use]
pub(crate) fn applies(recording: &Recording, config: &Config, fit: &Fit, levels: &SystematicLevels) -> bool {
    let is_ideal =
        waviness_m(recording, config) == 0.0 && levels.edge_radius_m == 0.0 && recording.axes.is_empty();
    let is_paper = config.residual != ResidualKind::Sheet || fit.parameters().curvatures.is_empty();
    // The error of a robot at stops is noise, one draw a stop. External axes are estimated only in the adjustment.
    let is_at_stops = config.at_stops && recording.axes.is_empty();
    !(is_ideal || is_paper || fit.prior.is_some() || is_at_stops)
}

/// Stated waviness of the seam, m.
fn waviness_m(recording: &Recording, config: &Config) -> f64 {
    config.waviness_m.or(recording.setup.waviness_m).unwrap_or(ASSUMED_WAVINESS_M)
}

/// Adjusts the optimum of noise alone. `None` if there is no systematic error to adjust: a straight seam with a sharp edge, the paper's residual,
/// directions held at a guess, a standing robot.
///
/// # Errors
/// [`Unsolved`] where there would be, and the equations have no solution.
fn adjusted(from: &Concluded<'_>, problem: &LineProblem<'_>) -> Result<Option<Adjusted>, Unsolved> {
    let (config, fit) = (from.settings.config, &from.assessed.drift_free.fit);
    if !applies(from.recording, config, fit, &from.levels) {
        return Ok(None);
    }
    let _stage = tracing::debug_span!("adjustment").entered();
    let held_sigmas = from.held_sigmas();
    let axis_sigmas = sigmas_before(from.recording);
    let stepped = from.assessed.drift_free.stepped;
    let settings = Settings {
        fixed: from.settings.fixed,
        held_sigmas: &held_sigmas,
        levels: from.levels,
        waviness_m: waviness_m(from.recording, config),
        noise_factor: fit.noise.factor,
        step: stepped.map(|step| (step.at_s, step.step_s.abs())),
        lag_s: 0.0,
        axis_sigmas: &axis_sigmas,
        threads: config.threads,
    };
    let best = adjust(problem, fit.parameters(), &settings).ok_or(Unsolved)?;
    let Basin { answer, is_open, better } = beside_rivals(from, problem, &settings, best);
    let (answer, tried) = lagging(from, &settings, answer);
    let seam_error = seam_error(from, &answer);
    let with_axes = with_axes(from, &answer);
    Ok(Some(Adjusted { answer, seam_error, is_open, better, with_axes, tried }))
}

fn with_axes(from: &Concluded<'_>, answer: &Answer) -> Option<Observations> {
    let found = finding::of_all(from.recording, &answer.at.lines, Some(answer.axes.as_ref()?));
    let mut recording = from.recording.clone();
    for (record, found) in recording.axes.iter_mut().zip(found).filter(|(_, found)| found.moves) {
        record.known = Some(found.axis);
    }
    let times_s = from.sampling.robot_times_s(from.dejittered);
    let robot = RobotMotion::of(&recording, times_s, from.settings.config).ok()?;
    let observations = &from.assessed.drift_free.observations;
    Some(Observations { robot, list: observations.list.clone(), ..observations.without_list() })
}

/// Residuals of an answer, with the external axes where they were found.
fn residuals_of(
    problem: &LineProblem<'_>,
    with_axes: Option<&Observations>,
    at: &Parameters,
) -> (Vec<FeatureResidual>, BTreeMap<Skip, usize>) {
    let observations = with_axes.unwrap_or(problem.observations);
    let placed = LineProblem { observations, ..problem.of_some(problem.list, &problem.whiteners) };
    residuals::evaluate(&placed, at)
}

/// The equations of an adjustment have no solution.
#[derive(Clone, Copy, Debug)]
struct Unsolved;

fn seam_error(from: &Concluded<'_>, answer: &Answer) -> Option<SeamError> {
    let (observations, fit) = (&from.assessed.drift_free.observations, &from.assessed.drift_free.fit);
    let widened = from.with_time_offset_widened(answer.noise.clone());
    let at_clock = (TIME_OFFSET, TIME_OFFSET);
    let sources = SharedError {
        noise: &answer.noise,
        stamps_variance_s2: widened[at_clock] - answer.noise[at_clock],
        shares: &answer.shares,
        levels: from.levels,
        speed_m_s: from.settings.config.used_at.speed_m_s,
    };
    seam_error::of_shares(observations, fit.placed.of(observations), &answer.at, &sources)
}

/// Gain in twice the log likelihood at which the likelier of two answers is final.
const RIVAL_GAIN: f64 = 25.0;

/// The likeliest of several answers.
struct Basin {
    answer: Answer,
    is_open: Vec<bool>,
    better: Option<BetterMinimum>,
}

/// Adjusts an answer and each of its mirror images in full, on the frames that all of them can place, and takes the likeliest. Also states whether
/// each rival is still about as likely. A fit of noise alone counts tacks and waves as noise, and these can favour a wrong rotation.
fn beside_rivals(
    from: &Concluded<'_>,
    problem: &LineProblem<'_>,
    settings: &Settings<'_>,
    best: Answer,
) -> Basin {
    let rivals = &from.ambiguity.rivals;
    // Rivals at other time offsets come from a repeating path. They keep their own test, because forms of the seam can explain an alias too. Held
    // lines stay where they were drawn, and their rivals were found earlier.
    if !rivals.iter().any(|rival| rival.is_mirror) || !from.settings.config.drawn_lines.is_empty() {
        return Basin { answer: best, is_open: vec![true; rivals.len()], better: None };
    }
    let mirrors = || rivals.iter().filter(|rival| rival.is_mirror);
    let is_common =
        |o: &Observation| mirrors().all(|rival| problem.placement(o, &rival.parameters).is_some());
    let (list, whiteners) = some_of(problem, is_common);
    let common = problem.of_some(&list, &whiteners);
    let own = adjust(&common, &best.at, settings);
    // A rival that converges to the answer is the same basin.
    let is_same = |other: &Answer| own.as_ref().is_some_and(|own| are_one_basin(&own.at, &other.at));
    let of_mirror = |rival: &RivalAnswer| {
        let adjusted = rival.is_mirror.then(|| adjust(&common, &rival.parameters, settings)).flatten();
        adjusted.map(|answer| (answer.comparable(), is_same(&answer)))
    };
    let others: Vec<Option<(f64, bool)>> = rivals.iter().map(of_mirror).collect();
    let merged: Vec<bool> = others.iter().map(|other| other.is_some_and(|(_, is_same)| is_same)).collect();
    let others: Vec<Option<f64>> =
        others.into_iter().map(|other| other.filter(|(_, is_same)| !is_same).map(|(by, _)| by)).collect();
    // An answer without a solution is not compared.
    let own = own.map_or(f64::INFINITY, |own| own.comparable());
    let likeliest = others.iter().flatten().copied().fold(own, f64::min);
    let mut is_open: Vec<bool> = rivals
        .iter()
        .zip(&others)
        .map(|(rival, other)| !rival.is_mirror || other.is_none_or(|other| other < likeliest + RIVAL_GAIN))
        .zip(merged)
        .map(|(is_open, is_merged)| is_open && !is_merged)
        .collect();
    let taken = others.iter().position(|other| *other == Some(likeliest));
    let Some(taken) = taken.filter(|_| own > likeliest + RIVAL_GAIN) else {
        return Basin { answer: best, is_open, better: None };
    };
    let rival = &rivals[taken];
    if from.ambiguity.decided_by.is_some() {
        let (time_offset_s, noise_factor) = (rival.parameters.time_offset_s, rival.noise_factor);
        let better = Some(BetterMinimum { time_offset_s, noise_factor });
        return Basin { answer: best, is_open, better };
    }
    // The answer is no rival of itself.
    is_open[taken] = false;
    Basin { answer: adjust(problem, &rival.parameters, settings).unwrap_or(best), is_open, better: None }
}

/// Rotations of the sensor closer than this belong to one basin, rad: 4°.
const ONE_BASIN_RAD: f64 = 0.07;

/// Whether two answers are of one basin.
fn are_one_basin(one: &Parameters, other: &Parameters) -> bool {
    one.tool_from_camera.rotation.angle_to(&other.tool_from_camera.rotation) < ONE_BASIN_RAD
}

/// The observations of a problem that meet a condition, with their whiteners.
fn some_of(
    problem: &LineProblem<'_>,
    is_such: impl Fn(&Observation) -> bool,
) -> (Vec<Observation>, Vec<Whitener>) {
    problem.selected().filter(|(o, _)| is_such(o)).map(|(o, whitener)| (*o, *whitener)).unzip()
}

/// Lags of a robot behind commanded poses that are tried, s.
const LAGS_S: [f64; 4] = [0.012, 0.022, 0.035, 0.055];
/// A lag is tried if its estimated square exceeds this multiple of its standard deviation.
const LAG_SIGMAS: f64 = 4.0;
/// Minimum share of the gain that must come from the lag rather than from smoother poses.
const OF_LAG: f64 = 0.5;
/// Deviation of the square from its parabola, as a fraction of the square.
const LAG_CURVES: f64 = 0.6;
/// Minimum gain in twice the log likelihood: e⁻¹² is less likely than commanded poses are rare.
const LAG_GAIN: f64 = 25.0;

/// Adjusts with the robot lagging behind its recorded poses, in case these are commanded poses. The time offset stays relative to the recorded poses
/// and includes the delay. It therefore places a measurement by poses as they will be recorded.
fn lagging(from: &Concluded<'_>, settings: &Settings<'_>, as_recorded: Answer) -> (Answer, Vec<(f64, f64)>) {
    let mut models = vec![(0.0, as_recorded.comparable())];
    let (square_s2, sigma_s2) = as_recorded.amplitudes.squared_lag_s2;
    // The residuals determine the square of the lag. A lag is taken only if it agrees with that.
    let is_shown =
        |lag_s: f64| (lag_s.powi(2) - square_s2).abs() < LAG_SIGMAS * sigma_s2 + LAG_CURVES * lag_s.powi(2);
    let (shown, others): (Vec<f64>, Vec<f64>) = LAGS_S.into_iter().partition(|lag_s| is_shown(*lag_s));
    if square_s2 < LAG_SIGMAS * sigma_s2 || shown.is_empty() {
        return (as_recorded, models);
    }
    let DriftFree { observations, fit, .. } = &from.assessed.drift_free;
    let problem = fit.problem(observations, from.settings.config);
    let latest_s = LAGS_S.iter().copied().fold(0.0, f64::max);
    // A lag makes exposures later. All lags are compared on the frames that the largest one can still place.
    let is_common = |o: &Observation| {
        let later = Observation { stamp_s: o.stamp_s + latest_s, ..*o };
        problem.placement(&later, &as_recorded.at).is_some()
    };
    let (list, whiteners) = some_of(&problem, is_common);
    let without = adjust(&problem.of_some(&list, &whiteners), &as_recorded.at, settings);
    let Some(without) = without else { return (as_recorded, models) };
    let with = |lag_s: f64, path: Result<Trajectory, TrajectoryError>| {
        let mut lagging = observations.without_list();
        lagging.robot.trajectory = path.ok()?;
        let mut start = as_recorded.at.clone();
        start.time_offset_s -= lag_s;
        let problem = LineProblem { observations: &lagging, ..problem.of_some(&list, &whiteners) };
        let mut answer = adjust(&problem, &start, &Settings { lag_s: lag_s.abs(), ..*settings })?;
        answer.at.time_offset_s += lag_s;
        Some(answer)
    };
    let path = &observations.robot.trajectory;
    let mut tried = Vec::new();
    let try_all = |lags: Vec<f64>, tried: &mut Vec<Answer>| {
        tried.extend(lags.into_iter().filter_map(|lag_s| with(lag_s, lag::first_order(path, lag_s))));
        tried.iter().any(|answer| without.comparable() > answer.comparable() + LAG_GAIN)
    };
    if try_all(shown, &mut tried) {
        try_all(others, &mut tried);
    }
    models[0].1 = without.comparable();
    models.extend(tried.iter().map(|answer| (answer.amplitudes.lag_s, answer.comparable())));
    let Some(likeliest) = tried.into_iter().min_by(|a, b| a.comparable().total_cmp(&b.comparable())) else {
        return (as_recorded, models);
    };
    // Controllers follow within 60 ms. An optimum at the largest lag has another cause, and so has a lag whose square disagrees with the residuals.
    let lag_s = likeliest.amplitudes.lag_s;
    let is_credible = lag_s < latest_s && is_shown(lag_s);
    // A lag also smooths the noise of the poses, and so does an equal lead. Only a robot that follows commands prefers the lag.
    let ahead = with(-lag_s, lag::first_order_ahead(path, lag_s)).map(|ahead| ahead.comparable());
    let gain = without.comparable() - likeliest.comparable();
    let beside_ahead = ahead.map_or(0.0, |ahead| ahead - likeliest.comparable());
    let is_taken = is_credible && gain > LAG_GAIN && beside_ahead > LAG_GAIN.max(OF_LAG * gain);
    (if is_taken { likeliest } else { as_recorded }, models)
}

/// Takes the answer of the seam points as it is adjusted with all errors: residuals, checks and ± are its own.
pub(crate) fn take_adjusted(from: &Concluded<'_>, problem: &LineProblem<'_>, findings: &mut Findings) {
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
    // Explained readings are no outlier segment.
    findings.checks.outlier_segments.retain(|segment| answer.leaves_out(segment.span_s));
    let stamp_of = |f: &FeatureResidual| from.recording.features[f.row as usize].stamp_ns;
    findings.fit.feature_stamps_ns = features.iter().map(stamp_of).collect();
    findings.fit.features = features;
    let of_robot = answer.of_robot();
    findings.fit.amplitudes = Some(answer.amplitudes);
    let answered = Answered { parameters: answer.at, covariance, noise_covariance, observability, of_robot };
    findings.unknowns = with_sensor(from, answered);
    findings.unknowns.sensor = beside_cause(from, &findings.unknowns);
    if !findings.unknowns.sensor.is_some_and(|shape| shape.is_off()) {
        findings.checks.confounded_causes.clear();
    }
}
