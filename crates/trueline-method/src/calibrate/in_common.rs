//! Frames that several answers can place, so that their likelihoods are of the same data.

use crate::input::noise_levels::Whitener;
use crate::input::observations::Observation;
use crate::problem::line_problem::LineProblem;

/// The observations of a problem that meet a condition, with their whiteners.
#[must_use]
pub(crate) fn some_of(
    problem: &LineProblem<'_>,
    is_such: impl Fn(&Observation) -> bool,
) -> (Vec<Observation>, Vec<Whitener>) {
    problem.selected().filter(|(o, _)| is_such(o)).map(|(o, whitener)| (*o, *whitener)).unzip()
}
