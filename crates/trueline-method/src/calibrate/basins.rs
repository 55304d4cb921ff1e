//! Compares the answers of several basins by the likelihood of the full adjustment.

use crate::adjustment::answer::{Answer, adjust};
use crate::adjustment::settings::Settings;
use crate::calibrate::concluded::Concluded;
use crate::calibrate::in_common::some_of;
use crate::hypotheses::ambiguity::RivalAnswer;
use crate::hypotheses::search::BetterMinimum;
use crate::input::observations::Observation;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;

/// Gain in twice the log likelihood at which the likelier of two answers is final.
const RIVAL_GAIN: f64 = 25.0;

/// The likeliest of several answers.
pub(crate) struct Basin {
    /// The answer.
    pub answer: Answer,
    /// For each rival of the optimum: whether it is still about as likely after a full adjustment.
    pub is_open: Vec<bool>,
    /// A plainly likelier rival that the guess or a statement excluded.
    pub better: Option<BetterMinimum>,
}

/// Adjusts an answer and each of its mirror images in full, on the frames that all of them can place, and takes the likeliest. Also states whether
/// each rival is still about as likely. A fit of noise alone counts tacks and waves as noise, and these can favour a wrong rotation.
pub(crate) fn beside_rivals(
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
    let own = adjust(&common, &best.at, &settings.near(&best.amplitudes));
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
        let better = BetterMinimum { parameters: rival.parameters.clone(), noise_factor: rival.noise_factor };
        let better = Some(better);
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

/// The better minimum of noise alone, if it is likelier after a full adjustment too. Noise alone can prefer an answer whose waves, lag or steps
/// no error explains.
#[must_use]
pub(crate) fn likelier(
    from: &Concluded<'_>,
    problem: &LineProblem<'_>,
    settings: &Settings<'_>,
    answer: &Answer,
) -> Option<BetterMinimum> {
    let better = from.better.as_ref()?;
    let is_common = |o: &Observation| {
        [&answer.at, &better.parameters].into_iter().all(|at| problem.placement(o, at).is_some())
    };
    let (list, whiteners) = some_of(problem, is_common);
    let common = problem.of_some(&list, &whiteners);
    let by = |at: &Parameters, settings: &Settings<'_>| Some(adjust(&common, at, settings)?.comparable());
    let is_likelier =
        match (by(&answer.at, &settings.near(&answer.amplitudes)), by(&better.parameters, settings)) {
            (Some(own), Some(other)) => other + RIVAL_GAIN < own,
            (own, _) => own.is_none(),
        };
    is_likelier.then(|| better.clone())
}
