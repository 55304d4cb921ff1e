//! Tests whether the part moved between the passes over a straight seam.
//!
//! Errors of the robot, forms of the seam and lasting noise can follow a part that moved, with a time offset that is off by many of its ±. The
//! scan is therefore adjusted once more with six numbers for each pass after the first, and the likelihoods are compared.

use crate::adjustment::answer::{Answer, adjust};
use crate::adjustment::clamped::Clamped;
use crate::adjustment::settings::Settings;
use crate::assess::correlated_noise::Structure;
use crate::calibrate::concluded::Concluded;
use crate::config::PartMoves;
use crate::curve::passes::Passes;
use crate::input::observations::Observation;
use crate::order_statistics::median;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use nalgebra::Vector3;

/// Noise factor of the fit of noise alone up to which nothing is left to explain, where correlation was not tested.
const NOISE: f64 = 1.2;
/// More passes are those of a sensor that sways along a short seam.
const MOST_PASSES: usize = 8;
/// Readings that a pass needs on average.
const READINGS_PER_PASS: usize = 30;
/// Minimum gain in twice the log likelihood: that of 10 σ in one unknown. In two of 55 rough shops all errors together gain 50 to 100.
const DECISIVE: f64 = 100.0;
/// Total noise beside the moves, in units of the expected noise, above which another mistake is in the data.
const EXPLAINED: f64 = 6.0;

/// The passes of a scan whose residuals are more than noise. `None` if they are noise, of one pass, of several seams, and if no passes are found.
#[must_use]
pub(crate) fn passes_in_doubt(from: &Concluded<'_>, problem: &LineProblem<'_>) -> Option<Clamped> {
    let fit = &from.assessed.drift_free.fit;
    let is_doubtful = match from.structure {
        Structure::White => false,
        Structure::Correlated(_) => true,
        Structure::Unknown => fit.noise.factor > NOISE,
    };
    is_doubtful.then(|| passes(problem, fit.parameters())).flatten()
}

/// The answer with a part that moved between passes. `None` if one at rest is about as likely.
#[must_use]
pub(crate) fn clamped_again(
    problem: &LineProblem<'_>,
    settings: &Settings<'_>,
    at_rest: &Answer,
    clamped: &Clamped,
) -> Option<Answer> {
    // Lags are compared on fewer frames.
    if at_rest.amplitudes.lag_s > 0.0 {
        return None;
    }
    let moving = adjust(problem, &at_rest.at, &Settings { part: Some(clamped), ..*settings })?;
    let (gain, noise) = (at_rest.comparable() - moving.comparable(), moving.amplitudes.noise_times());
    tracing::debug!(gain, noise, moved_m = moving.moved_m, "moves of the part between passes");
    (gain > DECISIVE && noise < EXPLAINED).then_some(moving)
}

/// The passes over a seam: they end where the sensor turns back.
fn passes(problem: &LineProblem<'_>, at: &Parameters) -> Option<Clamped> {
    let [seam] = at.lines.as_slice() else { return None };
    // A point that moves with the sensor turns where the sensor does. Outliers among the readings make no pass.
    let coordinate = |k: usize| median(problem.list.iter().map(|o| o.point_in_camera[k]));
    let point_in_camera = Vector3::new(coordinate(0)?, coordinate(1)?, coordinate(2)?);
    let place = |o: &Observation| {
        let point = problem.placement(o, at)?.point_in_base(&point_in_camera);
        Some((o.stamp_s, seam.direction().dot(&(point - seam.anchor()))))
    };
    let mut placed: Vec<(f64, f64)> = problem.list.iter().filter_map(place).collect();
    placed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let along_m: Vec<f64> = placed.iter().map(|(_, along_m)| *along_m).collect();
    let (from_m, to_m) = along_m
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(from_m, to_m), &m| (from_m.min(m), to_m.max(m)));
    let of = Passes::of(&along_m, to_m - from_m, false).of;
    let ends = of.windows(2).zip(placed.windows(2)).filter(|(passes, _)| passes[0] < passes[1]);
    let ends_s: Vec<f64> = ends.map(|(_, two)| 0.5 * (two[0].0 + two[1].0)).collect();
    let most = MOST_PASSES.min(placed.len() / READINGS_PER_PASS);
    let middle: Vector3<f64> = seam.anchor() + seam.direction() * (0.5 * (from_m + to_m));
    (1..most).contains(&ends_s.len()).then_some(Clamped { ends_s, middle, moves: PartMoves::USUAL })
}
