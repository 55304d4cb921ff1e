//! Which stamps to believe: those recorded, or those of the clock behind them. The data decide.

use crate::config::{Config, Stamps};
use crate::error::Error;
use crate::hypotheses::likelihood_ratio::{LIKELIHOOD_RATIO_LIMIT, noise_advantage};
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::Observations;
use crate::input::robot_motion::RobotMotion;
use crate::input::timestamps::{Dejittered, Sampling};
use crate::problem::line_problem::LineProblem;
use crate::solve::fit::Fit;
use crate::solve::noise_scale::noise_factor;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use trueline_dataset::Recording;
use trueline_lsq::Loss;

/// A fit, the observations it was made of, and how their stamps were treated.
pub(crate) struct Stamped {
    /// Observations with the stamps that are used.
    pub observations: Observations,
    /// The fit to them.
    pub fit: Fit,
    /// Which stamps are the clocks'.
    pub dejittered: Dejittered,
}

/// Solves with the stamps of the clocks too, and keeps the better.
///
/// # Errors
/// As [`Solver::refit`].
pub(crate) fn with_best_stamps(
    recording: &Recording,
    sampling: &Sampling,
    settings: &FitSettings<'_>,
    recorded: Stamped,
) -> Result<Stamped, Error> {
    let mut best = recorded;
    for dejittered in sampling.candidates(settings.config) {
        let observations = treated(recording, sampling, settings.config, &best.observations, dejittered)?;
        let noise = NoiseLevels {
            stamp_sigma_s: sampling.stamp_sigma_s(settings.config, dejittered),
            ..settings.noise
        };
        let fit = Solver { observations: &observations, settings: FitSettings { noise, ..*settings } }
            .refit(&best.fit)?;
        let tried = Stamped { observations, fit, dejittered };
        if settings.config.stamps == Stamps::Regular
            || advantage(&tried, &best, &settings.noise) > LIKELIHOOD_RATIO_LIMIT
        {
            best = tried;
        }
    }
    Ok(best)
}

pub(crate) fn treated(
    recording: &Recording,
    sampling: &Sampling,
    config: &Config,
    observations: &Observations,
    dejittered: Dejittered,
) -> Result<Observations, Error> {
    let mut treated = observations.clone();
    if let Some(clock) = sampling.images.clock.as_ref().filter(|_| dejittered.images) {
        for o in &mut treated.list {
            o.stamp_s = clock.regular_s[o.frame as usize];
        }
    }
    if let Some(clock) = sampling.robot.clock.as_ref().filter(|_| dejittered.robot) {
        treated.robot = RobotMotion::of(recording, &clock.regular_s, config)?;
    }
    Ok(treated)
}

/// Twice the log likelihood of one over the other, by the residuals in the sheet alone.
fn advantage(one: &Stamped, other: &Stamped, noise: &NoiseLevels) -> f64 {
    let factor = |stamped: &Stamped| {
        let problem = LineProblem::coarse(
            &stamped.observations,
            stamped.fit.placed.of(&stamped.observations),
            Loss::Squared,
            noise,
            stamped.fit.parameters().unknowns(),
        );
        noise_factor(&problem.squared_residuals(stamped.fit.parameters()))
    };
    noise_advantage(one.fit.placed.len(), factor(one), factor(other))
}
