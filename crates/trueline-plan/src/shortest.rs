//! The shortest scan that meets the requirement.

use crate::cell::Cell;
use crate::plan::{DURATION_S, Plan, PlanError, PlanRequest};
use crate::planner::{plan, replan};

/// Relative resolution of durations.
const RESOLUTION: f64 = 1.04;

/// Plans the shortest scan of at most [`PlanRequest::duration_s`] that reaches all of the goal's sigmas; if none does, the
/// longest: see [`Plan::reaches`].
///
/// Sigmas fall with the duration, by more than its root where a short scan has no room to swing, so the duration is
/// bracketed and halved on a logarithmic scale. The shape is that of the best long scan.
///
/// # Errors
/// As [`plan`], for the longest scan.
pub fn shortest(cell: &Cell, ask: &PlanRequest, tick: &(dyn Fn() + Sync)) -> Result<Plan, PlanError> {
    let mut best = plan(cell, ask, tick)?;
    if !best.reaches(&ask.goal) {
        return Ok(best);
    }
    let (mut short_s, mut long_s) = (DURATION_S[0], ask.duration_s);
    while long_s / short_s > RESOLUTION {
        let duration_s = (short_s * long_s).sqrt();
        match replan(cell, &PlanRequest { duration_s, ..ask.clone() }, &best, tick) {
            Ok(plan) if plan.reaches(&ask.goal) => {
                long_s = duration_s;
                best = plan;
            }
            // Too short for the requirement, or for the limits.
            _ => short_s = duration_s,
        }
    }
    Ok(best)
}
