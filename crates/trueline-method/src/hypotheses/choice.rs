//! Chooses between answers that a scan cannot separate, from the user's statements about the cell.

use crate::config::known_of_cell::{KnownOfCell, ToolAxis};
use crate::problem::parameters::Parameters;
use nalgebra::Vector3;

/// One statement about the cell. It is displayed as the option that makes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Statement {
    /// The time offset is within plus and minus this, s.
    OffsetWithin(f64),
    /// The sensor looks along this axis of the tool.
    Looks(ToolAxis),
}

impl std::fmt::Display for Statement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::OffsetWithin(window_s) => write!(f, "--offset-within {window_s:.2}"),
            Self::Looks(axis) => write!(f, "--looks {}", axis.name()),
        }
    }
}

/// Largest angle between the view and the stated axis: 60°.
const LOOKS_COSINE: f64 = 0.5;
/// A stated window is a multiple of this, s, and is suggested only if the answers are this far apart.
const WINDOW_STEP_S: f64 = 0.01;

impl KnownOfCell {
    /// Whether an answer agrees with the statement.
    #[must_use]
    pub fn allows(&self, answer: &Parameters) -> bool {
        self.offset_within_s.is_none_or(|window_s| answer.time_offset_s.abs() <= window_s)
            && self.looks.is_none_or(|axis| cosine(answer, axis) >= LOOKS_COSINE)
    }
}

fn cosine(answer: &Parameters, axis: ToolAxis) -> f64 {
    // The optical axis of a camera, the range axis of a profiler.
    (answer.tool_from_camera.rotation * Vector3::z()).dot(&axis.direction())
}

/// The statements, each of which would select one of several answers.
#[must_use]
pub fn statements_for(answer: usize, answers: &[&Parameters]) -> Vec<Statement> {
    let others = || answers.iter().enumerate().filter(move |(k, _)| *k != answer).map(|(_, other)| *other);
    let own_s = answers[answer].time_offset_s.abs();
    let next_s = others().map(|other| other.time_offset_s.abs()).fold(f64::INFINITY, f64::min);
    let window_s = (0.5 * (own_s + next_s.min(own_s + 2.0)) / WINDOW_STEP_S).round() * WINDOW_STEP_S;
    let within = (own_s < window_s && window_s < next_s).then_some(Statement::OffsetWithin(window_s));
    let nearest = ToolAxis::ALL
        .into_iter()
        .max_by(|a, b| cosine(answers[answer], *a).total_cmp(&cosine(answers[answer], *b)));
    let looks = nearest.filter(|axis| {
        cosine(answers[answer], *axis) >= LOOKS_COSINE && others().all(|o| cosine(o, *axis) < LOOKS_COSINE)
    });
    within.into_iter().chain(looks.map(Statement::Looks)).collect()
}

/// The source of a decision between answers that the scan cannot separate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecidedBy {
    /// The initial guess.
    Guess,
    /// The user's statement about the cell.
    Statement,
}

impl DecidedBy {
    /// The name in results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Guess => "guess",
            Self::Statement => "statement",
        }
    }
}
