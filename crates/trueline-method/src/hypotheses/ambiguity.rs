//! Rivals of a solution that neither the scan nor prior knowledge of the cell excludes.

use crate::hypotheses::choice::{DecidedBy, Statement, statements_for};
use crate::hypotheses::paired_test::{PairedTest, compare};
use crate::hypotheses::rivals::Rival;
use crate::problem::parameters::Parameters;
use crate::solve::fit::Fit;
use crate::solve::solver::Solver;

/// The most dangerous rival, and the comparison with the best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunnerUp {
    /// Its time offset, s.
    pub time_offset_s: f64,
    /// Its noise factor: residuals divided by the expected noise.
    pub noise_factor: f64,
    /// Comparison with the best solution.
    pub test: PairedTest,
}

/// A rival that the scan cannot separate from the best: a complete answer.
#[derive(Clone, Debug)]
pub struct RivalAnswer {
    /// The answer.
    pub parameters: Parameters,
    /// Its noise factor: residuals divided by the expected noise.
    pub noise_factor: f64,
    /// Comparison with the chosen answer.
    pub test: PairedTest,
    /// Whether it is the mirrored attitude at the same time offset.
    pub is_mirror: bool,
    /// Statements, each of which would select it.
    pub statements: Vec<Statement>,
}

/// Rival solutions of a scan.
#[derive(Clone, Debug, Default)]
pub struct Ambiguity {
    /// The most dangerous rival; `None` if there is none within the searched range.
    pub runner_up: Option<RunnerUp>,
    /// Rivals that the scan cannot separate from the best.
    pub rivals: Vec<RivalAnswer>,
    /// Statements, each of which would select the answer.
    pub statements: Vec<Statement>,
    /// Reason for the decision between them; `None` without a decision.
    pub decided_by: Option<DecidedBy>,
    /// Whether the answer contradicts a statement about the cell.
    pub contradicted: bool,
}

impl Ambiguity {
    /// Rivals other than the mirrored attitude: at other time offsets, or turned by half a turn.
    pub fn others(&self) -> impl Iterator<Item = &RivalAnswer> {
        self.rivals.iter().filter(|rival| !rival.is_mirror)
    }

    /// The same without rivals.
    pub(crate) fn without_rivals(&self) -> Self {
        Self { decided_by: self.decided_by, contradicted: self.contradicted, ..Self::default() }
    }

    /// Whether several answers cannot be separated, mirrored attitudes aside.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.others().next().is_some() && self.decided_by.is_none()
    }
}

/// Chooses between a solution, its rivals, and its mirror image if that fits as well. The scan decides if it can. Otherwise a statement about the
/// cell decides, or the guess that led to `best`.
#[must_use]
pub fn settle(
    solver: &Solver<'_>,
    best: Fit,
    mut rivals: Vec<Rival>,
    mirror: Option<Fit>,
    guessed: bool,
) -> (Fit, Ambiguity) {
    let known = &solver.settings.config.known;
    let runner_up = rivals.first().map(|rival| RunnerUp {
        time_offset_s: rival.fit.parameters().time_offset_s,
        noise_factor: rival.fit.noise.factor,
        test: rival.test,
    });
    rivals.retain(|rival| rival.is_named() && !rival.test.decided() && !rival.test.reversed());
    let has_mirror = mirror.is_some();
    let mut answers: Vec<Fit> =
        std::iter::once(best).chain(rivals.into_iter().map(|rival| rival.fit)).chain(mirror).collect();
    let allowed: Vec<usize> = (0..answers.len()).filter(|k| known.allows(answers[*k].parameters())).collect();
    let (chosen, decided_by) = match allowed[..] {
        _ if answers.len() == 1 => (0, None),
        [only] if !known.is_empty() => (only, Some(DecidedBy::Statement)),
        [0, ..] if guessed => (0, Some(DecidedBy::Guess)),
        _ => (0, None),
    };
    let contradicted = !allowed.contains(&chosen);
    answers.swap(0, chosen);
    // The mirror image is last. If it is chosen, the first solution takes its place.
    let last = answers.len() - 1;
    let mirror = (has_mirror && (chosen == 0 || chosen == last)).then_some(last);
    let mut ambiguity = described(solver, &answers, mirror, runner_up);
    (ambiguity.decided_by, ambiguity.contradicted) = (decided_by, contradicted);
    (answers.swap_remove(0), ambiguity)
}

/// All answers but the first, as its rivals. One of them may be its mirror image.
fn described(
    solver: &Solver<'_>,
    answers: &[Fit],
    mirror: Option<usize>,
    runner_up_before: Option<RunnerUp>,
) -> Ambiguity {
    let all: Vec<&Parameters> = answers.iter().map(Fit::parameters).collect();
    let mut rivals = Vec::new();
    for (k, fit) in answers.iter().enumerate().skip(1) {
        let test = compare(solver.observations, solver.settings.config, &answers[0], fit);
        rivals.extend(test.map(|test| RivalAnswer {
            parameters: fit.parameters().clone(),
            noise_factor: fit.noise.factor,
            test,
            is_mirror: mirror == Some(k),
            statements: statements_for(k, &all),
        }));
    }
    let statements = if rivals.is_empty() { Vec::new() } else { statements_for(0, &all) };
    let mut ambiguity = Ambiguity { rivals, statements, ..Ambiguity::default() };
    let first = ambiguity.others().next();
    let first = first.map(|rival| RunnerUp {
        time_offset_s: rival.parameters.time_offset_s,
        noise_factor: rival.noise_factor,
        test: rival.test,
    });
    ambiguity.runner_up = first.or(runner_up_before);
    ambiguity
}
