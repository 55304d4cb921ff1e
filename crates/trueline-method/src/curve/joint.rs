//! From an answer of the windows to a curve: order, a first spline, and the joint fit with ever finer knots.

use crate::curve::equations::{Known, State};
use crate::curve::fit::{Fitted, Terms, Weighing};
use crate::curve::knots::{MOST_CONTROL, Piece, joined, reknotted, spacing_for};
use crate::curve::order::curve_through;
use crate::curve::passes::is_one_pass;
use crate::curve::readings::Readings;
use crate::curve::seen::Seen;
use crate::curve::sight::{in_base, moving};
use crate::curve::smoothness::{Parts, loosest_m};
use nalgebra::Vector3;
use trueline_dataset::Guess;

/// Longest curve, as a multiple of the robot's path.
const MOST_LENGTH: f64 = 3.0;
/// Knots of the search, m. Coarser knots, or starting with few knots, shrink the curve and with it the lever.
const SEARCH_KNOTS_M: f64 = 10e-3;
/// Stages: knots in these units, scale of the loss, m.
const STAGES: [(f64, f64); 3] = [(1.6, 3e-3), (1.2, 1.2e-3), (1.0, 0.4e-3)];
/// Steps of a stage.
const STAGE_STEPS: usize = 8;
/// After the second stage this fraction of the readings must be within this distance, m.
const HOPEFUL: (f64, f64) = (0.25, 2e-3);
/// A good answer has this fraction of the readings within this distance, m; wrong ones reach 0.46.
pub(crate) const GOOD: (f64, f64) = (0.62, 0.5e-3);
/// Maximum number of readings in the search.
const MOST_READINGS: usize = 700;
/// Directions with less than this share of the required information at the first curve are held during the search.
const HELD_MEANWHILE: f64 = 0.6;

/// A curve that fits a scan roughly.
#[derive(Clone, Debug)]
pub(crate) struct Rough {
    /// The fit.
    pub fitted: Fitted,
    /// Its start: the curve of the windows' answer.
    pub first: State,
    /// Fraction of the readings within half a millimetre.
    pub within: f64,
    /// Whether its curve has no place that is seen twice: a wrong offset lays the passes beside each other, as one longer curve.
    pub is_one_pass: bool,
}

impl Rough {
    /// Whether it explains enough to be an answer.
    #[must_use]
    pub(crate) fn is_good(&self) -> bool {
        self.within > GOOD.0
    }

    /// Whether it needs no other candidate beside it: passes that repeat themselves agree by no chance.
    #[must_use]
    pub(crate) fn is_settled(&self) -> bool {
        self.is_good() && !self.is_one_pass && self.is_kept()
    }

    /// Whether the fit kept the length of its start. An open curve through places of a closed one may run away where no reading holds it, and
    /// its knots are then too far apart for the rest.
    #[must_use]
    pub(crate) fn is_kept(&self) -> bool {
        /// A start cuts the corners of its curve: of a pipe that is half of it.
        const GROWN: f64 = 1.75;
        self.fitted.state.spline.length_m() < GROWN * self.first.spline.length_m()
    }

    /// Whether its curve is longer than another by more than errors of the answer change a length.
    #[must_use]
    pub(crate) fn is_longer_than(&self, length_m: f64) -> bool {
        const LONGER: f64 = 1.25;
        self.fitted.state.spline.length_m() > LONGER * length_m
    }

    /// Whether it is better than another. Among good ones that is one that kept its length, and then one with repeated passes, if it explains
    /// as much: the freedom of one long pass explains a few outliers more.
    #[must_use]
    pub(crate) fn is_better_than(&self, other: &Self) -> bool {
        const A_FEW: f64 = 0.05;
        if self.is_good() && other.is_good() {
            if self.is_kept() != other.is_kept() {
                return self.is_kept();
            }
            if self.is_one_pass != other.is_one_pass {
                return other.is_one_pass && self.within > other.within - A_FEW;
            }
            return self.within > other.within + A_FEW;
        }
        self.within > other.within
    }
}

impl Readings {
    /// Every n-th reading, so that they are at most this number.
    #[must_use]
    pub(crate) fn thinned(&self, most: usize) -> Self {
        let every = self.list.len().div_ceil(most).max(1);
        Self { list: self.list.iter().step_by(every).copied().collect(), ..self.clone() }
    }

    /// The readings of a search.
    #[must_use]
    pub(crate) fn searched(&self) -> Self {
        self.thinned(MOST_READINGS)
    }

    /// Length of the tool's path during the readings, m.
    #[must_use]
    pub(crate) fn path_m(&self, at: &Guess) -> f64 {
        /// Sampling step of the path, s: shorter steps would add its noise.
        const STEP_S: f64 = 0.1;
        let mut places: Vec<Vector3<f64>> = Vec::new();
        let mut last_s = f64::NEG_INFINITY;
        for reading in &self.list {
            if reading.stamp_s - last_s >= STEP_S {
                last_s = reading.stamp_s;
                places.extend(moving(self, reading, at).map(|moving| moving.position));
            }
        }
        places.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }
}

/// The curve of an answer of the windows, and the place of each reading on it; each line of the readings is a piece.
#[must_use]
pub(crate) fn first_curve(readings: &Readings, at: &Guess) -> Option<State> {
    let spacing_m = STAGES[0].0 * SEARCH_KNOTS_M;
    let most_m = MOST_LENGTH * readings.path_m(at);
    let labels = readings.labels();
    let mut pieces = Vec::with_capacity(labels.len());
    for label in &labels {
        let own: Vec<usize> = readings.of_line(*label).collect();
        let placed: Vec<Option<Vector3<f64>>> =
            own.iter().map(|k| in_base(readings, &readings.list[*k], at)).collect();
        let points: Vec<Vector3<f64>> = placed.iter().flatten().copied().collect();
        let ends = (labels.len() == 1, MOST_CONTROL);
        let (spline, known_u_m) = curve_through(&points, spacing_m, ends, most_m)?;
        let mut next = known_u_m.into_iter();
        let u_m = placed.iter().map(|point| point.and_then(|_| next.next()).unwrap_or(0.0)).collect();
        pieces.push(Piece { spline, u_m, readings: own });
    }
    if pieces.len() == 1 {
        let Piece { spline, u_m, .. } = pieces.pop()?;
        return Some(State { at: *at, spline, u_m, placed: None, plates: None });
    }
    let all_count = vec![true; readings.list.len()];
    let (spline, u_m) = joined(&pieces, spacing_m, &all_count)?;
    Some(State { at: *at, spline, u_m, placed: None, plates: None })
}

/// The joint fit from an answer of the windows, with the prior of the hand-eye transform, if stated; `None` without a plausible
/// curve.
#[must_use]
pub(crate) fn rough(readings: &Readings, at: &Guess, stated: Option<&Known>) -> Option<Rough> {
    let first = first_curve(readings, at)?;
    let mut known = stated.cloned().unwrap_or_else(|| Known::of_any_sensor(at));
    let mut state = reknotted(&first, spacing_for(&first.spline, STAGES[0].0 * SEARCH_KNOTS_M), None)?;
    let mut last = None;
    for (stage, (knots, scale_m)) in STAGES.iter().enumerate() {
        let spacing_m = spacing_for(&state.spline, knots * SEARCH_KNOTS_M);
        if stage > 0 {
            state = reknotted(&state, spacing_m, None)?;
        }
        let s3_m = loosest_m(state.spline.spacing_m);
        let weighing = Weighing::Rough { scale_m: *scale_m };
        if stage == 0 && stated.is_none() {
            hold_unseen(readings, &state, &mut known);
        }
        let terms = Terms { readings, weighing, s3_m, known: &known, steps: STAGE_STEPS };
        let fitted = terms.fit(state)?;
        if stage == 1 && fitted.share_within(HOPEFUL.1) < HOPEFUL.0 {
            return None;
        }
        state = fitted.state.clone();
        last = Some(fitted);
    }
    let fitted = last?;
    let within = fitted.share_within(GOOD.1);
    let is_one_pass = is_one_pass(readings, &first);
    Some(Rough { fitted, first, within, is_one_pass })
}

/// Holds directions that a curve does not determine: it would shrink along them.
fn hold_unseen(readings: &Readings, state: &State, known: &mut Known) {
    let s3_m = loosest_m(state.spline.spacing_m);
    let weighing = Weighing::Rough { scale_m: STAGES[0].1 };
    let terms = Terms { readings, weighing, s3_m, known, steps: 0 };
    let Some(fitted) = terms.fit(state.clone()) else { return };
    let parts = Parts::of(&fitted, known);
    // In units of the scale: readings with noise of a twentieth of it determine the directions best.
    const NOISE_OF_SCALE: f64 = 0.05;
    if let Some(seen) = Seen::of(&fitted, &parts, s3_m, NOISE_OF_SCALE.powi(2)) {
        known.hold(&state.at, &seen.holding(HELD_MEANWHILE));
    }
}

impl Known {
    /// Holds the unobservable directions at a state as well.
    pub(crate) fn hold(&mut self, at: &Guess, information: &nalgebra::SMatrix<f64, 7, 7>) {
        if information.norm() > 0.0 {
            // The prior of any sensor is negligible beside the held directions.
            *self = Self { centre: *at, information: self.information + information };
        }
    }
}
