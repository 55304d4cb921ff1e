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

/// The same with the robot behind its recorded poses, where those were commanded. The time offset is that of the recorded poses, delay and all: with
/// it a measurement is placed by the poses as they will be recorded.
fn lagging(from: &Concluded<'_>, settings: &Settings<'_>, as_recorded: Answer) -> Answer {
    let (square_s2, sigma_s2) = as_recorded.amplitudes.squared_lag_s2;
    if square_s2 < LAG_SIGMAS * sigma_s2 {
        return as_recorded;
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
        Some(answer)
    });
    let likeliest = tried.min_by(|a, b| a.twice_negative_log.total_cmp(&b.twice_negative_log));
    likeliest
        .filter(|lagging| lagging.twice_negative_log + LAG_GAIN < as_recorded.twice_negative_log)
        .unwrap_or(as_recorded)
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
    let answer = lagging(from, &settings, as_recorded);
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
    Some(Adjusted { answer, seam_error })
}
