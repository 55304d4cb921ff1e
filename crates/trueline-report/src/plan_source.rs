//! Inputs of a plan's summary, page and JSON.

use trueline_method::axes::finding::AxisFinding;
use trueline_method::problem::parameters::LINES;
use trueline_plan::{Cell, Goal, Plan, Prediction, Rehearsal};

/// Inputs of all reports on a plan.
pub struct Source<'a> {
    /// Prior knowledge.
    pub cell: &'a Cell,
    /// The plan.
    pub plan: &'a Plan,
    /// Predicted calibration of its scan; `None` if it fails.
    pub rehearsal: Option<&'a Rehearsal>,
    /// The request.
    pub asked: Asked<'a>,
    /// Standard deviations that 95 % of the cells stay below in which the guess is wrong.
    pub wrong_guess: &'a [f64; LINES],
    /// The external axes with their predicted ±.
    pub axes: &'a [AxisFinding],
    /// Prediction in the course of the scan.
    pub over_time: &'a [(f64, Prediction)],
    /// Longer scans that come no nearer to the required seam error: duration, s, and result of each, m.
    pub longer: &'a [(f64, f64)],
    /// If a required seam error is missed, results of better robots: their accuracy and the seam error, m.
    pub better_robots: &'a [(f64, f64)],
    /// How to make it again.
    pub command: &'a str,
}

/// Request of a plan.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asked<'a> {
    /// Sigmas, if anything was.
    pub goal: Option<&'a Goal>,
    /// Seam error, m.
    pub seam_m: Option<f64>,
}
