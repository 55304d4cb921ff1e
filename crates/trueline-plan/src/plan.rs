//! The plan: the best motion within all limits, what it promises and what it uses.

use crate::cell::Cell;
use crate::constraints::{self, Constraint, Constraints};
use crate::criterion::Goal;
use crate::design::{DIMENSION, from_unit_box};
use crate::motion::Motion;
use crate::prediction::{self, Prediction, Sight, Truth};
use crate::search::{Effort, minimise};
use crate::shape::Shape;
use nalgebra::DVector;
use rayon::prelude::*;
use trueline_geometry::Pose;

/// What is asked of a plan.
#[derive(Clone, Debug)]
pub struct PlanRequest {
    /// Duration of the scan, s.
    pub duration_s: f64,
    /// What is wanted of it.
    pub goal: Goal,
    /// Shapes that may be used; the best wins.
    pub shapes: Vec<Shape>,
    /// Seed of the search: the same gives the same plan.
    pub seed: u64,
    /// Designs that are tried for each shape.
    pub evaluations: usize,
    /// Threads that search shapes side by side; the plan does not depend on it.
    pub threads: usize,
}

impl Default for PlanRequest {
    fn default() -> Self {
        Self {
            duration_s: 20.0,
            goal: Goal::default(),
            shapes: Shape::ALL.to_vec(),
            seed: 1,
            evaluations: 16_000,
            threads: 1,
        }
    }
}

/// A planned scan.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The motion.
    pub motion: Motion,
    /// What it promises at the guess.
    pub prediction: Prediction,
    /// What it uses of the limits, at the robot's own rate.
    pub constraints: Constraints,
    /// Its score: see [`Goal::score`].
    pub score: f64,
    /// The point of the unit box that the motion stands for.
    point: DVector<f64>,
}

impl Plan {
    /// Whether all that counts in a goal is reached.
    #[must_use]
    pub fn reaches(&self, goal: &Goal) -> bool {
        goal.missed_by(&self.prediction.covariance) <= 1.0
    }

    /// The poses to send, one every [`PATH_PERIOD_S`].
    #[must_use]
    pub fn path(&self) -> Vec<Pose> {
        self.motion.sampled(PATH_PERIOD_S)
    }
}

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The seam has no length.
    #[error("the seam's two ends are one point")]
    NoSeam,
    /// No motion keeps to the limits.
    #[error(
        "no scan of {duration_s} s keeps to all limits: the best would use {percent:.0} % of the {name} allowed",
        percent = 100.0 * used, name = constraint.name()
    )]
    NoRoom {
        /// Its duration, s.
        duration_s: f64,
        /// The limit that stands in the way.
        constraint: Constraint,
        /// How much of it would be used.
        used: f64,
    },
    /// All motions within the limits leave something unseen.
    #[error("within these limits a scan of {duration_s} s shows {rank} of {of} unknowns")]
    NotShown {
        /// Its duration, s.
        duration_s: f64,
        /// Directions shown.
        rank: usize,
        /// Of so many.
        of: usize,
    },
    /// A duration that no scan has.
    #[error("a scan takes from {least_s} to {most_s} s; {duration_s} s were asked for")]
    Duration {
        /// What was asked for, s.
        duration_s: f64,
        /// The shortest, s.
        least_s: f64,
        /// The longest, s.
        most_s: f64,
    },
}

impl PlanError {
    /// What the user can do about it.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::NoSeam => "give the points where the scan begins and ends",
            Self::NoRoom { constraint: Constraint::View, .. } => {
                "allow a larger stand_off_mm, or measure the guess better and lower [guess_error]: \
                 the seam must stay in view however wrong the guess is"
            }
            Self::NoRoom { constraint: Constraint::SeamEnds, .. } => {
                "the seam is short against how wrong the guess may be: give a longer one, or measure the guess better and \
                 lower [guess_error]"
            }
            Self::NoRoom { constraint: Constraint::Workspace, .. } => {
                "is the box in base, and does it hold the tool's origin rather than the seam?"
            }
            Self::NoRoom { .. } => "a longer duration or higher limits help",
            Self::NotShown { .. } => {
                "allow tilting about two axes; a better guess, and lower [guess_error], leaves more of the view to sweep"
            }
            Self::Duration { .. } => "twenty seconds are plenty in most cells",
        }
    }
}

/// Time between the poses of a path, s, whatever the rate of the robot's feedback: between them it may go straight.
pub const PATH_PERIOD_S: f64 = 4e-3;

/// Durations that are planned, s.
pub const DURATION_S: [f64; 2] = [2.0, 600.0];

/// A search keeps to this part of each limit, so that what a denser look finds is mostly still within it.
const MARGIN: f64 = 0.98;
/// Samples of the motion while searching, s: a swing of 1.2 Hz is then seen to 0.5 %.
const ROUGH_PERIOD_S: f64 = 0.025;
/// Frames that a search looks at are no further apart, s.
const ROUGH_FRAMES_S: f64 = 0.12;
/// Designs that leave something unseen come after all that show everything, and after them those that break limits.
const BROKEN: f64 = 1e6;

/// Plans a scan; `tick` is called for every design that is tried.
///
/// # Errors
/// [`PlanError`] says which limit stands in the way.
pub fn plan(cell: &Cell, ask: &PlanRequest, tick: &(dyn Fn() + Sync)) -> Result<Plan, PlanError> {
    check(cell, ask.duration_s)?;
    let searches: Vec<Search<'_>> =
        ask.shapes.iter().map(|shape| Search::new(cell, ask, *shape)).collect::<Result<_, _>>()?;
    let found = par_map(&searches, ask.threads, |search| searched(search, tick));
    best_sound(found.into_iter().flatten(), ask.duration_s)
}

/// A plan of the same shape for another duration, from one that is near: a quarter of the designs will do.
///
/// # Errors
/// As [`plan`].
pub fn replan(
    cell: &Cell,
    ask: &PlanRequest,
    near: &Plan,
    tick: &(dyn Fn() + Sync),
) -> Result<Plan, PlanError> {
    check(cell, ask.duration_s)?;
    let effort = Effort { evaluations: ask.evaluations / 4, spread: 0.1, population: 16 };
    let search = Search::new(cell, ask, near.motion.design().shape)?;
    let found = search.from(&near.point, effort, ask.seed, tick);
    best_sound(found.into_iter(), ask.duration_s)
}

fn check(cell: &Cell, duration_s: f64) -> Result<(), PlanError> {
    let [least_s, most_s] = DURATION_S;
    if !(duration_s >= least_s && duration_s <= most_s) {
        return Err(PlanError::Duration { duration_s, least_s, most_s });
    }
    if cell.seam.direction().is_none() {
        return Err(PlanError::NoSeam);
    }
    Ok(())
}

/// The best of those that keep to all limits; or what stands in the way of the one that comes nearest.
fn best_sound(found: impl Iterator<Item = Plan>, duration_s: f64) -> Result<Plan, PlanError> {
    let best = found.min_by(|a, b| rank(a).total_cmp(&rank(b)));
    let (constraint, used) =
        best.as_ref().map_or((Constraint::View, f64::INFINITY), |plan| plan.constraints.most());
    match best {
        Some(plan) if used <= 1.0 && plan.prediction.shows_all() => Ok(plan),
        Some(plan) if used <= 1.0 => {
            Err(PlanError::NotShown { duration_s, rank: plan.prediction.rank, of: prediction::UNKNOWNS })
        }
        _ => Err(PlanError::NoRoom { duration_s, constraint, used }),
    }
}

/// Short searches, from other random numbers each, that find out which valley is deep; another one goes to its bottom.
const SCOUTS: usize = 4;

/// The best design of one shape: half of the tries go to the scouts, half to the last search.
fn searched(search: &Search<'_>, tick: &(dyn Fn() + Sync)) -> Option<Plan> {
    let PlanRequest { evaluations, seed, .. } = *search.ask;
    let middle = DVector::repeat(DIMENSION, 0.5);
    let scout = Effort { evaluations: evaluations / (2 * SCOUTS), spread: 0.3, population: 16 };
    let scouted =
        (0..SCOUTS as u64).filter_map(|k| search.from(&middle, scout, seed.wrapping_add(1000 * k), tick));
    let best = scouted.min_by(|a, b| rank(a).total_cmp(&rank(b)))?;
    let last = Effort { evaluations: evaluations / 2, spread: 0.1, population: 24 };
    let end = search.from(&best.point, last, seed, tick);
    Some(end.filter(|end| rank(end) <= rank(&best)).unwrap_or(best))
}

/// Sound plans by their score, then those that leave something unseen, then broken ones.
fn rank(plan: &Plan) -> f64 {
    match (plan.constraints.most().1 <= 1.0, plan.prediction.shows_all()) {
        (true, true) => plan.score,
        (true, false) => BROKEN * (1.0 - 0.01 * plan.prediction.rank as f64),
        (false, _) => BROKEN * (1.0 + plan.constraints.excess(1.0)),
    }
}

/// The designs of one shape.
struct Search<'a> {
    cell: &'a Cell,
    ask: &'a PlanRequest,
    shape: Shape,
    truth: Truth,
    stride: usize,
}

impl<'a> Search<'a> {
    fn new(cell: &'a Cell, ask: &'a PlanRequest, shape: Shape) -> Result<Self, PlanError> {
        let truth = Truth::guessed(cell).ok_or(PlanError::NoSeam)?;
        let stride = ((ROUGH_FRAMES_S / cell.frame_period_s) as usize).max(1);
        Ok(Self { cell, ask, shape, truth, stride })
    }

    /// The best plan that a search from a point finds. Whenever it seems to have found a better one, that is looked at as
    /// closely as it will be used: what counts is what then remains.
    fn from(
        &self,
        start: &DVector<f64>,
        effort: Effort,
        seed: u64,
        tick: &(dyn Fn() + Sync),
    ) -> Option<Plan> {
        let mut best: Option<Plan> = None;
        minimise(start, effort, seed, |point| {
            tick();
            let Some(motion) = self.motion(point) else { return f64::INFINITY };
            let value = self.rough_value(&motion);
            if best.as_ref().is_some_and(|best| rank(best) <= value) {
                return value;
            }
            let Some(plan) = self.finished(motion, point.clone()) else { return value };
            let value = value.max(rank(&plan));
            if best.as_ref().is_none_or(|best| rank(&plan) < rank(best)) {
                best = Some(plan);
            }
            value
        });
        best
    }

    fn motion(&self, point: &DVector<f64>) -> Option<Motion> {
        let unit: &[f64; DIMENSION] = point.as_slice().try_into().ok()?;
        Some(Motion::new(self.cell, from_unit_box(&self.cell.limits, self.shape, self.ask.duration_s, unit)))
    }

    /// What the search minimises: the score, or for motions that break limits by how much they do.
    fn rough_value(&self, motion: &Motion) -> f64 {
        let Some(sights) = self.sights(motion, self.stride) else { return 100.0 * BROKEN };
        let excess = constraints::measure(self.cell, motion, ROUGH_PERIOD_S, &sights).excess(MARGIN);
        if excess > 0.0 {
            return BROKEN * (1.0 + excess);
        }
        match prediction::predict(self.cell, &sights, self.stride) {
            Some(prediction) if prediction.shows_all() => self.ask.goal.score(&prediction.covariance),
            Some(prediction) => BROKEN * (1.0 - 0.01 * prediction.rank as f64),
            None => BROKEN,
        }
    }

    fn sights(&self, motion: &Motion, stride: usize) -> Option<Vec<Sight>> {
        prediction::sights(self.cell, motion, &self.truth, stride)
    }

    /// The plan with every frame looked at, and limits checked at the path's own rate.
    fn finished(&self, motion: Motion, point: DVector<f64>) -> Option<Plan> {
        let sights = self.sights(&motion, 1)?;
        let constraints = constraints::measure(self.cell, &motion, PATH_PERIOD_S, &sights);
        let prediction = prediction::predict(self.cell, &sights, 1).or_else(|| {
            // Out of view somewhere: there is nothing to promise, but a constraint to name.
            Prediction::of(&prediction::FrameInformation::zeros())
        })?;
        let score = self.ask.goal.score(&prediction.covariance);
        Some(Plan { motion, prediction, constraints, score, point })
    }
}

/// Does one job for each item on so many threads; the answers come in the items' order.
fn par_map<I: Sync, T: Send>(items: &[I], threads: usize, job: impl Fn(&I) -> T + Sync) -> Vec<T> {
    match rayon::ThreadPoolBuilder::new().num_threads(threads.max(1)).build() {
        Ok(pool) => pool.install(|| items.par_iter().map(&job).collect()),
        // Where the system has no threads left, this one does.
        Err(_) => items.iter().map(&job).collect(),
    }
}
