//! The plan: the best motion within all limits, what it promises and what it uses.

use crate::cell::Cell;
use crate::criterion::Goal;
use crate::demands::{self, Demand, Demands, Looks};
use crate::design::{DIMENSION, from_unit_box};
use crate::motion::Motion;
use crate::prediction::{self, Prediction};
use crate::search::{Effort, minimise};
use crate::shape::Shape;
use nalgebra::DVector;
use trueline_geometry::Pose;

/// What is asked of a plan.
#[derive(Clone, Debug)]
pub struct Ask {
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

impl Default for Ask {
    fn default() -> Self {
        Self {
            duration_s: 20.0,
            goal: Goal::default(),
            shapes: Shape::ALL.to_vec(),
            seed: 1,
            evaluations: 12_000,
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
    pub demands: Demands,
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

    fn is_sound(&self) -> bool {
        self.demands.most().1 <= 1.0 && self.prediction.shows_all()
    }

    /// The poses to send, one each robot period.
    #[must_use]
    pub fn path(&self, cell: &Cell) -> Vec<Pose> {
        self.motion.sampled(cell.robot_period_s)
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
        percent = 100.0 * used, name = demand.name()
    )]
    NoRoom {
        /// Its duration, s.
        duration_s: f64,
        /// The limit that stands in the way.
        demand: Demand,
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
            Self::NoRoom { demand: Demand::View, .. } => {
                "allow a larger stand_off_mm, or measure the guess better and lower [guess_error]: \
                 the seam must stay in view however wrong the guess is"
            }
            Self::NoRoom { demand: Demand::Workspace, .. } => {
                "is the box in base, and does it hold the tool's origin rather than the seam?"
            }
            Self::NoRoom { .. } => "a longer duration or higher limits help",
            Self::NotShown { .. } => "allow tilting about two axes and a sweep of the field of view",
            Self::Duration { .. } => "twenty seconds are plenty in most cells",
        }
    }
}

/// Durations that are planned, s.
pub const DURATION_S: [f64; 2] = [2.0, 600.0];

/// A search keeps to this part of each limit, so that what a denser look finds is still within it.
const MARGIN: f64 = 0.98;
/// Samples of the motion while searching, s: a swing of 1 Hz is then seen to 0.4 %.
const ROUGH_PERIOD_S: f64 = 0.025;
/// Frames that a search looks at.
const ROUGH_FRAMES: f64 = 160.0;
/// Designs that leave something unseen come after all that show everything, and after them those that break limits.
const BROKEN: f64 = 1e6;

/// Plans a scan; `tick` is called for every design that is tried.
///
/// # Errors
/// [`PlanError`] says which limit stands in the way.
pub fn plan(cell: &Cell, ask: &Ask, tick: &(dyn Fn() + Sync)) -> Result<Plan, PlanError> {
    check(cell, ask.duration_s)?;
    let start = Start { point: DVector::repeat(DIMENSION, 0.5), spread: 0.25, evaluations: ask.evaluations };
    let found = side_by_side(&ask.shapes, ask.threads, |shape| best_of(cell, ask, shape, &start, tick));
    best_sound(found.into_iter().flatten(), ask.duration_s)
}

/// A plan of the same shape for another duration, from one that is near: a quarter of the designs will do.
///
/// # Errors
/// As [`plan`].
pub fn replan(cell: &Cell, ask: &Ask, near: &Plan, tick: &(dyn Fn() + Sync)) -> Result<Plan, PlanError> {
    check(cell, ask.duration_s)?;
    let start = Start { point: near.point.clone(), spread: 0.1, evaluations: ask.evaluations / 4 };
    let found = best_of(cell, ask, near.motion.design().shape, &start, tick);
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
    let (sound, broken): (Vec<Plan>, Vec<Plan>) = found.partition(Plan::is_sound);
    if let Some(best) = sound.into_iter().min_by(|a, b| a.score.total_cmp(&b.score)) {
        return Ok(best);
    }
    let excess = |plan: &Plan| plan.demands.excess(1.0);
    let nearest = broken.into_iter().min_by(|a, b| excess(a).total_cmp(&excess(b)));
    let (demand, used) = nearest.as_ref().map_or((Demand::View, f64::INFINITY), |plan| plan.demands.most());
    match nearest {
        Some(plan) if used <= 1.0 => {
            Err(PlanError::NotShown { duration_s, rank: plan.prediction.rank, of: prediction::UNKNOWNS })
        }
        _ => Err(PlanError::NoRoom { duration_s, demand, used }),
    }
}

/// Where a search begins.
struct Start {
    point: DVector<f64>,
    spread: f64,
    evaluations: usize,
}

/// The best design of one shape as a finished plan; `None` if it cannot even be predicted.
fn best_of(cell: &Cell, ask: &Ask, shape: Shape, start: &Start, tick: &(dyn Fn() + Sync)) -> Option<Plan> {
    let motion = |point: &DVector<f64>| -> Option<Motion> {
        let unit: &[f64; DIMENSION] = point.as_slice().try_into().ok()?;
        Some(Motion::new(cell, from_unit_box(cell, shape, ask.duration_s, unit)))
    };
    let frames = ask.duration_s / cell.frame_period_s;
    let looks = Looks { period_s: ROUGH_PERIOD_S, stride: (frames / ROUGH_FRAMES).ceil() as usize };
    let value = |point: &DVector<f64>| {
        tick();
        motion(point).map_or(f64::INFINITY, |motion| rough_value(cell, ask, &motion, looks))
    };
    let effort = Effort { evaluations: start.evaluations, spread: start.spread };
    let found = minimise(&start.point, effort, ask.seed, value);
    finished(cell, ask, motion(&found.point)?, found.point)
}

/// What the search minimises: the score, or for motions that break limits by how much they do.
fn rough_value(cell: &Cell, ask: &Ask, motion: &Motion, looks: Looks) -> f64 {
    let excess = demands::measure(cell, motion, looks).excess(MARGIN);
    if excess > 0.0 {
        return BROKEN * (1.0 + excess);
    }
    let prediction = prediction::predict(cell, motion, looks.stride);
    match prediction {
        Some(prediction) if prediction.shows_all() => ask.goal.score(&prediction.covariance),
        Some(prediction) => BROKEN * (1.0 - 0.01 * prediction.rank as f64),
        None => BROKEN,
    }
}

/// The plan with every frame looked at, and limits checked at the robot's rate.
fn finished(cell: &Cell, ask: &Ask, motion: Motion, point: DVector<f64>) -> Option<Plan> {
    let prediction = prediction::predict(cell, &motion, 1).or_else(|| {
        // Out of view somewhere: there is nothing to promise, but a demand to name.
        Prediction::of(&prediction::FrameInformation::zeros())
    })?;
    let demands = demands::measure(cell, &motion, Looks { period_s: cell.robot_period_s, stride: 1 });
    let score = ask.goal.score(&prediction.covariance);
    Some(Plan { motion, prediction, demands, score, point })
}

/// Runs one job for each shape on so many threads, in order.
fn side_by_side<T: Send>(shapes: &[Shape], threads: usize, job: impl Fn(Shape) -> T + Sync) -> Vec<T> {
    let threads = threads.clamp(1, shapes.len().max(1));
    let mut numbered: Vec<(usize, T)> = std::thread::scope(|scope| {
        let job = &job;
        let workers: Vec<_> = (0..threads)
            .map(|worker| {
                scope.spawn(move || {
                    let mine = shapes.iter().enumerate().skip(worker).step_by(threads);
                    mine.map(|(k, shape)| (k, job(*shape))).collect::<Vec<_>>()
                })
            })
            .collect();
        workers.into_iter().filter_map(|worker| worker.join().ok()).flatten().collect()
    });
    numbered.sort_by_key(|(k, _)| *k);
    numbered.into_iter().map(|(_, done)| done).collect()
}
