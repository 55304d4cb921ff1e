//! Tests whether the robot lags behind its recorded poses, as it does behind commanded ones: all joints alike, and each by its own time.
//!
//! An arm of joints with the lags τ + δ_k is late by (τ + J diag(δ) J⁻¹) times its twist. The mean delay belongs to the time offset. The
//! remainder is the curvature of the path (τ² ÿ / 2), and a matrix over the twist that is nearly constant along a scan.

use crate::adjustment::answer::{Answer, adjust};
use crate::adjustment::error_sizes::Amplitudes;
use crate::adjustment::settings::Settings;
use crate::calibrate::concluded::Concluded;
use crate::calibrate::in_common::some_of;
use crate::hypotheses::clock_drift::DriftFree;
use crate::input::observations::Observation;
use crate::models::TriedLag;
use crate::problem::line_problem::LineProblem;
use trueline_geometry::trajectory::TrajectoryError;
use trueline_geometry::{Trajectory, lag};

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
/// Expected lag of a joint beside the others, s: a tenth of a lag of 20 ms.
pub(crate) const JOINT_LAGS_S: f64 = 0.002;
/// Minimum gain of the joints' own lags. One log in eight is of commanded poses, and e⁻⁵ leaves few wrong ones.
const JOINT_GAIN: f64 = 10.0;
/// Total noise, in units of the expected noise, above which the joints' own lags are tried.
const UNEXPLAINED: f64 = 2.0;

/// The likeliest lag of the robot.
pub(crate) struct Lagging<'a> {
    /// The answer with it.
    pub answer: Answer,
    /// Settings of the answer, without a lag of all joints.
    pub settings: Settings<'a>,
    /// The lags that were tried. The first is the answer's.
    pub tried: Vec<TriedLag>,
}

/// The model of an answer.
fn tried(answer: &Answer) -> TriedLag {
    let Amplitudes { lag_s, joint_lags_m, .. } = &answer.amplitudes;
    TriedLag { lag_s: *lag_s, of_joints: joint_lags_m.is_some(), twice_negative_log: answer.comparable() }
}

/// Adjusts with the robot lagging behind its recorded poses, in case these are commanded poses. The time offset stays relative to the recorded poses
/// and includes the delay. It therefore places a measurement by poses as they will be recorded.
pub(crate) fn lagging<'a>(from: &Concluded<'_>, settings: &Settings<'a>, as_recorded: Answer) -> Lagging<'a> {
    let mut models = vec![tried(&as_recorded)];
    let joints = with_joint_lags(from, settings, &as_recorded);
    models.extend(joints.as_ref().map(tried));
    let is_shown = |joints: &Answer| joints.comparable() + JOINT_GAIN < as_recorded.comparable();
    let (settings, begun) = match joints.filter(is_shown) {
        Some(joints) => (Settings { joint_lags_s: JOINT_LAGS_S, ..*settings }, joints),
        None => (*settings, as_recorded),
    };
    let answer = with_mean_lag(from, &settings, begun, &mut models);
    let taken = tried(&answer);
    models.sort_by_key(|model| !model.is_of(&taken));
    Lagging { answer, settings, tried: models }
}

/// The same scan with a lag of its own for each joint. `None` if the noise leaves nothing to explain.
fn with_joint_lags(from: &Concluded<'_>, settings: &Settings<'_>, as_recorded: &Answer) -> Option<Answer> {
    if as_recorded.amplitudes.noise_times() < UNEXPLAINED {
        return None;
    }
    let DriftFree { observations, fit, .. } = &from.assessed.drift_free;
    let problem = fit.problem(observations, from.settings.config);
    adjust(
        &problem,
        &as_recorded.at,
        &Settings { joint_lags_s: JOINT_LAGS_S, ..settings.near(&as_recorded.amplitudes) },
    )
}

/// The likeliest lag of all joints, beside their own if the settings have these.
fn with_mean_lag(
    from: &Concluded<'_>,
    settings: &Settings<'_>,
    as_recorded: Answer,
    models: &mut Vec<TriedLag>,
) -> Answer {
    let (square_s2, sigma_s2) = as_recorded.amplitudes.squared_lag_s2;
    // The residuals determine the square of the lag. A lag is taken only if it agrees with that.
    let is_shown =
        |lag_s: f64| (lag_s.powi(2) - square_s2).abs() < LAG_SIGMAS * sigma_s2 + LAG_CURVES * lag_s.powi(2);
    let (shown, others): (Vec<f64>, Vec<f64>) = LAGS_S.into_iter().partition(|lag_s| is_shown(*lag_s));
    if square_s2 < LAG_SIGMAS * sigma_s2 || shown.is_empty() {
        return as_recorded;
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
    let settings = settings.near(&as_recorded.amplitudes);
    let without = adjust(&problem.of_some(&list, &whiteners), &as_recorded.at, &settings);
    let Some(without) = without else { return as_recorded };
    let with = |lag_s: f64, path: Result<Trajectory, TrajectoryError>| {
        let mut late = observations.without_list();
        late.robot.trajectory = path.ok()?;
        let mut start = as_recorded.at.clone();
        start.time_offset_s -= lag_s;
        let problem = LineProblem { observations: &late, ..problem.of_some(&list, &whiteners) };
        let mut answer = adjust(&problem, &start, &Settings { lag_s: lag_s.abs(), ..settings })?;
        answer.at.time_offset_s += lag_s;
        Some(answer)
    };
    let path = &observations.robot.trajectory;
    let mut lagging = Vec::new();
    let try_all = |lags: Vec<f64>, lagging: &mut Vec<Answer>| {
        lagging.extend(lags.into_iter().filter_map(|lag_s| with(lag_s, lag::first_order(path, lag_s))));
        lagging.iter().any(|answer| without.comparable() > answer.comparable() + LAG_GAIN)
    };
    if try_all(shown, &mut lagging) {
        try_all(others, &mut lagging);
    }
    // All lags are of the frames that the largest one can place, and so is the model without one.
    let compared = tried(&without);
    models.iter_mut().filter(|model| model.is_of(&compared)).for_each(|model| *model = compared);
    models.extend(lagging.iter().map(tried));
    let Some(likeliest) = lagging.into_iter().min_by(|a, b| a.comparable().total_cmp(&b.comparable())) else {
        return as_recorded;
    };
    // Controllers follow within 60 ms. An optimum at the largest lag has another cause, and so has a lag whose square disagrees with the residuals.
    let lag_s = likeliest.amplitudes.lag_s;
    let is_credible = lag_s < latest_s && is_shown(lag_s);
    let gain = without.comparable() - likeliest.comparable();
    if !is_credible || gain <= LAG_GAIN {
        return as_recorded;
    }
    // A lag also smooths the noise of the poses, and so does an equal lead. Only a robot that follows commands prefers the lag.
    let ahead = with(-lag_s, lag::first_order_ahead(path, lag_s)).map(|ahead| ahead.comparable());
    let beside_ahead = ahead.map_or(0.0, |ahead| ahead - likeliest.comparable());
    if beside_ahead > LAG_GAIN.max(OF_LAG * gain) { likeliest } else { as_recorded }
}
