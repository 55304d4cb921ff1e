//! The answer of the seam points, adjusted together with every error that is not noise.

use crate::adjustment::answer::{Answer, Settings, adjust};
use crate::assess::seam_error::{self, SeamError, SharedError};
use crate::concluded::Concluded;
use crate::config::{ASSUMED_WAVINESS_M, ResidualKind};
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::TIME_OFFSET;

/// An adjusted answer and what a seam point owes to it.
pub(crate) struct Adjusted {
    /// The answer.
    pub answer: Answer,
    /// How far off a seam point is that is measured later; `None` where the field is empty.
    pub seam_error: Option<SeamError>,
}

/// Adjusts it from the optimum of noise alone. `None` where nothing is there to adjust: a seam that is stated to be straight with a sharp edge, the
/// paper's residual, directions that are held at a guess, a robot that stands.
pub(crate) fn adjusted(from: &Concluded<'_>, problem: &LineProblem<'_>) -> Option<Adjusted> {
    let (config, fit) = (from.settings.config, &from.assessed.drift_free.fit);
    let stated = from.recording.setup.waviness_m;
    let waviness_m = config.waviness_m.or(stated).unwrap_or(ASSUMED_WAVINESS_M);
    let is_ideal = waviness_m == 0.0 && from.levels.edge_radius_m == 0.0;
    let is_paper = config.residual != ResidualKind::Sheet || fit.parameters().curvatures.is_empty();
    if is_ideal || is_paper || fit.prior.is_some() || config.at_stops {
        return None;
    }
    let held_sigmas = from.held_sigmas();
    let settings = Settings {
        fixed: from.settings.fixed,
        held_sigmas: &held_sigmas,
        levels: from.levels,
        waviness_m,
    };
    let answer = adjust(problem, fit.parameters(), &settings)?;
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
