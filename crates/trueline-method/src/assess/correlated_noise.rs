//! Residuals that are correlated: as noise in time, or as the form of the seam.
//!
//! A real weld's residuals are alike from frame to frame. Either the detector errs alike for some frames, or the seam is
//! there where it is: then the same place errs alike in every pass, and tells nothing of time or attitude. Both are an
//! Ornstein–Uhlenbeck process with white noise on top, of time or of the place on the seam, in each of the two directions
//! across it. The restricted likelihood \[Patterson1971\] chooses, and generalised least squares with what it chose moves the
//! estimate and says what it is worth.

use crate::assess::noise_filter::{Correlation, Sample, WHITE, Whitened, whiten, whitened_residuals};
use crate::assess::residuals::OUTLIER_SQUARED;
use crate::order_statistics::median;
use crate::problem::block_priors;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, DVector};

/// What the residuals are alike along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Along {
    /// Time: noise of detector or robot that lasts.
    Time,
    /// The seam: its form.
    Seam,
}

/// What the residuals are.
#[derive(Clone, Debug)]
pub enum Structure {
    /// Too few to tell, or residuals that are not taken apart: the paper's.
    Unknown,
    /// Independent from one to the next.
    White,
    /// Alike from one to the next.
    Correlated(Box<CorrelatedNoise>),
}

impl Structure {
    /// Of the residuals at a solution whose covariance's root is `root`.
    #[must_use]
    pub fn of(problem: &LineProblem<'_>, at: &Parameters, root: &DMatrix<f64>) -> Self {
        match Seen::of(problem, at, root) {
            None => Self::Unknown,
            Some(seen) => CorrelatedNoise::of(&seen, problem, at, root)
                .map_or(Self::White, |noise| Self::Correlated(Box::new(noise))),
        }
    }

    /// Whether they may be noise: what follows the motion is none.
    #[must_use]
    pub fn may_be_noise(&self) -> bool {
        match self {
            Self::Unknown => false,
            Self::White => true,
            Self::Correlated(noise) => noise.left < STRUCTURED,
        }
    }
}

/// Neighbours that are still as much alike as this once correlated noise is taken out follow the motion: a wrong frame, unit
/// or plane changes over a weave of seconds, noise within a few frames.
const STRUCTURED: f64 = 0.3;

/// Correlated residuals, and the estimate that allows for them.
#[derive(Clone, Debug)]
pub struct CorrelatedNoise {
    /// What they are alike along.
    pub along: Along,
    /// In each direction across the seam: standard deviation, m.
    pub sigma_m: [f64; 2],
    /// Correlation of neighbours there.
    pub correlation: [Correlation; 2],
    /// The estimate.
    pub at: Parameters,
    /// Its covariance.
    pub covariance: DMatrix<f64>,
    /// Correlation of neighbours that is left: structure that is no such noise.
    pub left: f64,
}

/// Correlations of neighbours that are tried: longer ones than these are not rough enough for noise …
const NEIGHBOURS: [f64; 6] = [0.45, 0.6, 0.7, 0.8, 0.9, 0.95];
/// … and white shares.
const WHITE_SHARES: [f64; 4] = [0.0025, 0.02, 0.15, 0.5];
/// Neighbours whose correlation is this many times its standard deviation are looked into.
const SUSPECT_SIGMAS: f64 = 4.0;
/// Twice the log likelihood that correlation must gain: four numbers more gain 18.5 once in a thousand scans.
const GAIN: f64 = 25.0;
/// Fewer frames tell no correlation.
const LEAST_FRAMES: usize = 100;

impl CorrelatedNoise {
    /// `None` if the residuals are white.
    fn of(seen: &Seen, problem: &LineProblem<'_>, at: &Parameters, root: &DMatrix<f64>) -> Option<Self> {
        let [in_time, on_seam] = [Along::Time, Along::Seam].map(|along| seen.ordered(along));
        let known = root.transpose() * block_priors::information(problem.shape_prior.as_ref(), at) * root;
        let gradient = root.transpose() * block_priors::gradient(problem.shape_prior.as_ref(), at);
        let prior = Known { information: known, gradient };
        let suspect = |series: &[Vec<Sample>; 2]| {
            series.iter().any(|samples| {
                neighbours(samples.iter().map(|s| s.residual))
                    > SUSPECT_SIGMAS / (samples.len() as f64).sqrt()
            })
        };
        if !suspect(&in_time) && !suspect(&on_seam) {
            return None;
        }
        let white = Estimate::of(
            [&whiten(&in_time[0], WHITE, root.ncols()), &whiten(&in_time[1], WHITE, root.ncols())],
            &prior,
        )?;
        let (along, series, best) = [(Along::Time, &in_time), (Along::Seam, &on_seam)]
            .into_iter()
            .filter_map(|(along, series)| Some((along, series, most_likely(series, &prior)?)))
            .min_by(|a, b| a.2.0.twice_negative_log.total_cmp(&b.2.0.twice_negative_log))?;
        let (estimate, correlation) = best;
        if estimate.twice_negative_log + GAIN > white.twice_negative_log {
            return None;
        }
        let left = (0..2)
            .map(|k| neighbours(whitened_residuals(&series[k], correlation[k], &estimate.step).into_iter()))
            .fold(0.0, f64::max);
        Some(Self {
            along,
            sigma_m: estimate.variance.map(f64::sqrt),
            correlation,
            at: at.retract(&(root * &estimate.step)),
            covariance: root * estimate.covariance * root.transpose(),
            left,
        })
    }
}

/// What is known beforehand, in the root's coordinates.
struct Known {
    information: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// A generalised least-squares step, and how likely its noise is.
struct Estimate {
    step: DVector<f64>,
    covariance: DMatrix<f64>,
    variance: [f64; 2],
    twice_negative_log: f64,
}

/// Rounds in which levels and step follow each other.
const ROUNDS: usize = 3;

impl Estimate {
    /// `None` where nothing can be solved.
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

/// The most likely correlation of each direction, one after the other.
fn most_likely(series: &[Vec<Sample>; 2], known: &Known) -> Option<(Estimate, [Correlation; 2])> {
    let grid: Vec<Correlation> = NEIGHBOURS
        .iter()
        .flat_map(|neighbours| {
            WHITE_SHARES.map(|white_share| Correlation { neighbours: *neighbours, white_share })
        })
        .chain([WHITE])
        .collect();
    let whitened =
        [0, 1].map(|k| grid.iter().map(|c| whiten(&series[k], *c, known.gradient.len())).collect::<Vec<_>>());
    // White to begin with; the directions hardly share anything, so two rounds settle them.
    let mut chosen = [grid.len() - 1; 2];
    let estimate =
        |chosen: [usize; 2]| Estimate::of([&whitened[0][chosen[0]], &whitened[1][chosen[1]]], known);
    for direction in [0, 1, 0, 1] {
        let with = |k: usize| {
            let mut tried = chosen;
            tried[direction] = k;
            estimate(tried).map_or(f64::INFINITY, |e| e.twice_negative_log)
        };
        chosen[direction] = (0..grid.len()).min_by(|a, b| with(*a).total_cmp(&with(*b)))?;
    }
    Some((estimate(chosen)?, chosen.map(|k| grid[k])))
}

/// Correlation of neighbours in a series.
fn neighbours(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let power: f64 = values.iter().map(|value| value * value).sum();
    let product: f64 = values.windows(2).map(|two| two[0] * two[1]).sum();
    if power > 0.0 { product / power } else { 0.0 }
}

/// One observation in the seam's cross-section.
struct InSection {
    line: u32,
    time_s: f64,
    along_m: f64,
    residual: [f64; 2],
    slopes: [DVector<f64>; 2],
}

/// All that carry weight, by rising time.
struct Seen(Vec<InSection>);

impl Seen {
    /// `None` for the paper's residual, and for too few.
    fn of(problem: &LineProblem<'_>, at: &Parameters, root: &DMatrix<f64>) -> Option<Self> {
        let mut hint = 0;
        let mut list = Vec::new();
        for (o, whitener) in problem.selected() {
            let Some(placement) = problem.placement(o, at, &mut hint) else { continue };
            let Some(section) = problem.in_cross_section(o, at, &placement) else { continue };
            if whitener.apply(&section.in_sheet).norm_squared() > OUTLIER_SQUARED {
                continue;
            }
            let line = o.line as usize;
            let slopes = [0, 1].map(|k| {
                let mut slope = DVector::zeros(root.ncols());
                for local in 0..problem.unknowns.local() {
                    let row = root.row(problem.unknowns.place(local, line)).transpose();
                    slope.axpy(section.jacobian[(k, local)], &row, 1.0);
                }
                slope
            });
            let from_anchor = placement.point_in_base(&o.point_in_camera) - at.lines[line].anchor();
            list.push(InSection {
                line: o.line,
                time_s: o.stamp_s,
                along_m: at.lines[line].direction().dot(&from_anchor),
                residual: section.residual.into(),
                slopes,
            });
        }
        (list.len() >= LEAST_FRAMES).then_some(Self(list))
    }

    /// The two directions as series along time or seam, in steps of the median distance of successive frames.
    fn ordered(&self, along: Along) -> [Vec<Sample>; 2] {
        let place = |seen: &InSection| match along {
            Along::Time => seen.time_s,
            Along::Seam => seen.along_m,
        };
        let mut order: Vec<&InSection> = self.0.iter().collect();
        order.sort_by(|a, b| a.line.cmp(&b.line).then(a.time_s.total_cmp(&b.time_s)));
        let distances = order.windows(2).filter(|two| two[0].line == two[1].line);
        let step = median(distances.map(|two| (place(two[1]) - place(two[0])).abs())).unwrap_or(1.0);
        order.sort_by(|a, b| a.line.cmp(&b.line).then(place(a).total_cmp(&place(b))));
        [0, 1].map(|k| {
            let sample = |seen: &&InSection| Sample {
                at: place(seen) / step.max(f64::MIN_POSITIVE),
                group: seen.line,
                residual: seen.residual[k],
                slope: seen.slopes[k].clone(),
            };
            order.iter().map(sample).collect()
        })
    }
}
