//! From readings to a curve: the search, from nothing or from a guess, and the final fit with fine knots.

use crate::curve::arrow::ArrowRoot;
use crate::curve::equations::{Known, State, sights};
use crate::curve::fit::{Fitted, TUKEY_SIGMAS, Terms, Weighing};
use crate::curve::joint::{Rough, rough};
use crate::curve::knots::{reknotted, spacing_for};
use crate::curve::order::places_on;
use crate::curve::readings::Readings;
use crate::curve::seen::Seen;
use crate::curve::sight::in_base;
use crate::curve::smoothness::{Parts, likeliest, loosest_m};
use crate::curve::starts::{Candidate, SEARCHES, everywhere, offsets_s, sifted};
use crate::parallel;
use nalgebra::Vector3;
use trueline_dataset::Guess;

/// Knots of the answer, m …
const KNOTS_M: f64 = 5e-3;
/// … with at least this number of readings each.
pub(crate) const READINGS_PER_KNOT: usize = 5;
/// Readings farther from the curve than this do not extend its end in the search, m.
const ENDS_WITHIN_M: f64 = 2e-3;
/// Rounds of noise level and weights, and steps of each.
const ROUNDS: usize = 4;
/// Steps of a round.
const STEPS: usize = 8;
/// Directions known to less than half of the required information are held.
const HELD: f64 = 1.0;
/// Duration of a window with a guess, s.
const GUESSED_WINDOW_S: f64 = 2.0;
/// Difference of log likelihoods that decides: that of 7 σ in one unknown, because the unknowns without a prior shift it by some units.
pub(crate) const DECISIVE: f64 = 25.0;
/// Third differences of a line with a bow, as a fraction of the stiffest tested size.
const OF_LINE_M: f64 = 1e-9;

/// A search.
#[derive(Clone, Copy)]
pub(crate) struct Search<'a> {
    /// All readings.
    pub readings: &'a Readings,
    /// Range of the time offset to either side of zero, s.
    pub within_s: f64,
    /// Start, if stated.
    pub guess: Option<&'a Guess>,
    /// Number of threads.
    pub threads: usize,
}

/// Result of a search.
pub(crate) struct Found {
    /// The best rough answer; `None` if no start leads to a curve.
    pub best: Option<Rough>,
    /// The best answer of the windows.
    pub nearest: Option<Candidate>,
}

/// The better of one and the first of some candidates.
fn nearer(before: Option<Candidate>, candidates: &[Candidate]) -> Option<Candidate> {
    before.into_iter().chain(candidates.first().copied()).min_by(|a, b| a.cost.total_cmp(&b.cost))
}

impl Search<'_> {
    /// The best rough answer.
    #[must_use]
    pub(crate) fn find(&self) -> Found {
        let readings = self.readings.searched();
        let (mut best, mut nearest) = (None, None);
        let guessed = self.guess.map(|guess| {
            let start = |time_offset_s: f64| Guess { time_offset_s, ..*guess };
            // The guess first; other explanations are tested afterwards.
            let starts: Vec<Guess> =
                std::iter::once(*guess).chain(offsets_s(self.within_s).into_iter().map(start)).collect();
            sifted(&readings, &starts, GUESSED_WINDOW_S, self.threads)
        });
        if let Some(candidates) = guessed {
            nearest = nearer(nearest, &candidates);
            best = self.first_good(&readings, &candidates, best);
        }
        for breadth in SEARCHES {
            if best.as_ref().is_some_and(|best| best.is_good() && best.is_kept()) {
                break;
            }
            let starts = everywhere(self.within_s, breadth.attitudes);
            let candidates = sifted(&readings, &starts, breadth.window_s, self.threads);
            nearest = nearer(nearest, &candidates);
            best = self.first_good(&readings, &candidates, best);
        }
        Found { best, nearest }
    }

    /// The first settled answer among candidates, or the best of all.
    fn first_good(
        &self,
        readings: &Readings,
        candidates: &[Candidate],
        before: Option<Rough>,
    ) -> Option<Rough> {
        let mut best = before;
        for some in candidates.chunks(self.threads.max(1)) {
            let found = parallel::map(self.threads, some.len(), |k| rough(readings, &some[k].at, None));
            for answer in found.into_iter().flatten() {
                if best.as_ref().is_none_or(|best| answer.is_better_than(best)) {
                    best = Some(answer);
                }
                // The rest of a chunk counts no more than with one thread.
                if best.as_ref().is_some_and(Rough::is_settled) {
                    return best;
                }
            }
        }
        best
    }
}

/// A curve with fine knots, at its optimum.
pub(crate) struct Finished {
    /// The fit, with constant weights and the noise factor in its whiteners.
    pub fitted: Fitted,
    /// Its equations.
    pub parts: Parts,
    /// Their root, prior included.
    pub root: ArrowRoot,
    /// Size of the third differences, m.
    pub s3_m: f64,
    /// Restricted log likelihood, and that of a line with a bow.
    pub evidence: [f64; 2],
    /// Effective number of unknowns.
    pub effective: f64,
    /// Variance of the noise over that of the whiteners.
    pub variance: f64,
    /// Noise factor: noise divided by the expected noise.
    pub factor: f64,
    /// Observability of the scan.
    pub seen: Seen,
    /// Length of the curve before the joint fit, where readings see it, m.
    pub first_length_m: f64,
}

impl Finished {
    /// Log likelihood of the scan with the curve integrated out, against other fits of the same scan.
    #[must_use]
    pub(crate) fn log_likelihood(&self) -> f64 {
        /// Loss of an outlier: Tukey's, a sixth of the square of its scale.
        const OF_OUTLIER: f64 = TUKEY_SIGMAS * TUKEY_SIGMAS / 6.0;
        let weights = &self.fitted.weights;
        let outliers = weights.iter().filter(|weight| **weight == 0.0).count() as f64;
        // Noise factor of the whiteners, whose determinants belong to the likelihood.
        let whitened = self.factor / self.variance.sqrt();
        self.evidence[0] - 2.0 * weights.len() as f64 * whitened.ln() - OF_OUTLIER * outliers
    }
}

/// The same state with all readings.
pub(crate) fn of_all(readings: &Readings, state: &State) -> State {
    let mut u_m = vec![0.0; readings.list.len()];
    for (label, control) in readings.labels().into_iter().zip(state.spline.pieces()) {
        let place = |k: usize| Some((k, in_base(readings, &readings.list[k], &state.at)?));
        let (own, points): (Vec<usize>, Vec<Vector3<f64>>) =
            readings.of_line(label).filter_map(place).unzip();
        let first_m = control.start as f64 * state.spline.spacing_m;
        for (k, place_m) in own.into_iter().zip(places_on(&state.spline.piece(control), &points)) {
            u_m[k] = first_m + place_m;
        }
    }
    State { u_m, ..state.clone() }
}

/// Knot spacing of an answer, m: fine, but with enough readings for each knot.
#[must_use]
pub(crate) fn knots_m(readings: &Readings, length_m: f64, least_m: f64) -> f64 {
    let most = (readings.list.len() / READINGS_PER_KNOT).max(1);
    KNOTS_M.max(least_m).max(length_m / most as f64)
}

/// The answer from a rough one, with knots of at least `least_m` and a prior of the shared unknowns, if stated.
#[must_use]
pub(crate) fn finish(
    readings: &Readings,
    from: &Rough,
    least_m: f64,
    stated: Option<&Known>,
) -> Option<Finished> {
    let state = of_all(readings, &from.fitted.state);
    let near = |seen: &Option<crate::curve::sight::Sight>| {
        f64::from(u8::from(seen.as_ref().is_some_and(|seen| seen.residual.norm() < ENDS_WITHIN_M)))
    };
    let seen_now = sights(readings, &state);
    let counts: Vec<f64> = seen_now.iter().map(near).collect();
    let mut placed = state.clone();
    for (u_m, seen) in placed.u_m.iter_mut().zip(&seen_now) {
        *u_m = seen.as_ref().map_or(*u_m, |seen| seen.u_m);
    }
    // Beyond its readings a curve may lead anywhere, so the knot spacing excludes the part that is cut off.
    let cut = reknotted(&placed, state.spline.spacing_m, Some(&counts))?.spline;
    let spacing_m = spacing_for(&cut, knots_m(readings, cut.length_m(), least_m));
    let state = reknotted(&placed, spacing_m, Some(&counts))?;
    settled(readings, state, stated, from.first.seen_length_m())
}

/// The answer with the knots of another, for readings with new stamps.
#[must_use]
pub(crate) fn refined(readings: &Readings, other: &Finished) -> Option<Finished> {
    settled(readings, other.fitted.state.clone(), None, other.first_length_m)
}

/// The optimum with the knots as they are: first noise level and weights with a loose prior, then the size of the third
/// differences.
pub(crate) fn settled(
    readings: &Readings,
    state: State,
    stated: Option<&Known>,
    first_length_m: f64,
) -> Option<Finished> {
    let s3_m = loosest_m(state.spline.spacing_m);
    let mut known = stated.cloned().unwrap_or_else(|| Known::of_any_sensor(&state.at));
    let (mut fitted, mut factor) = (None::<Fitted>, 0.0);
    let mut next = state;
    for round in 0..ROUNDS {
        if let Some(fitted) = &fitted {
            factor = fitted.median_factor(readings);
        } else {
            factor = first_factor(readings, &next);
        }
        let weighing = Weighing::Noise { factor };
        let terms = Terms { readings, weighing, s3_m, known: &known, steps: STEPS };
        let found = terms.fit(next)?;
        next = found.state.clone();
        if round == 0 && stated.is_none() {
            let seen = Seen::of(&found, &Parts::of(&found, &known), s3_m, 1.0)?;
            known.hold(&next.at, &seen.holding(HELD));
        }
        fitted = Some(found);
    }
    stiffened(readings, fitted?, factor, &known, first_length_m)
}

pub(crate) fn first_factor(readings: &Readings, state: &State) -> f64 {
    let sights = sights(readings, state);
    let fitted =
        Fitted { state: state.clone(), whiteners: Vec::new(), weights: Vec::new(), cost: 0.0, sights };
    fitted.median_factor(readings)
}

/// With the most likely size of the third differences and the same weights.
fn stiffened(
    readings: &Readings,
    loose: Fitted,
    factor: f64,
    known: &Known,
    first_length_m: f64,
) -> Option<Finished> {
    let weights = loose.weights.clone();
    let spacing_m = loose.state.spline.spacing_m;
    let (mut s3_m, _) = likeliest(&Parts::of(&loose, known), spacing_m)?;
    let mut fitted = loose;
    for _ in 0..2 {
        let weighing = Weighing::Fixed { factor, weights: weights.clone() };
        let terms = Terms { readings, weighing, s3_m, known, steps: STEPS };
        fitted = terms.fit(fitted.state)?;
        let (again_m, _) = likeliest(&Parts::of(&fitted, known), spacing_m)?;
        if again_m == s3_m {
            break;
        }
        s3_m = again_m;
    }
    let parts = Parts::of(&fitted, known);
    let root = parts.with(s3_m).root()?;
    let effective = parts.effective(&root);
    let variance = parts.noise_variance(effective);
    let seen = Seen::of(&fitted, &parts, s3_m, variance)?;
    let evidence = [parts.evidence(s3_m)?, parts.evidence(OF_LINE_M).unwrap_or(f64::NEG_INFINITY)];
    Some(Finished {
        evidence,
        effective,
        variance,
        factor: factor * variance.sqrt(),
        seen,
        root,
        parts,
        s3_m,
        fitted,
        first_length_m,
    })
}
