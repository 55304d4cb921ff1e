//! The answer of the seam points, adjusted together with every error that is not noise.

use crate::adjustment::answer::{Answer, Settings, adjust};
use crate::assess::seam_error::{self, SeamError, SharedError};
use crate::assess::systematic::SystematicLevels;
use crate::concluded::Concluded;
use crate::config::{ASSUMED_WAVINESS_M, Config, ResidualKind};
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::TIME_OFFSET;
use crate::solve::fit::Fit;
use trueline_dataset::Recording;
use trueline_geometry::lag;

/// An adjusted answer and what a seam point owes to it.
pub(crate) struct Adjusted {
    /// The answer.
    pub answer: Answer,
    /// How far off a seam point is that is measured later; `None` where the field is empty.
    pub seam_error: Option<SeamError>,
    /// Of each rival of the optimum, whether it is still one: adjusted in full as well, it is about as likely.
    pub is_open: Vec<bool>,
    /// How far the robot lags in each model that was tried (s), with minus twice its log likelihood.
    pub tried: Vec<(f64, f64)>,
}

/// Whether there is something to adjust.
#[must_use]
pub(crate) fn applies(recording: &Recording, config: &Config, fit: &Fit, levels: &SystematicLevels) -> bool {
    let is_ideal = waviness_m(recording, config) == 0.0 && levels.edge_radius_m == 0.0;
    let is_paper = config.residual != ResidualKind::Sheet || fit.parameters().curvatures.is_empty();
    !(is_ideal || is_paper || fit.prior.is_some() || config.at_stops)
}

/// How wavy the seam is, as far as somebody says, m.
fn waviness_m(recording: &Recording, config: &Config) -> f64 {
    config.waviness_m.or(recording.setup.waviness_m).unwrap_or(ASSUMED_WAVINESS_M)
}

/// Lags of a robot behind commanded poses that are tried, s.
const LAGS_S: [f64; 4] = [0.012, 0.022, 0.035, 0.055];
/// A lag is tried where its square is so many times its standard deviation …
const LAG_SIGMAS: f64 = 4.0;
/// … and taken where twice the log likelihood gains so much: e⁻¹² is less likely than commanded poses are rare.
const LAG_GAIN: f64 = 25.0;

/// Twice the log likelihood by which one of two answers is the likelier one for good.
const RIVAL_GAIN: f64 = 25.0;

/// The likeliest of an answer and its rivals, each adjusted in full; and whether each rival is still about as likely. What is noise to a fit of noise alone, tacks
/// and waves above all, can make a turned sensor look better.
fn beside_rivals(
    from: &Concluded<'_>,
    problem: &LineProblem<'_>,
    settings: &Settings<'_>,
    best: Answer,
) -> (Answer, Vec<bool>) {
    let rivals = &from.ambiguity.rivals;
    let is_decided = from.ambiguity.decided_by.is_some();
    let adjusted: Vec<Option<Answer>> =
        rivals.iter().map(|rival| adjust(problem, &rival.parameters, settings)).collect();
    let likeliest = adjusted.iter().flatten().map(Answer::comparable).fold(best.comparable(), f64::min);
    let is_open = adjusted
        .iter()
        .map(|rival| rival.as_ref().is_some_and(|rival| rival.comparable() < likeliest + RIVAL_GAIN));
    let is_open: Vec<bool> = is_open.collect();
    if is_decided || best.comparable() < likeliest + RIVAL_GAIN {
        return (best, is_open);
    }
    let other = adjusted.into_iter().flatten().min_by(|a, b| a.comparable().total_cmp(&b.comparable()));
    // It is no rival of itself.
    let alone = is_open.iter().filter(|open| **open).count() == 1;
    (other.unwrap_or(best), if alone { vec![false; is_open.len()] } else { is_open })
}

/// The same with the robot behind its recorded poses, where those were commanded. The time offset is that of the recorded poses, delay and all: with
/// it a measurement is placed by the poses as they will be recorded.
fn lagging(from: &Concluded<'_>, settings: &Settings<'_>, as_recorded: Answer) -> (Answer, Vec<(f64, f64)>) {
    let mut models = vec![(0.0, as_recorded.twice_negative_log)];
    let (square_s2, sigma_s2) = as_recorded.amplitudes.squared_lag_s2;
    if square_s2 < LAG_SIGMAS * sigma_s2 {
        return (as_recorded, models);
    }
    let tried = LAGS_S.into_iter().filter_map(|lag_s| {
        let drift_free = &from.assessed.drift_free;
        let mut observations = drift_free.observations.without_list();
        observations.robot.trajectory = lag::first_order(&observations.robot.trajectory, lag_s).ok()?;
        observations.list = drift_free.fit.placed.of(&drift_free.observations).to_vec();
        let mut start = as_recorded.at.clone();
        start.time_offset_s -= lag_s;
        let criterion = Criterion { residual: ResidualKind::Sheet, loss: from.settings.config.final_loss() };
        let list = &observations.list;
        let problem = LineProblem::new(&observations, list, criterion, &drift_free.fit.noise, &start)
            .with_shape_prior(drift_free.fit.shape_prior);
        let mut answer = adjust(&problem, &start, &Settings { lag_s, ..*settings })?;
        answer.at.time_offset_s += lag_s;
        models.push((lag_s, answer.twice_negative_log));
        Some(answer)
    });
    let likeliest = tried.min_by(|a, b| a.twice_negative_log.total_cmp(&b.twice_negative_log));
    let answer = likeliest
        .filter(|lagging| lagging.twice_negative_log + LAG_GAIN < as_recorded.twice_negative_log)
        .unwrap_or(as_recorded);
    (answer, models)
}

/// Adjusts it from the optimum of noise alone. `None` where nothing is there to adjust: a seam that is stated to be straight with a sharp edge, the
/// paper's residual, directions that are held at a guess, a robot that stands.
pub(crate) fn adjusted(from: &Concluded<'_>, problem: &LineProblem<'_>) -> Option<Adjusted> {
    let (config, fit) = (from.settings.config, &from.assessed.drift_free.fit);
    if !applies(from.recording, config, fit, &from.levels) {
        return None;
    }
    let waviness_m = waviness_m(from.recording, config);
    let held_sigmas = from.held_sigmas();
    let settings = Settings {
        fixed: from.settings.fixed,
        held_sigmas: &held_sigmas,
        levels: from.levels,
        waviness_m,
        lag_s: 0.0,
    };
    let as_recorded = adjust(problem, fit.parameters(), &settings)?;
    let (as_recorded, is_open) = beside_rivals(from, problem, &settings, as_recorded);
    let (answer, tried) = lagging(from, &settings, as_recorded);
    let observations = &from.assessed.drift_free.observations;
    let widened = from.with_time_offset_widened(answer.noise.clone());
    let at_clock = (TIME_OFFSET, TIME_OFFSET);
    let sources = SharedError {
        noise: &answer.noise,
        stamps_variance_s2: widened[at_clock] - answer.noise[at_clock],
        shares: &answer.shares,
        levels: from.levels,
        speed_m_s: config.used_at.speed_m_s,
    };
    let seam_error = seam_error::of_shares(observations, fit.placed.of(observations), &answer.at, &sources);
    Some(Adjusted { answer, seam_error, is_open, tried })
}
