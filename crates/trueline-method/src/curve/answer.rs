//! The answer to a scan over a curve: the best fit, its rivals, and its observability.

use crate::assess::share::{Share, ShareOf};
use crate::config::known_of_cell::KnownOfCell;
use crate::curve::arrow::SHARED;
use crate::curve::clamped::moved_by_m;
use crate::curve::considered::{Considered, Errors, of_shared};
use crate::curve::equations::{Known, sights, whiteners};
use crate::curve::estimate::{CurveEstimate, estimate};
use crate::curve::improved::{Improved, improved};
use crate::curve::joint::Rough;
use crate::curve::order::{Obstacle, obstacle};
use crate::curve::passes::Course;
use crate::curve::readings::Readings;
use crate::curve::rivals::{Rival, compared, find};
use crate::curve::rows::Whitener;
#[cfg(test)]
use crate::curve::sight::step_between;
use crate::curve::sight::{Sight, in_base};
use crate::curve::solve::{DECISIVE, Finished, Search, finish, refined};
use crate::curve::starts::{Candidate, offsets_s, sifted_by};
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, SMatrix, Vector3};
use trueline_dataset::Guess;
use trueline_model::SheetShape;

/// Standard deviation of a hand-eye transform with a prior, rad and m.
const KNOWN_TO: (f64, f64) = (2.0 * std::f64::consts::PI / 180.0, 10e-3);
/// A held hand-eye transform counts as known to this fraction of that.
const HELD: f64 = 1e-3;
/// Knots that do not follow the weave may enlarge the residuals by this factor. Beyond it the curve needs finer knots.
const WORSE: f64 = 1.5;
/// Windows explain the scan if they explain more than this fraction of it.
const EXPLAINED_BY_WINDOWS: f64 = 0.5;
/// The request.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    /// The search.
    pub search: Search<'a>,
    /// Errors besides noise.
    pub errors: Errors<'a>,
    /// Prior knowledge of the cell.
    pub known: &'a KnownOfCell,
}

/// The answer.
pub(crate) struct Answered {
    /// Fit and equations.
    pub finished: Finished,
    /// The estimated curve.
    pub curve: CurveEstimate,
    /// Whether each of t_d, φ and t is determined.
    pub components: [bool; SHARED],
    /// Whether the hand-eye transform was held at the guess.
    pub is_held: bool,
    /// Covariance from noise.
    pub noise: SMatrix<f64, SHARED, SHARED>,
    /// Contributions of all other errors.
    pub shares: Vec<Share>,
    /// Correction of the sensor's sheet; `None` if its shape is held.
    pub shape: Option<SheetShape>,
    /// Rivals, the most dangerous first.
    pub rivals: Vec<Rival>,
    /// Course of the scan along the curve.
    pub course: Course,
}

impl Answered {
    /// Rivals that the scan cannot separate from the answer. In a single pass the curve follows each of them, so all that explain
    /// the scan count.
    pub(crate) fn open(&self) -> impl Iterator<Item = &Rival> {
        let is_loose = self.curve.is_one_pass && !self.is_held;
        self.rivals.iter().filter(move |rival| rival.is_named() && (is_loose || !rival.test.decided()))
    }

    /// Fraction of the readings that the curve does not explain.
    #[must_use]
    pub(crate) fn share_off(&self) -> f64 {
        let weights = &self.finished.fitted.weights;
        weights.iter().filter(|weight| **weight == 0.0).count() as f64 / weights.len().max(1) as f64
    }

    /// The seam points at the answer, with their whiteners, also where support points are used instead of them.
    #[must_use]
    pub(crate) fn seam_points(&self, readings: &Readings) -> (Vec<Option<Sight>>, Vec<Whitener>) {
        let fitted = &self.finished.fitted;
        if fitted.state.plates.is_none() {
            return (fitted.sights.clone(), fitted.whiteners.clone());
        }
        let sights = sights(readings, &fitted.state);
        let factor = self.finished.factor / self.finished.variance.sqrt();
        let whiteners = whiteners(readings, &sights).into_iter().map(|whitener| whitener / factor).collect();
        (sights, whiteners)
    }

    /// Clock and hand-eye transform.
    #[must_use]
    pub(crate) fn at(&self) -> Guess {
        self.finished.fitted.state.at
    }
}

impl Asked<'_> {
    /// The answer.
    ///
    /// # Errors
    /// If no curve explains most of the scan; with the cause, if it is known.
    pub(crate) fn answer(&self) -> Result<Answered, Option<Obstacle>> {
        let found = self.search.find();
        match found.best.as_ref().filter(|best| best.is_good()) {
            Some(best) => self.of_rough(best.clone()).ok_or(None),
            None => Err(found.nearest.and_then(|candidate| self.obstacle(&candidate))),
        }
    }

    /// Reason that windows explain the scan and no curve does.
    fn obstacle(&self, nearest: &Candidate) -> Option<Obstacle> {
        if 1.0 - nearest.cost < EXPLAINED_BY_WINDOWS {
            return None;
        }
        let readings = self.search.readings.searched();
        let place = |reading| in_base(&readings, reading, &nearest.at);
        let points: Vec<Vector3<f64>> = readings.list.iter().filter_map(place).collect();
        obstacle(&points)
    }

    /// The answer from a rough fit.
    fn of_rough(&self, best: Rough) -> Option<Answered> {
        let readings = self.search.readings;
        let searched = readings.searched();
        let course = Course::of(&searched, &best.first);
        if let Some(guess) = self.search.guess.filter(|_| course.is_one_pass) {
            return self.of_time_alone(guess, &course);
        }
        let rivals = find(&searched, &best, self.search.within_s, self.search.threads);
        let (best, rivals) = match better(&best, &rivals).or_else(|| self.stated(&best, &rivals)) {
            None => (best, rivals),
            Some(other) => {
                let best = other.rough.clone();
                let rivals = find(&searched, &best, self.search.within_s, self.search.threads);
                (best, rivals)
            }
        };
        let fine = finish(readings, &best, 0.0, None)?;
        let (finished, is_near_weave) = self.coarser(fine, &best, &course, None)?;
        Some(self.concluded(finished, rivals, &course, (is_near_weave, None)))
    }

    /// The rival that agrees with the prior knowledge of the cell, if the best answer does not.
    fn stated<'r>(&self, best: &Rough, rivals: &'r [Rival]) -> Option<&'r Rival> {
        let allows =
            |rough: &Rough| self.known.allows(&Parameters::straight(&rough.fitted.state.at, Vec::new()));
        let is_open = |rival: &&Rival| rival.is_named() && !rival.test.decided();
        if self.known.is_empty() || allows(best) {
            return None;
        }
        rivals.iter().filter(is_open).find(|rival| allows(&rival.rough))
    }

    /// The time offset alone; the hand-eye transform is held at the guess.
    fn of_time_alone(&self, guess: &Guess, course: &Course) -> Option<Answered> {
        let readings = self.search.readings;
        let searched = readings.searched();
        let known = held_at(guess);
        let starts: Vec<Guess> = offsets_s(self.search.within_s)
            .into_iter()
            .map(|time_offset_s| Guess { time_offset_s, ..*guess })
            .collect();
        let candidates = sifted_by(&searched, &starts, 2.0, (true, self.search.threads));
        let fit = |candidate: &Candidate| {
            crate::curve::joint::rough(&searched, &candidate.at, Some(&known)).filter(Rough::is_good)
        };
        let best = candidates.iter().find_map(fit)?;
        let rivals = compared(&searched, &best, &candidates, Some(&known), self.search.threads);
        let other = better(&best, &rivals).or_else(|| self.stated(&best, &rivals));
        let best = other.map_or_else(|| best.clone(), |other| other.rough.clone());
        let rivals = compared(&searched, &best, &candidates, Some(&known), self.search.threads);
        let fine = finish(readings, &best, 0.0, Some(&known))?;
        let (finished, is_near_weave) = self.coarser(fine, &best, course, Some(&known))?;
        Some(self.concluded(finished, rivals, course, (is_near_weave, Some(guess))))
    }

    /// A single pass with knots that do not follow the weave; whether the curve needs finer knots.
    fn coarser(
        &self,
        fine: Finished,
        best: &Rough,
        course: &Course,
        stated: Option<&Known>,
    ) -> Option<(Finished, bool)> {
        let least_m = course.least_knots_m(fine.fitted.state.spline.length_m());
        if fine.fitted.state.spline.spacing_m >= least_m {
            return Some((fine, false));
        }
        match finish(self.search.readings, best, least_m, stated) {
            Some(coarse) if coarse.factor <= WORSE * fine.factor => Some((coarse, false)),
            _ => Some((fine, true)),
        }
    }

    /// The rivals without those that are less likely. A wrong offset lays the passes beside each other: the curve is longer and
    /// fits each reading as well, because it has more freedom. And if the part moves, only a fit without its moves can be compared.
    fn likely(&self, rivals: Vec<Rival>, finished: &Finished, course: &Course) -> Vec<Rival> {
        let moves = self.errors.part.is_some();
        let length_m = finished.fitted.state.spline.length_m();
        let is_unlikely = |rival: &Rival| {
            let is_weighed = !course.is_one_pass && (moves || rival.rough.is_longer_than(length_m));
            let is_open = is_weighed && rival.is_named() && !rival.test.decided();
            let fine = is_open.then(|| finish(self.search.readings, &rival.rough, 0.0, None)).flatten();
            let fine = fine.map(|fine| self.with_errors(fine, true).finished);
            fine.is_some_and(|fine| finished.log_likelihood() - fine.log_likelihood() > DECISIVE)
        };
        rivals.into_iter().filter(|rival| !is_unlikely(rival)).collect()
    }

    /// The fit with the estimated errors, if `is_whole`, and the shares of all errors.
    fn with_errors(&self, finished: Finished, is_whole: bool) -> Improved {
        let readings = self.search.readings;
        let refit = |readings: &Readings, fit: &Finished| self.refitted(readings, fit);
        let improved = is_whole.then(|| improved(readings, &finished, &self.errors, refit)).flatten();
        improved.unwrap_or_else(|| {
            let considered = self.errors.at(readings, &finished.fitted);
            let share = |one: &Considered| one.share(&finished.fitted, &finished.root);
            let shares = considered.iter().map(share).collect();
            Improved { finished, shares, shape: None }
        })
    }

    /// The same fit to other readings.
    fn refitted(&self, readings: &Readings, finished: &Finished) -> Option<Finished> {
        if finished.fitted.state.placed.is_none() {
            return refined(readings, finished);
        }
        let asked = Asked { search: Search { readings, ..self.search }, ..*self };
        let fit = asked.finished(finished.fitted.state.clone(), None, finished.s3_m)?;
        Some(Finished { evidence: finished.evidence, first_length_m: finished.first_length_m, ..fit })
    }

    /// The answer from a fit.
    pub(crate) fn concluded(
        &self,
        finished: Finished,
        rivals: Vec<Rival>,
        course: &Course,
        (is_near_weave, held_at): (bool, Option<&Guess>),
    ) -> Answered {
        let readings = self.search.readings;
        let is_whole = held_at.is_none() && !course.is_one_pass;
        let Improved { finished, shares: of_all, shape } = self.with_errors(finished, is_whole);
        let rivals = self.likely(rivals, &finished, course);
        let labels = readings.labels();
        let moved_by_m = is_whole.then(|| moved_by_m(readings, &finished, &self.errors)).flatten();
        let curve = estimate((&finished, &labels), &of_all, course, is_near_weave);
        let curve = CurveEstimate { part_moved_m: moved_by_m, ..curve };
        let is_collapsed = curve.collapsed_from_m.is_some();
        let mut components = finished.seen.components;
        if course.is_one_pass || is_collapsed {
            components[1..].fill(false);
        }
        // Without a known hand-eye transform the time offset of a single pass is not determined either.
        components[0] &= !course.is_one_pass && !is_near_weave && !is_collapsed;
        let mut shares: Vec<Share> = of_all.iter().map(of_shared).collect();
        let (noise, held) = match held_at {
            // A drawing gives the bends of the curve.
            None if finished.fitted.state.placed.is_some() => {
                (finished.seen.covariance, DMatrix::zeros(SHARED, 0))
            }
            None => (rough_curve(&finished), DMatrix::zeros(SHARED, 0)),
            Some(_) => time_alone(&finished),
        };
        if held_at.is_some() {
            let known = noise[(0, 0)].sqrt().hypot(held.row(0).norm());
            components[0] = known < TIME_SEEN_S && !is_near_weave && !is_collapsed;
        }
        shares.push(Share { of: ShareOf::Held, columns: held, shape: None });
        let is_held = held_at.is_some();
        Answered { curve, components, is_held, noise, shares, rivals, finished, shape, course: *course }
    }
}

/// A time offset with a larger standard deviation is not determined, s.
const TIME_SEEN_S: f64 = 5e-3;

/// A rival that is clearly better than the best answer, and not only because its curve is longer.
fn better<'r>(best: &Rough, rivals: &'r [Rival]) -> Option<&'r Rival> {
    let length_m = best.fitted.state.spline.length_m();
    let is_better = |rival: &&Rival| rival.is_named() && rival.test.reversed();
    rivals.iter().filter(is_better).find(|rival| !rival.rough.is_longer_than(length_m))
}

/// The hand-eye transform as the guess states it.
pub(crate) fn held_at(guess: &Guess) -> Known {
    let mut information = SMatrix::<f64, SHARED, SHARED>::zeros();
    for k in 1..SHARED {
        let known_to = if k < 4 { KNOWN_TO.0 } else { KNOWN_TO.1 };
        information[(k, k)] = (HELD * known_to).powi(-2);
    }
    Known { centre: *guess, information }
}

/// Covariance from noise. The time offset's is that for third differences three times larger, because bends differ along a curve.
fn rough_curve(finished: &Finished) -> SMatrix<f64, SHARED, SHARED> {
    const LARGER: f64 = 3.0;
    let mut covariance = finished.seen.covariance;
    let larger = crate::curve::seen::Seen::of(
        &finished.fitted,
        &finished.parts,
        finished.s3_m * LARGER,
        finished.variance,
    );
    let posterior = |s3_m: f64| {
        let information = finished.parts.with(s3_m).root()?.shared_information() / finished.variance;
        Some(information.cholesky()?.inverse()[(0, 0)])
    };
    let by_posterior = match (posterior(finished.s3_m), posterior(LARGER * finished.s3_m)) {
        (Some(own), Some(larger)) if own > 0.0 => (larger / own).max(1.0),
        _ => 1.0,
    };
    let by_seen = larger.map_or(1.0, |larger| (larger.covariance[(0, 0)] / covariance[(0, 0)]).max(1.0));
    let root = by_posterior.max(by_seen).sqrt();
    for k in 0..SHARED {
        covariance[(0, k)] *= root;
        covariance[(k, 0)] *= root;
    }
    covariance
}

/// Standard deviation of the time offset from noise beside a held hand-eye transform, and its error from that of the transform.
fn time_alone(finished: &Finished) -> (SMatrix<f64, SHARED, SHARED>, DMatrix<f64>) {
    let equations = finished.parts.of_data(finished.s3_m);
    let information = equations.root().map_or_else(SMatrix::zeros, |root| root.shared_information());
    let own = information[(0, 0)].max(f64::MIN_POSITIVE);
    let mut noise = SMatrix::<f64, SHARED, SHARED>::zeros();
    noise[(0, 0)] = finished.variance / own;
    let mut held = DMatrix::zeros(SHARED, SHARED - 1);
    for k in 1..SHARED {
        let size = if k < 4 { KNOWN_TO.0 } else { KNOWN_TO.1 };
        held[(k, k - 1)] = size;
        held[(0, k - 1)] = -information[(0, k)] / own * size;
    }
    (noise, held)
}

/// Distance between two states, in units of a covariance of the second: for tests.
#[cfg(test)]
pub(crate) fn squared_sigmas(
    truth: &Guess,
    found: &Guess,
    covariance: &SMatrix<f64, SHARED, SHARED>,
) -> Option<f64> {
    let step = step_between(truth, found);
    Some(step.dot(&covariance.cholesky()?.solve(&step)))
}
