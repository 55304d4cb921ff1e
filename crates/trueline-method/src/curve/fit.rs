//! The joint fit of curve, clock and hand-eye transform: Levenberg–Marquardt with re-weighting.

use crate::curve::arrow::{Arrow, SHARED};
use crate::curve::equations::{Known, State, add_known, add_prior, add_sights, sights, stepped, whiteners};
use crate::curve::placed;
use crate::curve::plates::Plates;
use crate::curve::readings::Readings;
use crate::curve::rows::Whitener;
use crate::curve::sight::{Sight, step_between};
use crate::order_statistics::median;
use nalgebra::DVector;
use trueline_lsq::Loss;

/// Weighting of residuals.
#[derive(Clone, Debug)]
pub(crate) enum Weighing {
    /// A redescending loss of this scale, m: far from the optimum.
    Rough {
        /// The scale, m.
        scale_m: f64,
    },
    /// Noise times a factor; beyond [`TUKEY_SIGMAS`] the weight is zero.
    Noise {
        /// Noise factor: noise divided by the expected noise.
        factor: f64,
    },
    /// Noise times a factor, with constant weights.
    Fixed {
        /// Noise factor: noise divided by the expected noise.
        factor: f64,
        /// Weight of each reading.
        weights: Vec<f64>,
    },
}

/// Beyond this a reading is an outlier, σ.
pub(crate) const TUKEY_SIGMAS: f64 = 5.0;
/// Median of the squared length of two standard normal components, and of four, σ², for each pair.
const MEDIAN_SQUARED: [f64; 2] = [1.386_294, 1.678_347];
/// Pairs of rows of a reading with support points.
const PAIRS_OF_SUPPORTS: f64 = 2.0;
/// Squared residual of a reading that the curve does not reach.
const UNREACHED: f64 = 1e9;
/// Noise of readings that scales a prior beside residuals in units of a rough scale, m.
const ROUGH_NOISE_M: f64 = 0.05e-3;
/// Longest step in t_d (s), φ (rad) and t (m).
const MOST_STEP: [f64; 3] = [0.05, 0.2, 0.05];
/// The fit has converged if a step gains less than this fraction of the cost.
pub(crate) const CONVERGED: f64 = 1e-7;

/// Cost to minimise.
pub(crate) struct Terms<'a> {
    /// The readings.
    pub readings: &'a Readings,
    /// Their weighting.
    pub weighing: Weighing,
    /// Standard deviation of the curve's third differences, m.
    pub s3_m: f64,
    /// Prior of the shared unknowns.
    pub known: &'a Known,
    /// Maximum number of steps.
    pub steps: usize,
}

/// A state with everything evaluated at it.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    /// The state.
    pub state: State,
    /// Its sights.
    pub sights: Vec<Option<Sight>>,
    /// Whitener of each reading, with the noise factor.
    pub whiteners: Vec<Whitener>,
    /// Weight of each reading.
    pub weights: Vec<f64>,
    /// Twice the negative logarithm of likelihood and prior, robust.
    pub cost: f64,
}

impl Fitted {
    /// Fraction of the readings within a distance, m.
    #[must_use]
    pub(crate) fn share_within(&self, distance_m: f64) -> f64 {
        let near = |seen: &&Sight| seen.residual.norm() < distance_m;
        self.sights.iter().flatten().filter(near).count() as f64 / self.sights.len().max(1) as f64
    }

    /// The equations of the readings, with what is known of place and plates beside the form of the curve.
    #[must_use]
    pub(crate) fn equations(&self) -> Arrow {
        let mut equations = self.state.arrow();
        add_sights(&mut equations, &self.state, &self.sights, &self.whiteners, &self.weights);
        if self.state.placed.is_some() {
            placed::add_loose_place(&mut equations, self.state.spline.control.len());
        }
        self.state.add_plates(&mut equations);
        equations
    }

    /// Weighted sum of the squares of the whitened residuals.
    #[must_use]
    pub(crate) fn squares(&self) -> f64 {
        let own = |k: usize| {
            let seen = self.sights[k].as_ref()?;
            Some(self.weights[k] * seen.pairs() * seen.squared(&self.whiteners[k]))
        };
        (0..self.sights.len()).filter_map(own).sum()
    }

    /// Weighted number of the rows.
    #[must_use]
    pub(crate) fn rows(&self) -> f64 {
        let own = |(seen, weight): (&Option<Sight>, &f64)| Some(2.0 * seen.as_ref()?.pairs() * weight);
        self.sights.iter().zip(&self.weights).filter_map(own).sum()
    }

    /// The noise factor, from the median length of residuals that are whitened with a factor of one.
    #[must_use]
    pub(crate) fn median_factor(&self, readings: &Readings) -> f64 {
        let whiteners = whiteners(readings, &self.sights);
        let of = |(seen, whitener): (&Option<Sight>, &Whitener)| {
            let seen = seen.as_ref()?;
            Some((seen.squared(whitener) / MEDIAN_SQUARED[seen.rows / 2 - 1]).sqrt())
        };
        median(self.sights.iter().zip(&whiteners).filter_map(of)).unwrap_or(1.0)
    }
}

impl Terms<'_> {
    fn loss(&self) -> Loss {
        match self.weighing {
            Weighing::Rough { .. } => Loss::GemanMcClure { scale: 1.0 },
            Weighing::Noise { .. } | Weighing::Fixed { .. } => Loss::Tukey { scale: TUKEY_SIGMAS },
        }
    }

    /// Weight of the prior beside whitened residuals, 1/m².
    fn stiffness(&self) -> f64 {
        match self.weighing {
            Weighing::Rough { scale_m } => (ROUGH_NOISE_M / (scale_m * self.s3_m)).powi(2),
            Weighing::Noise { .. } | Weighing::Fixed { .. } => self.s3_m.powi(-2),
        }
    }

    fn whiteners(&self, sights: &[Option<Sight>]) -> Vec<Whitener> {
        match self.weighing {
            Weighing::Rough { scale_m } => vec![Whitener::identity() / scale_m; sights.len()],
            Weighing::Noise { factor } | Weighing::Fixed { factor, .. } => {
                let own = whiteners(self.readings, sights);
                own.into_iter().map(|whitener| whitener / factor).collect()
            }
        }
    }

    /// Evaluates a state; whiteners stay constant within a fit.
    fn evaluated(&self, mut state: State, whiteners: Vec<Whitener>) -> Fitted {
        let sights = sights(self.readings, &state);
        let loss = self.loss();
        let (mut weights, mut cost) = (Vec::with_capacity(sights.len()), 0.0);
        for (k, seen) in sights.iter().enumerate() {
            let squared = seen.as_ref().map_or(UNREACHED, |seen| seen.squared(&whiteners[k]));
            let pairs = if self.readings.list[k].supports().is_some() { PAIRS_OF_SUPPORTS } else { 1.0 };
            if let Some(seen) = seen {
                state.u_m[k] = seen.u_m;
            }
            let (weight, own) = match &self.weighing {
                Weighing::Fixed { weights, .. } => {
                    (weights[k], weights[k] * squared.min(TUKEY_SIGMAS.powi(2)))
                }
                _ => (loss.weight(squared), loss.value(squared)),
            };
            weights.push(if seen.is_some() { weight } else { 0.0 });
            cost += pairs * own;
        }
        let bent: f64 = state.bends().iter().map(|bend| bend.norm_squared()).sum();
        let off = step_between(&state.at, &self.known.centre);
        cost += self.stiffness() * bent + off.dot(&(self.known.information * off));
        cost += state.plates.as_ref().map_or(0.0, Plates::squares);
        Fitted { state, sights, whiteners, weights, cost }
    }

    /// The equations of all terms.
    #[must_use]
    pub(crate) fn equations(&self, fitted: &Fitted) -> Arrow {
        let mut prior = fitted.state.arrow();
        add_prior(&mut prior, &fitted.state);
        let mut equations = fitted.equations().plus(&prior, self.stiffness());
        add_known(&mut equations, &fitted.state.at, self.known);
        if fitted.state.placed.is_some() {
            placed::damp_place(&mut equations, fitted.state.spline.control.len());
        }
        equations
    }

    /// The optimum near a state; `None` if the equations have no solution.
    #[must_use]
    pub(crate) fn fit(&self, state: State) -> Option<Fitted> {
        /// Initial damping, its factors, and the limit beyond which no step helps.
        const DAMPING: [f64; 4] = [1e-3, 0.2, 6.0, 1e6];
        let first = sights(self.readings, &state);
        let mut best = self.evaluated(state, self.whiteners(&first));
        let mut damping = DAMPING[0];
        for _ in 0..self.steps {
            let equations = self.equations(&best);
            let before = best.cost;
            loop {
                let root = equations.damped(damping).root();
                let tried = root.map(|root| {
                    let step = limited(root.solve(&equations.gradient));
                    self.evaluated(stepped(&best.state, &step), best.whiteners.clone())
                });
                if let Some(better) = tried.filter(|tried| tried.cost < before) {
                    best = better;
                    damping = (damping * DAMPING[1]).max(1e-9);
                    break;
                }
                damping *= DAMPING[2];
                if damping > DAMPING[3] {
                    return best.cost.is_finite().then_some(best);
                }
            }
            if before - best.cost < CONVERGED * (1.0 + best.cost) {
                break;
            }
        }
        best.cost.is_finite().then_some(best)
    }
}

/// The step, shortened to the limit of each shared unknown.
fn limited(step: DVector<f64>) -> DVector<f64> {
    let shared = step.len() - SHARED;
    let lengths = [
        step[shared].abs(),
        step.fixed_rows::<3>(shared + 1).norm(),
        step.fixed_rows::<3>(shared + 4).norm(),
    ];
    let over = lengths.iter().zip(MOST_STEP).map(|(length, most)| length / most).fold(1.0, f64::max);
    step / over
}
