//! A plan's predicted accuracy during the scan, and for wrong guesses.

use crate::cell::Cell;
use crate::plan::Plan;
use crate::predicted_frames::{PredictedFrames, exposures};
use crate::prediction::Prediction;
use crate::robustness_to_guess::{SeenBy, WrongCells};
use crate::truth::Truth;
use trueline_method::problem::parameters::LINES;

/// The predicted accuracy during the scan: time (s) and the covariance up to it, at `times` times.
#[must_use]
pub fn over_time(cell: &Cell, plan: &Plan, times: usize) -> Vec<(f64, Prediction)> {
    let truth = Truth::guessed(cell);
    let sights = truth.and_then(|truth| {
        let sights = PredictedFrames::of(cell, &plan.motion, &truth, 1)?;
        Some((truth, sights))
    });
    let Some((truth, sights)) = sights else { return Vec::new() };
    let measured = plan.target.measured(cell, &truth, &sights, &plan.seen_by);
    let every = sights.list.len().div_ceil(times).max(1);
    let ends = (1..=sights.list.len()).filter(|n| n % every == 0 || *n == sights.list.len());
    ends.filter_map(|n| Some((sights.list[n - 1].time_s, measured.prediction_until(n)?))).collect()
}

/// Standard deviations of the same motion if the guess is wrong by anything within its error: for each component the
/// value that 95 % of such cells stay below.
#[must_use]
pub fn wrong_guesses(cell: &Cell, plan: &Plan) -> [f64; LINES] {
    let stride = (exposures(cell, &plan.motion, 1).count() / 200).max(1);
    let joint = plan.target.joint();
    let sigmas: Vec<[f64; LINES]> = WrongCells::for_wrong_guesses(cell)
        .iter()
        .map(|wrong| {
            let promised = wrong.truth().and_then(|truth| {
                let sights = PredictedFrames::of(cell, &plan.motion, &truth, stride)?;
                let sees = |pose| wrong.sees(cell, joint, pose);
                let seen: Vec<SeenBy> =
                    sights.list.iter().map(|sight| sees(&sight.placement.base_from_tool)).collect();
                plan.target.measured(cell, &truth, &sights, &seen).prediction()
            });
            let promised = promised.filter(Prediction::shows_all);
            std::array::from_fn(|k| promised.as_ref().map_or(f64::INFINITY, |p| p.sigma(k)))
        })
        .collect();
    std::array::from_fn(|k| {
        let mut of_one: Vec<f64> = sigmas.iter().map(|s| s[k]).collect();
        of_one.sort_by(f64::total_cmp);
        of_one[(0.95 * (of_one.len() - 1) as f64).round() as usize]
    })
}
