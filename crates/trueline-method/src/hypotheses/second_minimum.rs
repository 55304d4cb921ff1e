//! Time offsets at which a repeating path falls onto itself.

use crate::assess::residuals::OUTLIER_SQUARED;
use crate::hypotheses::likelihood_ratio::LIKELIHOOD_RATIO_LIMIT;
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::{Parameters, TIME_OFFSET};
use crate::solve::fit::Fit;
use crate::solve::narrowing::{Candidate, FINALISTS, Narrowing, SAME_OFFSET_S, SAMPLE, SCALES, thin};
use crate::solve::solver::{REJECTING, Solver};
use crate::solve::start::lines_for;
use trueline_dataset::Guess;
use trueline_lsq::LeastSquares;

/// Another valley of the time offset, and how it lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondMinimum {
    /// Its bottom, s.
    pub time_offset_s: f64,
    /// Part of the features that it explains, to within 5 σ.
    pub explains: f64,
    /// The same of the best.
    pub best_explains: f64,
    /// Twice the log likelihood that it falls short of the best; negative if it is better.
    pub log_likelihood_lost: f64,
}

impl SecondMinimum {
    /// Whether it lost by more than chance can do.
    #[must_use]
    pub fn decided(&self) -> bool {
        self.log_likelihood_lost > LIKELIHOOD_RATIO_LIMIT
    }
}

/// The best fit at another time offset, and how it compares; `None` if there is no other valley.
///
/// Features that it cannot place (outside the recording, in a gap) count as unexplained.
#[must_use]
pub fn other_offset(solver: &Solver<'_>, fit: &Fit) -> Option<(Parameters, SecondMinimum)> {
    let Solver { observations, settings } = *solver;
    if settings.fixed.contains(&TIME_OFFSET) {
        return None;
    }
    let other = best_elsewhere(solver, fit.parameters())?;
    let criterion = Criterion { residual: settings.config.residual, loss: REJECTING };
    let problem = LineProblem::new(observations, &observations.list, criterion, &fit.noise, &fit.whitened_at);
    let explains = |at: &Parameters| {
        let squared = problem.squared_residuals(at);
        let good = squared.iter().filter(|s| **s <= OUTLIER_SQUARED).count();
        good as f64 / observations.list.len() as f64
    };
    let runner_up = SecondMinimum {
        time_offset_s: other.time_offset_s,
        explains: explains(&other),
        best_explains: explains(fit.parameters()),
        log_likelihood_lost: 2.0 * (problem.cost(&other) - problem.cost(fit.parameters())),
    };
    Some((other, runner_up))
}

/// Distance of the offsets from which another valley is looked for, s.
const OTHER_STEP_S: f64 = 0.1;

/// The best solution in another valley of the time offset than that of `best`, on a thin sample; `None`
/// if every start within the searched range falls back into that one.
fn best_elsewhere(solver: &Solver<'_>, best: &Parameters) -> Option<Parameters> {
    let Solver { observations, settings } = *solver;
    let sample = thin(observations, SAMPLE);
    let steps = (settings.config.offset_search_s / OTHER_STEP_S).round() as i32;
    let offsets = (-steps..=steps).map(|k| f64::from(k) * OTHER_STEP_S);
    let elsewhere = |at: &Parameters| {
        (at.time_offset_s - best.time_offset_s).abs() > SAME_OFFSET_S
            && at.time_offset_s.abs() <= settings.config.offset_search_s + OTHER_STEP_S
    };
    let on_sample = Narrowing { observations, sample: &sample, noise: &settings.noise };
    let mut candidates: Vec<Candidate> = offsets
        .filter_map(|time_offset_s| {
            let guess = Guess { time_offset_s, tool_from_camera: best.tool_from_camera };
            let lines = lines_for(observations, &sample, &guess)?;
            let start = Parameters { time_offset_s, tool_from_camera: best.tool_from_camera, lines };
            on_sample.follow(&SCALES[1..3], 8, start)
        })
        .filter(|candidate| elsewhere(&candidate.parameters))
        .collect();
    candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    candidates.truncate(FINALISTS);
    let followed = candidates.into_iter().filter_map(|c| on_sample.follow(&SCALES[3..], 30, c.parameters));
    let others = followed.filter(|candidate| elsewhere(&candidate.parameters));
    others.min_by(|a, b| a.cost.total_cmp(&b.cost)).map(|candidate| candidate.parameters)
}
