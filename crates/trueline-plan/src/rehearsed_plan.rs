//! A plan that is rehearsed before it is returned: a path without aliases if there is one, and one for a required seam error.

use crate::cell::Cell;
use crate::criterion::Goal;
use crate::plan::{Plan, PlanError, PlanRequest};
use crate::planner::finalists;
use crate::rehearsal::{Rehearsal, rehearse};
use crate::shape::Shape;
use trueline_dataset::SensorSetup;

/// A plan and the predicted calibration of its scan.
#[derive(Clone, Debug)]
pub struct RehearsedPlan {
    /// The plan.
    pub plan: Plan,
    /// Predicted calibration of its scan; `None` if it fails.
    pub rehearsal: Option<Rehearsal>,
    /// The longer scans that were planned as well, and not chosen: duration, s, and the seam error that each leaves, m.
    pub longer: Vec<(f64, f64)>,
}

impl RehearsedPlan {
    fn of(cell: &Cell, setup: &SensorSetup, ask: &PlanRequest, plan: Plan) -> Self {
        let rehearsal = rehearse(cell, setup, ask.measurements, &plan.motion);
        Self { plan, rehearsal, longer: Vec::new() }
    }

    /// Whether its scan would be accepted, and no other answer explains much of it; true if it cannot be rehearsed.
    fn is_sound(&self) -> bool {
        self.rehearsal.as_ref().is_none_or(|rehearsal| rehearsal.accepted && !rehearsal.has_alias())
    }

    /// The seam error, m; infinite if it cannot be predicted.
    #[must_use]
    pub fn seam_error_m(&self) -> f64 {
        let error = self.rehearsal.as_ref().and_then(|rehearsal| rehearsal.seam_error);
        error.map_or(f64::INFINITY, |error| error.rms_m)
    }

    /// Factor by which the requirement is missed: of a seam error, and also of required sigmas. At most 1 if all is
    /// reached.
    #[must_use]
    pub fn missed_by(&self, ask: &PlanRequest) -> f64 {
        let seam = ask.seam.as_ref().map_or(f64::INFINITY, |goal| self.seam_error_m() / goal.wanted_m);
        let by_sigmas = ask.goal.missed_by(&self.plan.prediction.covariance);
        if ask.goal == Goal::default() { seam } else { seam.max(by_sigmas) }
    }
}

/// Searches from other random numbers before a path with an alias is accepted.
const ATTEMPTS: u64 = 3;

/// Plans by `planner`, again from other random numbers where another answer would explain too much of the scan: a path that
/// nearly repeats itself. If all have an alias, the first one, which reports it.
///
/// # Errors
/// As `planner`, of the first attempt.
pub fn without_alias(
    cell: &Cell,
    setup: &SensorSetup,
    ask: &PlanRequest,
    planner: impl Fn(&PlanRequest) -> Result<Plan, PlanError>,
) -> Result<RehearsedPlan, PlanError> {
    let attempt = |ask: &PlanRequest| Ok(RehearsedPlan::of(cell, setup, ask, planner(ask)?));
    first_sound(ask, attempt)
}

/// The plan of an attempt, or of further ones from other random numbers if it is not sound. If none is, the first one, which
/// reports it.
fn first_sound(
    ask: &PlanRequest,
    attempt: impl Fn(&PlanRequest) -> Result<RehearsedPlan, PlanError>,
) -> Result<RehearsedPlan, PlanError> {
    let first = attempt(ask)?;
    if first.is_sound() {
        return Ok(first);
    }
    let others = (1..ATTEMPTS)
        .filter_map(|k| attempt(&PlanRequest { seed: ask.seed.wrapping_add(k), ..ask.clone() }).ok());
    Ok(others.into_iter().find(RehearsedPlan::is_sound).unwrap_or(first))
}

/// Plans for the least seam error; again from other random numbers where the plan would not be accepted or has an alias.
///
/// # Errors
/// As [`crate::planner::plan`].
pub fn least_seam_error(
    cell: &Cell,
    setup: &SensorSetup,
    ask: &PlanRequest,
    tick: &(dyn Fn() + Sync),
) -> Result<RehearsedPlan, PlanError> {
    first_sound(ask, |ask| least_of_finalists(cell, setup, ask, tick))
}

/// Plans for the least seam error: the best path of each kind is rehearsed, and the sound one with the least error is taken.
/// Noise alone does not separate them: the effect of the sensor, the robot and the feature's bias differs from path to path.
fn least_of_finalists(
    cell: &Cell,
    setup: &SensorSetup,
    ask: &PlanRequest,
    tick: &(dyn Fn() + Sync),
) -> Result<RehearsedPlan, PlanError> {
    // A pass with the sensor spun competes where the cell allows it, and there is time; it wins when it pays.
    let spun = PlanRequest { shapes: vec![Shape::Spun], ..ask.clone() };
    let may_spin = cell.limits.spun_pass && !ask.shapes.contains(&Shape::Spun);
    let spun = if may_spin { finalists(cell, &spun, tick).unwrap_or_default() } else { Vec::new() };
    let plans = finalists(cell, ask, tick)?.into_iter().chain(spun);
    let rehearsed = plans.map(|plan| RehearsedPlan::of(cell, setup, ask, plan));
    let wanted_m = ask.seam.as_ref().map_or(1.0, |goal| goal.wanted_m);
    let cost = |made: &RehearsedPlan| {
        let by_sigmas = ask.goal.score(&made.plan.prediction.covariance);
        (!made.is_sound(), ask.seam_score(made.seam_error_m() / wanted_m, by_sigmas))
    };
    let best = rehearsed.min_by(|a, b| {
        let (a, b) = (cost(a), cost(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    best.ok_or(PlanError::NoSeam)
}

/// Durations that are tried for a required seam error, as fractions of the longest.
const PARTS: [f64; 4] = [0.15, 0.3, 0.6, 1.0];
/// A longer scan must reduce the distance from the requirement to this part of a shorter one's; else its time gains nothing.
const WORTH_ITS_TIME: f64 = 0.95;

/// Plans the shortest of four durations up to [`PlanRequest::duration_s`] that reaches the requirement, for example a seam
/// error. If a longer scan comes no nearer to it, the shorter one: the contributions of the robot and of the features' bias
/// do not shrink with time. The longer one's result is in [`RehearsedPlan::longer`].
///
/// # Errors
/// As [`crate::planner::plan`], for the longest, if no duration has a plan.
pub fn shortest_that_reaches(
    cell: &Cell,
    setup: &SensorSetup,
    ask: &PlanRequest,
    tick: &(dyn Fn() + Sync),
) -> Result<RehearsedPlan, PlanError> {
    let mut best: Result<RehearsedPlan, PlanError> = Err(PlanError::NoSeam);
    for part in PARTS {
        let ask = PlanRequest { duration_s: part * ask.duration_s, ..ask.clone() };
        let made = least_seam_error(cell, setup, &ask, tick);
        match (&mut best, made) {
            (Ok(shorter), Ok(longer)) if !is_worth_its_time(&ask, shorter, &longer) => {
                shorter.longer.push((ask.duration_s, longer.seam_error_m()));
                break;
            }
            (Ok(_), Err(_)) => {}
            (best, made) => *best = made,
        }
        if best.as_ref().is_ok_and(|best| best.is_sound() && best.missed_by(&ask) <= 1.0) {
            break;
        }
    }
    best
}

/// Whether a longer scan reaches the requirement, or comes clearly nearer to it; or is sound while the shorter one is
/// not.
fn is_worth_its_time(ask: &PlanRequest, shorter: &RehearsedPlan, longer: &RehearsedPlan) -> bool {
    if longer.is_sound() != shorter.is_sound() {
        return longer.is_sound();
    }
    let missed_by = longer.missed_by(ask);
    missed_by <= 1.0 || missed_by < WORTH_ITS_TIME * shorter.missed_by(ask)
}

/// Accuracies of robots better than the stated or assumed one, m.
const BETTER_ROBOTS_M: [f64; 4] = [0.2e-3, 0.1e-3, 0.05e-3, 0.02e-3];

/// Results of the same scan with better robots: accuracy and seam error, m, until the requirement is met. The bias of the
/// features shrinks with it, for the robot's errors hide it.
#[must_use]
pub fn with_better_robots(
    (cell, setup): (&Cell, &SensorSetup),
    ask: &PlanRequest,
    made: &RehearsedPlan,
) -> Vec<(f64, f64)> {
    let Some(now) = made.rehearsal.as_ref().and_then(|rehearsal| rehearsal.seam_error) else {
        return Vec::new();
    };
    let wanted_m = ask.seam.as_ref().map_or(0.0, |goal| goal.wanted_m);
    let mut found = Vec::new();
    for accuracy_m in BETTER_ROBOTS_M.into_iter().filter(|m| *m < 0.99 * now.levels.robot_accuracy_m) {
        let better = SensorSetup { robot_accuracy_m: Some(accuracy_m), ..setup.clone() };
        let error = rehearse(cell, &better, ask.measurements, &made.plan.motion).and_then(|r| r.seam_error);
        let Some(error) = error else { continue };
        found.push((accuracy_m, error.rms_m));
        if error.rms_m <= wanted_m {
            break;
        }
    }
    found
}
