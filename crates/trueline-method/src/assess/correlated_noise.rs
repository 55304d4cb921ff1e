//! Correlated residuals: noise in time, or the form of the seam.
//!
//! The residuals of a real weld are correlated between frames. Either the detector's error persists for some frames, or the seam has a form: then
//! the same place has the same error in every pass and no information on time or attitude. Both are modelled as an Ornstein–Uhlenbeck process plus
//! white noise, in time or along the seam, in each of the two directions across it. The restricted likelihood \[Patterson1971\] selects the model.
//! Generalised least squares with it gives the estimate and its covariance.

use crate::assess::noise_filter::{Correlation, WHITE, Whitened, twice_negative_logs};
pub use crate::assess::section_series::Along;
use crate::assess::section_series::{SectionTable, Sections, Series};
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, DVector};

/// The part of a scan that the estimate with correlated residuals uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Over {
    /// The whole scan.
    Scan,
    /// The stretches in which the correlation was tested, as a representative sample. They are sufficient for the factor of the covariance.
    Stretches,
}

/// The structure of the residuals.
#[derive(Clone, Debug)]
pub enum Structure {
    /// Too few for a test, or the paper's residuals, which are not separated by direction.
    Unknown,
    /// Uncorrelated.
    White,
    /// Correlated between neighbours.
    Correlated(Box<CorrelatedNoise>),
}

impl Structure {
    /// From the residuals at a solution whose covariance has the root `root`. `over` is the part of the scan for the estimate.
    #[must_use]
    pub fn of(problem: &LineProblem<'_>, at: &Parameters, root: &DMatrix<f64>, over: Over) -> Self {
        match SectionTable::of(Sections::new(problem, at, root)) {
            None => Self::Unknown,
            Some(table) => CorrelatedNoise::of(&table, (problem, at), root, over)
                .map_or(Self::White, |noise| Self::Correlated(Box::new(noise))),
        }
    }

    /// Whether they may be noise. Residuals that follow the motion are not.
    #[must_use]
    pub fn may_be_noise(&self) -> bool {
        match self {
            Self::Unknown => false,
            Self::White => true,
            Self::Correlated(noise) => noise.left < STRUCTURED,
        }
    }
}

/// Correlation of neighbours, after removal of correlated noise, above which the residuals follow the motion. A wrong frame, unit or plane changes
/// over a weave of seconds, and noise within a few frames.
const STRUCTURED: f64 = 0.3;

/// Correlated residuals, and the estimate with them.
#[derive(Clone, Debug)]
pub struct CorrelatedNoise {
    /// The variable of the correlation.
    pub along: Along,
    /// Standard deviation in each direction across the seam, m.
    pub sigma_m: [f64; 2],
    /// Correlation of neighbours there.
    pub correlation: [Correlation; 2],
    /// The estimate.
    pub at: Parameters,
    /// Its covariance.
    pub covariance: DMatrix<f64>,
    /// Remaining correlation of neighbours: structure that is not such noise.
    pub left: f64,
}

/// Correlations of neighbours that are tried. Longer ones are too smooth for noise …
const NEIGHBOURS: [f64; 6] = [0.45, 0.6, 0.7, 0.8, 0.9, 0.95];
/// … and white shares.
const WHITE_SHARES: [f64; 4] = [0.0025, 0.02, 0.15, 0.5];
/// Neighbours are tested further if their correlation exceeds this multiple of its standard deviation.
const SUSPECT_SIGMAS: f64 = 4.0;
/// Gain in twice the log likelihood that correlation needs. Four additional parameters gain 18.5 once in a thousand scans.
const GAIN: f64 = 25.0;

impl CorrelatedNoise {
    /// `None` if the residuals are white.
    fn of(
        table: &SectionTable<'_>,
        (problem, at): (&LineProblem<'_>, &Parameters),
        root: &DMatrix<f64>,
        over: Over,
    ) -> Option<Self> {
        let all_series = [Along::Time, Along::Seam].map(|along| table.along(along));
        let suspect = |series: &Series| {
            (0..2).any(|direction| {
                let residuals = table.residuals(series, direction).map(|(_, residual)| residual);
                neighbours(residuals.clone()) > SUSPECT_SIGMAS / (residuals.count() as f64).sqrt()
            })
        };
        if !all_series.iter().any(suspect) {
            return None;
        }
        let (priors, size) = (at.known(problem.shape_prior.as_ref()), at.dimension());
        let information = root.transpose() * priors.information(size) * root;
        let gradient = root.transpose() * priors.gradient(size);
        let known = Known { information, gradient };
        let white = [0, 1].map(|direction| table.whitened(&all_series[0], direction, WHITE));
        let white = Estimate::of([&white[0], &white[1]], &known)?;
        let (series, likeliest) = all_series
            .iter()
            .filter_map(|series| Some((series, most_likely(table, series, &known)?)))
            .min_by(|a, b| a.1.twice_negative_log.total_cmp(&b.1.twice_negative_log))?;
        if likeliest.twice_negative_log + GAIN > white.twice_negative_log {
            return None;
        }
        let correlation = likeliest.correlation;
        let all = match over {
            Over::Scan => table.all_whitened(series, correlation),
            Over::Stretches => table.whitened_as_if_all(series, correlation),
        };
        let estimate = Estimate::of([&all[0], &all[1]], &known)?;
        let left = (0..2)
            .map(|k| {
                neighbours(table.innovations(series, k, correlation[k], estimate.step.as_view()).into_iter())
            })
            .fold(0.0, f64::max);
        Some(Self {
            along: series.along,
            sigma_m: estimate.variance.map(f64::sqrt),
            correlation,
            at: at.retract(&(root * &estimate.step)),
            covariance: root * estimate.covariance * root.transpose(),
            left,
        })
    }
}

/// The prior, in the root's coordinates.
struct Known {
    information: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// A generalised least-squares step with the likelihood of its noise.
struct Estimate {
    step: DVector<f64>,
    covariance: DMatrix<f64>,
    variance: [f64; 2],
    twice_negative_log: f64,
}

/// Rounds of alternating levels and step.
const ROUNDS: usize = 3;

impl Estimate {
    /// `None` if the equations have no solution.
    fn of(parts: [&Whitened; 2], known: &Known) -> Option<Self> {
        let mut variance = parts.map(|part| part.square / part.count as f64);
        let mut step = DVector::zeros(known.gradient.len());
        let mut round = None;
        for _ in 0..ROUNDS {
            let mut hessian = known.information.clone();
            let mut gradient = known.gradient.clone();
            for (part, variance) in parts.iter().zip(variance) {
                hessian += &part.hessian / variance;
                gradient += &part.gradient / variance;
            }
            let factor = hessian.cholesky()?;
            step = -factor.solve(&gradient);
            let covariance = factor.inverse();
            for (part, variance) in parts.iter().zip(&mut variance) {
                let square =
                    part.square + 2.0 * part.gradient.dot(&step) + step.dot(&(&part.hessian * &step));
                let used = part.hessian.component_mul(&covariance).sum() / *variance;
                *variance = square / (part.count as f64 - used).max(1.0);
            }
            round = Some((factor.l().diagonal().map(f64::ln).sum() * 2.0, covariance));
        }
        let (log_information, covariance) = round?;
        let moved = |part: &Whitened| {
            part.square + 2.0 * part.gradient.dot(&step) + step.dot(&(&part.hessian * &step))
        };
        let of_part = |part: &&Whitened, variance: f64| {
            part.log_determinant + part.count as f64 * variance.ln() + moved(part) / variance
        };
        let data: f64 = parts.iter().zip(variance).map(|(part, variance)| of_part(part, variance)).sum();
        let prior = 2.0 * known.gradient.dot(&step) + step.dot(&(&known.information * &step));
        Some(Self { twice_negative_log: data + prior + log_information, step, covariance, variance })
    }
}

/// The most likely correlation of each direction.
struct Likeliest {
    correlation: [Correlation; 2],
    twice_negative_log: f64,
}

/// Largest deficit in twice the log likelihood of a correlation before the other unknowns are re-estimated. These were fitted for white noise. A
/// step of them gains about their number in squared sigmas, which is no more than this for the thirty unknowns of two lines.
const BEHIND: f64 = 200.0;

/// The most likely correlation of each direction, in turn. Correlations that are plainly worse for the residuals alone are skipped.
fn most_likely(table: &SectionTable<'_>, series: &Series, known: &Known) -> Option<Likeliest> {
    let grid = NEIGHBOURS.iter().flat_map(|neighbours| {
        WHITE_SHARES.map(|white_share| Correlation { neighbours: *neighbours, white_share })
    });
    let grid: Vec<Correlation> = grid.chain([WHITE]).collect();
    let candidates = [0, 1].map(|direction| {
        let residuals = table.residuals(series, direction);
        let of_residuals = twice_negative_logs(residuals, &grid);
        let best = of_residuals.iter().copied().fold(f64::INFINITY, f64::min);
        let likely = grid.iter().zip(of_residuals).filter(|(_, value)| *value < best + BEHIND);
        let likely: Vec<_> =
            likely.map(|(c, value)| (*c, table.whitened(series, direction, *c), value)).collect();
        likely
    });
    let estimate =
        |chosen: [usize; 2]| Estimate::of([&candidates[0][chosen[0]].1, &candidates[1][chosen[1]].1], known);
    // Starts with the best for the residuals. The directions share hardly anything, so two rounds are enough.
    let best = |of: &Vec<(Correlation, Whitened, f64)>| {
        (0..of.len()).min_by(|a, b| of[*a].2.total_cmp(&of[*b].2)).unwrap_or_default()
    };
    let mut chosen = [best(&candidates[0]), best(&candidates[1])];
    for direction in [0, 1, 0, 1] {
        let with = |k: usize| {
            let mut tried = chosen;
            tried[direction] = k;
            estimate(tried).map_or(f64::INFINITY, |e| e.twice_negative_log)
        };
        chosen[direction] = (0..candidates[direction].len()).min_by(|a, b| with(*a).total_cmp(&with(*b)))?;
    }
    let twice_negative_log = estimate(chosen)?.twice_negative_log;
    let correlation = [0, 1].map(|direction| candidates[direction][chosen[direction]].0);
    Some(Likeliest { correlation, twice_negative_log })
}

/// Correlation of neighbours in a series.
fn neighbours(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let power: f64 = values.iter().map(|value| value * value).sum();
    let product: f64 = values.windows(2).map(|two| two[0] * two[1]).sum();
    if power > 0.0 { product / power } else { 0.0 }
}
