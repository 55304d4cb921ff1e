//! Inputs of a plan's summary, page and JSON.

use trueline_method::problem::parameters::LINES;
use trueline_plan::{Cell, Goal, Plan, Prediction, Rehearsal};

/// Inputs of all reports on a plan.
pub struct Source<'a> {
    /// What was known.
    pub cell: &'a Cell,
    /// What was planned.
    pub plan: &'a Plan,
    /// Predicted calibration of its scan; `None` if it fails.
    pub rehearsal: Option<&'a Rehearsal>,
    /// What was asked for.
    pub asked: Asked<'a>,
    /// Standard deviations that 95 % of the cells stay below in which the guess is wrong.
    pub wrong_guess: &'a [f64; LINES],
    /// What is promised as the scan goes on.
    pub over_time: &'a [(f64, Prediction)],
    /// Longer scans that come no nearer to the seam error that is wanted: duration, s, and what each leaves, m.
    pub longer: &'a [(f64, f64)],
    /// Where a wanted seam error is missed, what better robots would leave: their accuracy and the seam error, m.
    pub better_robots: &'a [(f64, f64)],
    /// How to make it again.
    pub command: &'a str,
}

/// What was asked of a plan.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asked<'a> {
    /// Sigmas, if anything was.
    pub goal: Option<&'a Goal>,
    /// Seam error, m.
    pub seam_m: Option<f64>,
}
