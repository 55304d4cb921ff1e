//! A feature bias that grows with the tilt. It is estimated with its prior if that makes a seam point more accurate than a bias held at zero, or if
//! the bias is clearly significant.

use crate::assess::levels::SystematicLevels;
use crate::assess::observability::RANK_THRESHOLD;
use crate::assess::seam_error::{self, SeamErrorSources};
use crate::assess::systematic::{BiasEstimate, Systematic, SystematicSums};
use crate::assess::tilt_bias::{BIAS, TiltBias};
use crate::error::Error;
use crate::input::observations::Observations;
use crate::problem::placement::placement;
use crate::solve::fit::Fit;
use crate::solve::solver::Solver;
use nalgebra::SVector;
use trueline_lsq::Information;

/// The bias of a detector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeatureBias {
    /// Along and across the image's rows for each axis of tilt (the camera's x, y, z), px per 10°.
    pub px: [[f64; 2]; 3],
    /// Standard deviation of each, including the robot's errors, px per 10°.
    pub sigma_px: [[f64; 2]; 3],
    /// χ²₆ for a detector without bias.
    pub wald: f64,
    /// Whether it is significant and explains nearly all of the residuals that are not noise.
    pub is_found: bool,
}

/// Limit above which there is a bias: once in three thousand scans by chance, if the assumed noise and robot errors hold.
const WALD_LIMIT: f64 = 25.0;

impl FeatureBias {
    /// From an estimate.
    #[must_use]
    pub fn new(estimate: &BiasEstimate, is_found: bool) -> Self {
        let by_axis =
            |value: &dyn Fn(usize) -> f64| std::array::from_fn(|axis| [value(2 * axis), value(2 * axis + 1)]);
        let sigma = |k: usize| estimate.covariance[(k, k)].max(0.0).sqrt();
        Self { px: by_axis(&|k| estimate.px[k]), sigma_px: by_axis(&sigma), wald: estimate.wald, is_found }
    }

    /// Its most significant number with its standard deviation, px per 10°.
    #[must_use]
    pub fn clearest_px(&self) -> (f64, f64) {
        let pairs = self.px.iter().flatten().copied().zip(self.sigma_px.iter().flatten().copied());
        pairs.max_by(|a, b| (a.0 / a.1).abs().total_cmp(&(b.0 / b.1).abs())).unwrap_or((0.0, 0.0))
    }
}

/// A fit of features with their bias removed.
pub(crate) struct BiasFree {
    /// The features without it.
    pub observations: Observations,
    /// The fit to them.
    pub fit: Fit,
    /// The information from it.
    pub information: Information,
    /// Effects of systematic errors on it.
    pub sums: SystematicSums,
    /// The bias.
    pub taken: TakenBias,
}

/// A bias that was removed.
#[derive(Clone, Copy, Debug)]
pub struct TakenBias {
    /// The bias, px per 10°.
    pub px: SVector<f64, BIAS>,
    /// Its tilt convention.
    pub tilt: TiltBias,
    /// The error levels with the estimated size of the bias.
    pub levels: SystematicLevels,
    /// Whether it is clearly significant.
    pub is_plain: bool,
}

/// A bias hypothesis, with its assumed noise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BiasHypothesis {
    /// Assumed levels of the errors.
    pub levels: SystematicLevels,
    /// Ratio of the noise's covariance to that of white noise.
    pub inflation: f64,
    /// Whether nothing else explains the residuals. Only then is a bias above the assumed level accepted.
    pub is_likely: bool,
}

/// Maximum rounds of correcting the features and refitting.
const ROUNDS: usize = 4;
/// A bias that moves by less than this fraction of its uncertainty has converged.
const SETTLED: f64 = 0.05;
/// Rounds for the size of a bias above the assumed level.
const LEVEL_ROUNDS: usize = 5;

/// Search for a bias with the tilt, from a fit.
pub(crate) struct BiasSearch<'a> {
    solver: Solver<'a>,
    fit: &'a Fit,
    /// Sums at that fit.
    sums: SystematicSums,
}

impl<'a> BiasSearch<'a> {
    /// At the optimum of a problem with its information.
    pub(crate) fn new(
        solver: Solver<'a>,
        fit: &'a Fit,
        information: &Information,
        levels: &SystematicLevels,
    ) -> Self {
        let problem = fit.problem(solver.observations, solver.settings.config);
        let sums = SystematicSums::of(&problem, fit.parameters(), information.covariance_root(), levels);
        Self { solver, fit, sums }
    }

    /// Estimates and removes the bias, starting from another hypothesis's result if there is one. `None` if the bias is not clearly significant and
    /// a seam point is more accurate with the bias held.
    ///
    /// # Errors
    /// Those of [`Solver::converge`].
    pub(crate) fn remove(
        &self,
        hypothesis: &BiasHypothesis,
        before: Option<&BiasFree>,
    ) -> Result<Option<BiasFree>, Error> {
        let BiasHypothesis { mut levels, inflation, is_likely } = *hypothesis;
        let mut sums = self.sums.clone();
        let Some(first) = sums.bias(&SVector::zeros(), inflation) else { return Ok(None) };
        let is_plain = is_likely && first.wald > WALD_LIMIT;
        if is_plain {
            levels.feature_bias_px = level_found(&mut sums, levels.feature_bias_px, inflation);
        } else if !says_less(&self.solver, self.fit, &sums, hypothesis) {
            return Ok(None);
        }
        let (mut last, mut bias_px) = (self.fit, SVector::zeros());
        if let Some(before) = before {
            (last, bias_px) = (&before.fit, before.taken.px);
            sums.clone_from(&before.sums);
            sums.set_bias_level(levels.feature_bias_px);
        }
        let mut free: Option<BiasFree> = None;
        for _ in 0..ROUNDS {
            let Some(found) = sums.bias(&bias_px, inflation) else { return Ok(None) };
            let moved = found.px - bias_px;
            bias_px = found.px;
            let taken = TakenBias { px: bias_px, tilt: sums.tilt, levels, is_plain };
            let Some(round) = self.round(last, taken)? else { return Ok(None) };
            sums.clone_from(&round.sums);
            last = &free.insert(round).fit;
            if (0..BIAS).all(|k| moved[k].abs() < SETTLED * found.covariance[(k, k)].sqrt()) {
                break;
            }
        }
        Ok(free)
    }

    /// Removes a bias and refits. `None` if the result has no information.
    fn round(&self, last: &Fit, taken: TakenBias) -> Result<Option<BiasFree>, Error> {
        let Solver { observations, settings } = self.solver;
        let observations = corrected(observations, last, &taken.tilt, &taken.px);
        let fit = self.solver.on(&observations).converge(last)?;
        let Some(information) = fit.information(settings.fixed, RANK_THRESHOLD) else { return Ok(None) };
        let problem = fit.problem(&observations, settings.config);
        let root = information.covariance_root();
        let sums = SystematicSums::beside(&self.sums, &problem, fit.parameters(), root, &taken.levels);
        Ok(Some(BiasFree { observations, fit, information, sums, taken }))
    }
}

/// The level of a bias that is clearly larger than assumed: its estimated size.
fn level_found(sums: &mut SystematicSums, stated_px: f64, inflation: f64) -> f64 {
    let mut level_px = stated_px;
    for _ in 0..LEVEL_ROUNDS {
        let Some(found) = sums.bias(&SVector::zeros(), inflation) else { break };
        level_px = found.px.amax().max(stated_px);
        sums.set_bias_level(level_px);
    }
    level_px
}

/// Whether an estimated bias gives a smaller seam point error than one that is held.
fn says_less(solver: &Solver<'_>, fit: &Fit, sums: &SystematicSums, hypothesis: &BiasHypothesis) -> bool {
    let Some(information) = fit.information(solver.settings.fixed, RANK_THRESHOLD) else { return false };
    let noise = information.covariance() * hypothesis.inflation;
    let error_m = |systematic: &Systematic| {
        let sources = SeamErrorSources {
            hessian: &fit.solution.equations.hessian,
            fixed: solver.settings.fixed,
            noise: &noise,
            stamps_variance_s2: 0.0,
            systematic,
            levels: hypothesis.levels,
            speed_m_s: 0.0,
        };
        let list = fit.placed.of(solver.observations);
        Some(seam_error::predict(solver.observations, list, fit.parameters(), &sources)?.rms_m)
    };
    let estimated =
        sums.with_bias_estimated(hypothesis.inflation).and_then(|systematic| error_m(&systematic));
    let held = error_m(&sums.with_bias_held());
    estimated.zip(held).is_some_and(|(estimated, held)| estimated < held)
}

/// The features without a bias.
fn corrected(
    observations: &Observations,
    fit: &Fit,
    tilt: &TiltBias,
    bias_px: &SVector<f64, BIAS>,
) -> Observations {
    let mut free = observations.clone();
    for o in &mut free.list {
        // An observation that cannot be placed is not used in the fit.
        let Some(placement) = placement(observations, o, fit.parameters()) else { continue };
        let moved = tilt.slopes(o, fit.parameters(), &placement) * bias_px;
        o.point_in_camera -= observations.sheet.axes() * moved;
    }
    free
}
