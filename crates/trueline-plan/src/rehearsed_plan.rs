//! A plan that is rehearsed before it is given out: no path with aliases if there is another, and one for a wanted seam error.

use crate::cell::Cell;
use crate::plan::{Plan, PlanError, PlanRequest};
use crate::planner::finalists;
use crate::rehearsal::{Rehearsal, rehearse};
use crate::shape::Shape;
use trueline_dataset::SensorSetup;

/// A plan and what its calibration would say.
#[derive(Clone, Debug)]
pub struct RehearsedPlan {
    /// The plan.
    pub plan: Plan,
    /// What calibrating its scan says; `None` if that cannot be done.
    pub rehearsal: Option<Rehearsal>,
}

impl RehearsedPlan {
    /// Whether the seam error stays below a limit, m.
    #[must_use]
    pub fn reaches_seam_error(&self, wanted_m: f64) -> bool {
        let error = self.rehearsal.as_ref().and_then(|rehearsal| rehearsal.seam_error);
        error.is_some_and(|error| error.rms_m <= wanted_m)
    }
}

/// Searches from other random numbers before a path with an alias is accepted.
const ATTEMPTS: u64 = 3;

/// Plans by `planner`, again from other random numbers where another answer would explain too much of the scan: a path that
/// nearly repeats itself. If all have an alias, the first one, which says so.
///
/// # Errors
/// As `planner`, of the first attempt.
pub fn without_alias(
    cell: &Cell,
    setup: &SensorSetup,
    ask: &PlanRequest,
    planner: impl Fn(&PlanRequest) -> Result<Plan, PlanError>,
) -> Result<RehearsedPlan, PlanError> {
    let attempt = |ask: &PlanRequest| {
        let plan = planner(ask)?;
        let rehearsal = rehearse(cell, setup, ask.measurements, &plan.motion);
        Ok(RehearsedPlan { plan, rehearsal })
    };
    let is_clear =
        |made: &RehearsedPlan| !made.rehearsal.as_ref().is_some_and(|rehearsal| rehearsal.has_alias());
    let first = attempt(ask)?;
    if is_clear(&first) {
        return Ok(first);
    }
    let others = (1..ATTEMPTS)
        .filter_map(|k| attempt(&PlanRequest { seed: ask.seed.wrapping_add(k), ..ask.clone() }).ok());
    Ok(others.into_iter().find(is_clear).unwrap_or(first))
}

/// Plans for the least seam error: the best path of each kind is rehearsed, and of those without an alias the one that leaves least is
/// taken. Noise alone does not tell them apart: what the sensor, the robot and the feature's bias do differs from path to path.
///
/// # Errors
/// As [`crate::planner::plan`].
pub fn least_seam_error(
    cell: &Cell,
    setup: &SensorSetup,
    ask: &PlanRequest,
    tick: &(dyn Fn() + Sync),
) -> Result<RehearsedPlan, PlanError> {
    // A pass with the sensor spun competes where the cell allows it, and there is time; it wins when it pays.
    let spun = PlanRequest { shapes: vec![Shape::Spun], ..ask.clone() };
    let may_spin = cell.limits.spun_pass && !ask.shapes.contains(&Shape::Spun);
    let spun = if may_spin { finalists(cell, &spun, tick).unwrap_or_default() } else { Vec::new() };
    let rehearsed = finalists(cell, ask, tick)?.into_iter().chain(spun).map(|plan| {
        let rehearsal = rehearse(cell, setup, ask.measurements, &plan.motion);
        RehearsedPlan { plan, rehearsal }
    });
    let cost = |made: &RehearsedPlan| {
        let rehearsal = made.rehearsal.as_ref();
        let error_m = rehearsal.and_then(|r| r.seam_error).map_or(f64::INFINITY, |error| error.rms_m);
        (rehearsal.is_some_and(Rehearsal::has_alias), error_m)
    };
    let best = rehearsed.min_by(|a, b| {
        let (a, b) = (cost(a), cost(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    best.ok_or(PlanError::NoSeam)
}

/// Durations that are tried for a wanted seam error, as parts of the longest.
const PARTS: [f64; 4] = [0.15, 0.3, 0.6, 1.0];

/// Plans the shortest of four durations up to [`PlanRequest::duration_s`] that reaches what is wanted, a seam error say; where none
/// does, the longest: what the robot and the bias of the features add does not shrink with time.
///
/// # Errors
/// As [`crate::planner::plan`], for the longest, where no duration has a plan.
pub fn shortest_that_reaches(
    cell: &Cell,
    setup: &SensorSetup,
    ask: &PlanRequest,
    reached: impl Fn(&RehearsedPlan) -> bool,
    tick: &(dyn Fn() + Sync),
) -> Result<RehearsedPlan, PlanError> {
    let mut longest = Err(PlanError::NoSeam);
    for part in PARTS {
        let ask = PlanRequest { duration_s: part * ask.duration_s, ..ask.clone() };
        let made = least_seam_error(cell, setup, &ask, tick);
        let is_enough = made.as_ref().is_ok_and(&reached);
        if made.is_ok() || longest.is_err() {
            longest = made;
        }
        if is_enough {
            break;
        }
    }
    longest
}
