//! The search for the plan: which valleys are deep, then the bottom of the deepest.

use crate::axis_goal;
use crate::cell::Cell;
use crate::constraints::{self, Constraint, Constraints};
use crate::design::{dimension, from_unit_box};
use crate::expected_axes::all_hidden;
use crate::motion::Motion;
use crate::mounted_arm::{JointPath, NoStance, Stance};
use crate::pattern::{self, AXIS_PATTERN};
use crate::plan::{DURATION_S, PATH_PERIOD_S, Plan, PlanError, PlanRequest};

use crate::predicted_frames::PredictedFrames;
use crate::robustness_to_guess::{SeenBy, Views, WrongCells};
use crate::seam::Seam;
use crate::search::Minimiser;
use crate::shape::Shape;
use crate::stand_off::stand_offs_in_view;
use crate::target::Target;
use crate::truth::Truth;
use nalgebra::DVector;
use rayon::prelude::*;
use trueline_geometry::Pose;

/// A search keeps to this part of each limit, so that a finer check mostly stays within it.
const MARGIN: f64 = 0.99;
/// The same for the losses of wrong cells: a search uses few of them.
const LOSS_MARGIN: f64 = 0.85;
/// Samples of the motion while searching, s: speeds of a swing of 1.2 Hz are then seen to 1.5 %, jerks to 5 %.
const ROUGH_PERIOD_S: f64 = 0.08;
/// Times that a motion is slowed down.
const SLOWED: usize = 3;
/// The factor by which motion across the seam is slowed. It is slightly larger than necessary, so that few
/// repetitions are needed.
const SLOWER: f64 = 1.002;
/// The same for the arm's joints, without a check of their jerk.
const ROUGH_JOINTS_S: f64 = 0.08;
/// Largest spacing of the frames in a search, s.
const ROUGH_FRAMES_S: f64 = 0.2;
/// Wrong cells use one of this many of these frames.
const ROUGH_VIEWS: usize = 2;
/// Order of bad designs, after all complete ones: those with something undetermined, those that lose frames in wrong
/// cells, those that lose the seam at the guess, and last those outside limits.
const BROKEN: f64 = 1e6;

/// Tries for each scout, without which it finds nothing: a quarter of them at first.
const LEAST_SCOUT: usize = 800;

/// Plans a scan; `tick` is called for every design that is tried.
///
/// # Errors
/// [`PlanError`] names the limit.
pub fn plan(cell: &Cell, ask: &PlanRequest, tick: &(dyn Fn() + Sync)) -> Result<Plan, PlanError> {
    best_sound(cell, searched(cell, ask, tick)?.into_iter(), ask.duration_s)
}

/// The best plan of each kind of path, the best of all first: all keep to all limits and show everything.
///
/// # Errors
/// As [`plan`].
pub fn finalists(cell: &Cell, ask: &PlanRequest, tick: &(dyn Fn() + Sync)) -> Result<Vec<Plan>, PlanError> {
    let all = searched(cell, ask, tick)?;
    let best = best_sound(cell, all.iter().cloned(), ask.duration_s)?;
    let others = all.into_iter().filter(|plan| rank(plan) < UNSEEN);
    let mut finalists = vec![best];
    for plan in others {
        let shape = |plan: &Plan| plan.motion.design().shape;
        match finalists.iter_mut().find(|known| shape(known) == shape(&plan)) {
            Some(known) if rank(&plan) < rank(known) => *known = plan,
            Some(_) => {}
            None => finalists.push(plan),
        }
    }
    Ok(finalists)
}

/// The results of all scouts. The best ones get more tries, twice, each half of the remaining ones.
fn searched(cell: &Cell, ask: &PlanRequest, tick: &(dyn Fn() + Sync)) -> Result<Vec<Plan>, PlanError> {
    check(cell, ask.duration_s)?;
    let place = Place::of(cell, ask)?;
    let valleys = if cell.has_exact_guess() { 2 } else { 4 };
    let valleys = (ask.evaluations / LEAST_SCOUT).clamp(1, valleys);
    let size = dimension(cell);
    let one = |shape: Shape, k: usize| {
        let seed = ask.seed.wrapping_add(1000 * k as u64);
        match pattern::of(shape).filter(|_| k == 0) {
            Some(known) => {
                let start = known.iter().chain(AXIS_PATTERN.iter().cycle());
                let start = DVector::from_iterator(size, start.copied().take(size));
                Search::about(&place, shape, &start, NEAR_SPREAD, seed)
            }
            None => Search::about(&place, shape, &DVector::repeat(size, 0.5), SPREAD, seed),
        }
    };
    let mut searches: Vec<Search<'_>> =
        ask.shapes.iter().flat_map(|shape| (0..valleys).map(|k| one(*shape, k))).collect();
    let all = ask.evaluations * ask.shapes.len();
    let count = searches.len();
    for (kept, tries) in [(count, all / 4), (count.div_ceil(3), all / 4), (count.div_ceil(8), all - all / 2)]
    {
        searches.sort_by(|a, b| a.rank().total_cmp(&b.rank()));
        par_each(&mut searches[..kept], ask.threads, |search| search.run(tries / kept, tick));
    }
    Ok(searches.into_iter().filter_map(|search| search.best).collect())
}

/// A plan of the same shape for a slightly different duration: a quarter of the designs suffices.
///
/// # Errors
/// As [`plan`].
pub(crate) fn replan(
    cell: &Cell,
    ask: &PlanRequest,
    near: &Plan,
    tick: &(dyn Fn() + Sync),
) -> Result<Plan, PlanError> {
    check(cell, ask.duration_s)?;
    let place = Place::of(cell, ask)?;
    let mut search = Search::about(&place, near.motion.design().shape, &near.point, NEAR_SPREAD, ask.seed);
    search.run(ask.evaluations / 4, tick);
    best_sound(cell, search.best.into_iter(), ask.duration_s)
}

/// First spread of a search in the unit box, and of one that begins near a plan or a pattern.
const SPREAD: f64 = 0.15;
/// See [`SPREAD`].
const NEAR_SPREAD: f64 = 0.1;
/// Designs of a generation.
const POPULATION: usize = 16;

fn check(cell: &Cell, duration_s: f64) -> Result<(), PlanError> {
    let [least_s, most_s] = DURATION_S;
    if !(duration_s >= least_s && duration_s <= most_s) {
        return Err(PlanError::Duration { duration_s, least_s, most_s });
    }
    if cell.seam.direction().is_none() {
        return Err(PlanError::NoSeam);
    }
    let allowed_m = cell.limits.stand_off_m;
    match stand_offs_in_view(cell) {
        Some(seen_m) if seen_m[0] <= allowed_m[1] && seen_m[1] >= allowed_m[0] => Ok(()),
        seen_m => Err(PlanError::Blind { allowed_m, seen_m }),
    }
}

/// The best of the designs that keep all limits; or the obstacle of the one that comes nearest.
fn best_sound(cell: &Cell, found: impl Iterator<Item = Plan>, duration_s: f64) -> Result<Plan, PlanError> {
    let best = found.min_by(|a, b| rank(a).total_cmp(&rank(b)));
    let (constraint, used) =
        best.as_ref().map_or((Constraint::View, f64::INFINITY), |plan| plan.constraints.most());
    match best {
        Some(plan) if used <= 1.0 && plan.prediction.shows_all() => Ok(plan),
        Some(plan) if used <= 1.0 => {
            let Plan { motion, prediction, .. } = &plan;
            let hidden = all_hidden(cell, motion, prediction);
            Err(PlanError::NotShown { duration_s, rank: prediction.rank, of: prediction.asked, hidden })
        }
        _ => Err(PlanError::NoRoom { duration_s, constraint, used }),
    }
}

/// Sound plans by their score, then those that leave something undetermined, then broken ones.
fn rank(plan: &Plan) -> f64 {
    match (plan.constraints.most().1 <= 1.0, plan.prediction.shows_all()) {
        (true, true) => plan.score.min(UNSEEN),
        (true, false) => unseen(plan.prediction.rank),
        (false, _) => BROKEN * (1.0 + plan.constraints.excess(1.0)),
    }
}

/// No score is worse than something unseen.
const UNSEEN: f64 = 0.5 * BROKEN;

fn unseen(rank: usize) -> f64 {
    BROKEN * (1.0 - 0.01 * rank as f64)
}

/// Data shared by all searches of a plan.
struct Place<'a> {
    cell: &'a Cell,
    ask: &'a PlanRequest,
    truth: Truth,
    target: Target,
    stride: usize,
    asked: WrongCells,
    judged: WrongCells,
    stance: Option<Stance>,
}

impl<'a> Place<'a> {
    fn of(cell: &'a Cell, ask: &'a PlanRequest) -> Result<Self, PlanError> {
        let truth = Truth::guessed(cell).ok_or(PlanError::NoSeam)?;
        let target = Target::of(cell, ask.measurements)?;
        let stride = ((ROUGH_FRAMES_S / cell.frame_period_s) as usize).max(1);
        let (asked, judged) = (WrongCells::for_search(cell), WrongCells::for_promise(cell));
        let stance = stance(cell)?;
        Ok(Self { cell, ask, truth, target, stride, asked, judged, stance })
    }

    /// The joints' path along poses; `None` without an arm.
    fn joints(&self, poses: &[Pose], period_s: f64) -> Option<JointPath> {
        let mounted = self.cell.arm.as_ref()?;
        Some(mounted.follow(self.stance.as_ref()?, poses, period_s))
    }

    /// Fractions of the arm's limits, and of the room above the plates, that a motion uses.
    fn with_arm(
        &self,
        constraints: Constraints,
        motion: &Motion,
        period_s: f64,
    ) -> (Constraints, Option<JointPath>) {
        if self.cell.arm.is_none() && self.cell.surroundings.is_empty() {
            return (constraints, None);
        }
        let poses = motion.sampled(period_s);
        let joints = self.joints(&poses, period_s);
        (constraints.with_arm(self.cell, &poses, joints.as_ref()), joints)
    }

    /// View of wrong cells in some frames.
    fn look(&self, cells: &WrongCells, motion: &Motion, sights: &PredictedFrames, stride: usize) -> Views {
        let some = sights.list.iter().step_by(stride);
        let poses = some.map(|sight| (sight.time_s, sight.placement.base_from_tool));
        cells.look((self.cell, motion), self.target.joint(), poses)
    }
}

/// The configuration of the arm; `None` without an arm.
fn stance(cell: &Cell) -> Result<Option<Stance>, PlanError> {
    let [near, far] = cell.limits.stand_off_m;
    // The straight seam has other ends than the curve. The whole path is checked later.
    let middle_m = 0.5 * (cell.seam.from_m + cell.seam.to_m);
    let seam = if cell.course.is_some() { Seam { from_m: middle_m, to_m: middle_m } } else { cell.seam };
    let found = (cell.arm.as_ref())
        .map(|mounted| mounted.stance(&seam, &cell.sensor_pose, 0.5 * (near + far)))
        .transpose();
    found.map_err(|why| PlanError::OutOfReach { middle: why == NoStance::Middle })
}

/// A design that is better by less is not examined closely on the way.
const CLEARLY: f64 = 0.995;

/// A search among the designs of one shape, and the best plan found. It may break limits if the search finds nothing
/// else.
struct Search<'a> {
    place: &'a Place<'a>,
    shape: Shape,
    minimiser: Minimiser,
    best: Option<Plan>,
}

impl<'a> Search<'a> {
    fn about(place: &'a Place<'a>, shape: Shape, start: &DVector<f64>, spread: f64, seed: u64) -> Self {
        Self { place, shape, minimiser: Minimiser::about(start, spread, POPULATION, seed), best: None }
    }

    /// The rank of the best plan.
    fn rank(&self) -> f64 {
        self.best.as_ref().map_or(f64::INFINITY, rank)
    }

    /// Tries more. A clearly better plan, and the final one, is examined as closely as in use: the result of that counts.
    fn run(&mut self, tries: usize, tick: &(dyn Fn() + Sync)) {
        let designs = Designs { place: self.place, shape: self.shape };
        let best = &mut self.best;
        let mut keep = |plan: Plan| {
            if best.as_ref().is_none_or(|best| rank(&plan) < rank(best)) {
                *best = Some(plan);
            }
        };
        let mut least = self.minimiser.best().map_or(f64::INFINITY, |found| found.value);
        self.minimiser.run(tries, |point| {
            tick();
            let Some((motion, demand)) = designs.motion(point) else { return f64::INFINITY };
            let value = designs.rough_value(&motion, &demand);
            if CLEARLY * least <= value {
                return value;
            }
            let Some(plan) = designs.finished(motion, point.clone()) else { return value };
            let is_sound = rank(&plan) < UNSEEN;
            let value = if is_sound { value } else { value.max(rank(&plan)) };
            least = least.min(value);
            keep(plan);
            value
        });
        if let Some(found) = self.minimiser.best()
            && let Some((motion, _)) = designs.motion(&found.point)
            && let Some(plan) = designs.finished(motion, found.point.clone())
        {
            keep(plan);
        }
    }
}

/// A motion and its demands, sampled at this period. The swings keep their width and are slowed until they keep a part of
/// all limits of speed and its derivatives.
fn paced(cell: &Cell, mut motion: Motion, period_s: f64, most: f64) -> (Motion, Constraints) {
    let mut demand = constraints::of_motion(cell, &motion, period_s);
    for _ in 0..SLOWED {
        let too_fast = demand.too_fast() / most;
        if too_fast <= 1.0 {
            break;
        }
        motion = Motion::new(cell, motion.design().clone().slowed(SLOWER * too_fast));
        demand = constraints::of_motion(cell, &motion, period_s);
    }
    (motion, demand)
}

/// The designs of one shape.
struct Designs<'a> {
    place: &'a Place<'a>,
    shape: Shape,
}

impl Designs<'_> {
    /// The motion of a point and its demands. A motion that is too fast is slowed down with the same swings. So the search
    /// finds the best motion at the limit itself, and does not approach it from below.
    fn motion(&self, point: &DVector<f64>) -> Option<(Motion, Constraints)> {
        let Place { cell, ask, .. } = self.place;
        let design = from_unit_box(cell, self.shape, ask.duration_s, point.as_slice());
        // Mostly a rougher look is enough to find the pace.
        let motion = Motion::new(cell, design);
        if !motion.has_time() {
            return None;
        }
        let (motion, _) = paced(cell, motion, 2.0 * ROUGH_PERIOD_S, MARGIN);
        Some(paced(cell, motion, ROUGH_PERIOD_S, MARGIN))
    }

    /// Value that the search minimises: the score, or for motions that break limits the amount. Cheap checks come first.
    fn rough_value(&self, motion: &Motion, demand: &Constraints) -> f64 {
        let Place { cell, ask, stride, .. } = self.place;
        let excess = demand.excess(MARGIN);
        if excess > 0.0 {
            return BROKEN * (10.0 + excess);
        }
        let (constraints, _) = self.place.with_arm(Constraints::default(), motion, ROUGH_JOINTS_S);
        let excess = constraints.excess(MARGIN);
        if excess > 0.0 {
            return BROKEN * (10.0 + excess);
        }
        let Some(sights) = PredictedFrames::of(cell, motion, &self.place.truth, *stride) else {
            return 100.0 * BROKEN;
        };
        let rooms = sights.list.iter().map(|sight| cell.view.room(&sight.point_in_camera));
        let least_room = rooms.fold(f64::INFINITY, f64::min);
        if least_room < 1.0 - MARGIN {
            return BROKEN * (5.0 - least_room.max(-4.0));
        }
        let views = self.place.look(&self.place.asked, motion, &sights, ROUGH_VIEWS);
        let used = views.loss().used() / LOSS_MARGIN;
        if used > 1.0 {
            return BROKEN * used.min(4.0);
        }
        let every = self.place.target.rough_frames();
        let sights = sights.thinned(every);
        let seen_by: Vec<SeenBy> =
            (0..sights.list.len()).map(|k| views.seen_by[k * every / ROUGH_VIEWS]).collect();
        let measured = self.place.target.measured(cell, &self.place.truth, &sights, &seen_by);
        let Some((covariance, of_axes)) = measured.covariance() else {
            return measured.prediction().map_or(BROKEN, |prediction| unseen(prediction.rank));
        };
        let by_axes = axis_goal::score(&cell.axes, &ask.goal, &of_axes);
        let by_sigmas = ask.goal.smooth_score(&covariance).max(by_axes);
        let score = match &ask.seam {
            Some(goal) => {
                let left_m = measured.seam_error_m(goal, cell, &sights);
                left_m.map(|left_m| ask.seam_score(left_m / goal.wanted_m, by_sigmas))
            }
            None => Some(by_sigmas),
        };
        score.map_or(UNSEEN, |score| score.min(UNSEEN))
    }

    /// The plan with every frame checked, and limits checked at the path's own rate; it may have to be a little slower.
    fn finished(&self, motion: Motion, point: DVector<f64>) -> Option<Plan> {
        let Place { cell, ask, truth, target, stride, judged, .. } = self.place;
        let (motion, demand) = paced(cell, motion, PATH_PERIOD_S, 1.0);
        let sights = PredictedFrames::of(cell, &motion, truth, 1)?;
        let views = self.place.look(judged, &motion, &sights, *stride);
        let loss = views.loss();
        let seen_by: Vec<SeenBy> = (0..sights.list.len()).map(|k| views.seen_by[k / stride]).collect();
        let points = sights.list.iter().map(|sight| sight.point_in_camera);
        let constraints = demand.with_view(cell, points, &loss);
        let (constraints, joints) = self.place.with_arm(constraints, &motion, PATH_PERIOD_S);
        let measured = target.measured(cell, truth, &sights, &seen_by);
        let prediction = measured.prediction()?;
        let by_axes = axis_goal::score(&cell.axes, &ask.goal, &prediction.axes);
        let by_sigmas = ask.goal.score(&prediction.covariance).max(by_axes);
        let score = match &ask.seam {
            Some(goal) => {
                let left_m = measured.seam_error_m(goal, cell, &sights)?;
                ask.seam_score(left_m / goal.wanted_m, by_sigmas)
            }
            None => by_sigmas,
        };
        Some(Plan { motion, target: *target, prediction, constraints, loss, joints, seen_by, score, point })
    }
}

/// Processes each item on a number of threads, independently of the others.
fn par_each<I: Send>(items: &mut [I], threads: usize, job: impl Fn(&mut I) + Sync + Send) {
    match rayon::ThreadPoolBuilder::new().num_threads(threads.max(1)).build() {
        Ok(pool) => pool.install(|| items.par_iter_mut().for_each(&job)),
        // If the system has no threads left, the present one does the work.
        Err(_) => items.iter_mut().for_each(job),
    }
}
