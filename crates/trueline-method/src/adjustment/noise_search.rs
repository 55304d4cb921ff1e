//! The likeliest noise of an adjustment: white noise alone, or correlated noise beside it, over a grid of models.

use crate::adjustment::coloured::{Coloured, Sums};
use crate::adjustment::equations::{Equations, Prior};
use crate::adjustment::table::Table;
use crate::parallel;
use std::ops::Range;

/// Amplitudes of correlated noise that are tried.
const AMPLITUDES: [f64; 8] = [0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0];
/// Correlation times of the short process that are tried, s.
const LASTS_S: [f64; 3] = [0.06, 0.2, 0.7];
/// Minimum gain in twice the log likelihood for another noise model.
const GAIN: f64 = 0.5;

/// How far from the present model others are tried, in steps of the grid.
#[derive(Clone, Copy)]
pub(crate) struct Reach {
    /// The short process of one direction beside the other.
    amplitude: usize,
    /// The long process.
    long: usize,
}

impl Reach {
    /// Every amplitude of the long process.
    pub(crate) const ALL: Self = Self { amplitude: 2, long: AMPLITUDES.len() };
    /// The neighbours of a model that fits nearly as well.
    pub(crate) const NEAR: Self = Self { amplitude: 1, long: 1 };
}

/// A first model with about this variance of correlated noise, in units of the white noise's.
#[must_use]
pub(crate) fn about(lasting: f64) -> Coloured {
    let away = |value: f64| (value.max(0.03).ln() - lasting.max(0.03).ln()).abs();
    let nearest = AMPLITUDES.into_iter().min_by(|a, b| away(*a).total_cmp(&away(*b)));
    Coloured { amplitude: nearest.unwrap_or(0.0), lasts_s: LASTS_S[1], long: 0.0 }
}

/// A scan with everything but its noise model.
pub(crate) struct Given<'a, const ROWS: usize> {
    /// The rows of the frames.
    pub table: &'a Table<ROWS>,
    /// Standard deviation of the white noise of each residual, in units of the expected noise.
    pub sigmas: [f64; ROWS],
    /// Prior of all estimated columns.
    pub prior: &'a Prior,
    /// Threads that share the work.
    pub threads: usize,
}

/// The likeliest noise of each residual about a first model: first alike in all, then each by itself, then the correlation time, then the long
/// process.
#[must_use]
pub(crate) fn likeliest<const ROWS: usize>(
    given: &Given<'_, ROWS>,
    first: [Coloured; ROWS],
    reach: Reach,
) -> [Coloured; ROWS] {
    let begun = first.map(Place::near);
    let mut search = Search {
        best: Chosen { of: begun, twice_negative_log: f64::INFINITY },
        likelihood: Likelihood { given, known: Vec::new(), solved: Vec::new() },
    };
    search.best.twice_negative_log = search.likelihood.of(begun);
    let with = |place: Place, amplitude: usize| Place { amplitude, ..place };
    search.try_all([begun.map(|place| with(place, 0))]);
    loop {
        let before = search.best.of[0];
        search.try_all(near(before.amplitude, 1, AMPLITUDES.len()).map(|all| [with(before, all); ROWS]));
        if search.best.of[0] == before {
            break;
        }
    }
    for direction in 0..ROWS {
        let of = search.best.of;
        let beside = near(of[direction].amplitude, reach.amplitude, AMPLITUDES.len());
        search.try_all(beside.map(|amplitude| {
            let mut other = of;
            other[direction].amplitude = amplitude;
            other
        }));
    }
    let of = search.best.of;
    let lasting = near(of[0].lasts, 1, LASTS_S.len());
    search.try_all(lasting.map(|lasts| of.map(|place| Place { lasts, ..place })));
    let of = search.best.of;
    let longer = near(of[0].long, reach.long, AMPLITUDES.len());
    search.try_all(longer.map(|long| of.map(|place| Place { long, ..place })));
    search.best.of.map(Place::noise)
}

/// The noise model of one direction, as indices into the values that are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    amplitude: usize,
    lasts: usize,
    long: usize,
}

impl Place {
    fn near(noise: Coloured) -> Self {
        Self {
            amplitude: place(&AMPLITUDES, noise.amplitude),
            lasts: place(&LASTS_S, noise.lasts_s),
            long: place(&AMPLITUDES, noise.long),
        }
    }

    fn noise(self) -> Coloured {
        Coloured {
            amplitude: AMPLITUDES[self.amplitude],
            lasts_s: LASTS_S[self.lasts],
            long: AMPLITUDES[self.long],
        }
    }
}

fn place(grid: &[f64], value: f64) -> usize {
    grid.iter().position(|there| *there >= value).unwrap_or(grid.len() - 1)
}

fn near(place: usize, reach: usize, count: usize) -> Range<usize> {
    place.saturating_sub(reach)..(place + reach + 1).min(count)
}

/// The likeliest noise so far.
struct Chosen<const ROWS: usize> {
    of: [Place; ROWS],
    twice_negative_log: f64,
}

struct Search<'a, const ROWS: usize> {
    best: Chosen<ROWS>,
    likelihood: Likelihood<'a, ROWS>,
}

impl<const ROWS: usize> Search<'_, ROWS> {
    fn try_all(&mut self, others: impl IntoIterator<Item = [Place; ROWS]>) {
        for of in others {
            let twice_negative_log = self.likelihood.of(of);
            if twice_negative_log + GAIN < self.best.twice_negative_log {
                self.best = Chosen { of, twice_negative_log };
            }
        }
    }
}

/// The restricted likelihood of noise models. Each is filtered and solved once.
struct Likelihood<'a, const ROWS: usize> {
    given: &'a Given<'a, ROWS>,
    known: Vec<((usize, Place), Sums)>,
    solved: Vec<([Place; ROWS], f64)>,
}

impl<const ROWS: usize> Likelihood<'_, ROWS> {
    fn of(&mut self, places: [Place; ROWS]) -> f64 {
        if let Some((_, twice_negative_log)) = self.solved.iter().find(|(solved, _)| *solved == places) {
            return *twice_negative_log;
        }
        let twice_negative_log = self.solve(places);
        self.solved.push((places, twice_negative_log));
        twice_negative_log
    }

    fn solve(&mut self, places: [Place; ROWS]) -> f64 {
        let Given { table, sigmas, prior, threads } = *self.given;
        let key = |direction: usize| (direction, places[direction]);
        let is_known = |direction: &usize| self.known.iter().any(|(known, _)| *known == key(*direction));
        let missing: Vec<usize> = (0..ROWS).filter(|direction| !is_known(direction)).collect();
        let found = parallel::map(threads, missing.len(), |k| {
            (key(missing[k]), table.whitened(missing[k], places[missing[k]].noise()).sums)
        });
        self.known.extend(found);
        let is_own = |direction: usize| self.known.iter().position(|(known, _)| *known == key(direction));
        let sums = std::array::from_fn(|direction| &self.known[is_own(direction).unwrap_or(0)].1);
        let equations = Equations::of::<ROWS>(sums, sigmas, prior.gradient.len());
        equations.solve(prior).map_or(f64::INFINITY, |solved| solved.twice_negative_log)
    }
}
