//! Observability and rivals of a scan over a curve, as a calibration reports them.

use crate::assess::observability::{Observability, named};
use crate::config::Config;
use crate::curve::answer::Answered;
use crate::curve::rivals::Rival;
use crate::hypotheses::ambiguity::{Ambiguity, RivalAnswer, RunnerUp};
use crate::hypotheses::choice::{DecidedBy, statements_for};
use crate::problem::parameters::{LINES, Parameters, TIME_OFFSET};
use nalgebra::DMatrix;
use trueline_dataset::Guess;

/// Observability of the scan.
#[must_use]
pub(crate) fn observability(answer: &Answered, at: &Parameters) -> Observability {
    let seen = &answer.finished.seen;
    let shows_time = answer.components[TIME_OFFSET];
    // If the hand-eye transform is unobservable, none of its directions is reported.
    let is_whole = !answer.curve.is_one_pass && answer.curve.collapsed_from_m.is_none();
    let mut null = seen.unseen.clone();
    if !is_whole {
        null = DMatrix::from_fn(LINES, LINES - 1, |row, k| if row == k + 1 { 1.0 } else { 0.0 });
    }
    let rank = if is_whole { seen.rank } else { usize::from(shows_time) };
    let largest = seen.singular_values[0].max(f64::MIN_POSITIVE);
    let least = seen.singular_values[LINES - 1];
    Observability {
        rank,
        size: LINES,
        condition: if least > 0.0 { largest / least } else { f64::INFINITY },
        singular_values: seen.singular_values.iter().map(|value| value / largest).collect(),
        composition: vec![Vec::new(); LINES],
        unobservable: named(&null, at, shows_time),
        observable_components: answer.components.to_vec(),
    }
}

/// Rivals of the answer, and the decision between them.
#[must_use]
pub(crate) fn ambiguity(answer: &Answered, guess: Option<&Guess>, config: &Config) -> Ambiguity {
    let of = |at: &Guess| Parameters::straight(at, Vec::new());
    let own = of(&answer.at());
    let open: Vec<&Rival> = answer.open().collect();
    let others: Vec<Parameters> = open.iter().map(|rival| of(&rival.rough.fitted.state.at)).collect();
    let all: Vec<&Parameters> = std::iter::once(&own).chain(&others).collect();
    let rivals = open.iter().zip(&others).enumerate().map(|(k, (rival, parameters))| RivalAnswer {
        parameters: parameters.clone(),
        noise_factor: rival.factor,
        test: rival.test,
        is_mirror: false,
        statements: statements_for(k + 1, &all),
    });
    let rivals: Vec<RivalAnswer> = rivals.collect();
    let is_allowed = config.known.allows(&own);
    let others_allowed = others.iter().any(|other| config.known.allows(other));
    let nearer = |guess: &Guess| {
        let off_s = |at: &Parameters| (at.time_offset_s - guess.time_offset_s).abs();
        others.iter().all(|other| off_s(&own) < CLEARLY_NEARER * off_s(other))
    };
    let decided_by = if rivals.is_empty() {
        None
    } else if !config.known.is_empty() && is_allowed && !others_allowed {
        Some(DecidedBy::Statement)
    } else {
        (is_allowed && guess.is_some_and(nearer)).then_some(DecidedBy::Guess)
    };
    Ambiguity {
        runner_up: answer.rivals.first().map(|rival| RunnerUp {
            time_offset_s: rival.rough.fitted.state.at.time_offset_s,
            noise_factor: rival.factor,
            test: rival.test,
        }),
        statements: if rivals.is_empty() { Vec::new() } else { statements_for(0, &all) },
        rivals,
        decided_by,
        contradicted: !is_allowed,
    }
}

/// A guess decides between rivals if its distance to one is below this fraction of its distance to the other.
const CLEARLY_NEARER: f64 = 0.5;
