//! A feature that shifts with the tilt: estimated with what is known of it beforehand, where a seam point is then known
//! better than with the bias held at zero, or where it is plainly there.

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
    /// Along and across the picture's rows for each axis of tilt (the camera's x, y, z), px per 10°.
    pub px: [[f64; 2]; 3],
    /// One standard deviation of each, the robot's errors included, px per 10°.
    pub sigma_px: [[f64; 2]; 3],
    /// χ²₆ for a detector without bias.
    pub wald: f64,
    /// Whether it is more than chance, and explains nearly all of what residuals there were that are not noise.
    pub is_found: bool,
}

/// Above this there is a bias: once in three thousand scans by chance, if noise and robot are as they are taken to be.
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

    /// Its most significant number and that one's standard deviation, px per 10°.
    #[must_use]
    pub fn clearest_px(&self) -> (f64, f64) {
        let pairs = self.px.iter().flatten().copied().zip(self.sigma_px.iter().flatten().copied());
        pairs.max_by(|a, b| (a.0 / a.1).abs().total_cmp(&(b.0 / b.1).abs())).unwrap_or((0.0, 0.0))
    }
}

/// A fit of features freed of their bias.
pub(crate) struct BiasFree {
    /// The features without it.
    pub observations: Observations,
    /// The fit to them.
    pub fit: Fit,
    /// What is known from it.
    pub information: Information,
    /// What errors that are not noise make of it.
    pub sums: SystematicSums,
    /// The bias.
    pub taken: TakenBias,
}

/// A bias that was taken out.
#[derive(Clone, Copy, Debug)]
pub struct TakenBias {
    /// The bias, px per 10°.
    pub px: SVector<f64, BIAS>,
    /// How it counts tilts.
    pub tilt: TiltBias,
    /// The levels with a bias as large as it turned out to be.
    pub levels: SystematicLevels,
    /// Whether it is plainly there.
    pub is_plain: bool,
}

/// A bias and what is taken of the noise it is estimated in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BiasHypothesis {
    /// Assumed size of the errors.
    pub levels: SystematicLevels,
    /// How much larger the noise's covariance is than that of white noise.
    pub inflation: f64,
    /// Whether nothing else explains the residuals, so that a bias that is larger than was assumed possible is one.
    pub is_likely: bool,
}

/// Most rounds: features are corrected by what was found, and everything is fitted again.
const ROUNDS: usize = 4;
/// What moves by less than this part of its ± is settled.
const SETTLED: f64 = 0.05;
/// Rounds in which a bias that is larger than was assumed possible finds its size.
const LEVEL_ROUNDS: usize = 5;

/// A fit whose features may shift with the tilt.
pub(crate) struct BiasSearch<'a> {
    solver: Solver<'a>,
    fit: &'a Fit,
    /// At that fit.
    sums: SystematicSums,
}

impl<'a> BiasSearch<'a> {
    /// At the optimum of a problem of which so much is known.
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

    /// Estimates the bias and takes it out, from where it was taken out by another hypothesis if it was; `None` where it is not
    /// plainly there and a seam point is known better with the bias held.
    ///
    /// # Errors
    /// As [`Solver::converge`].
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

    /// Takes a bias out and fits again; `None` where nothing is known then.
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

/// A bias that is plainly larger than was assumed possible is taken to be as large as it seems.
fn level_found(sums: &mut SystematicSums, stated_px: f64, inflation: f64) -> f64 {
    let mut level_px = stated_px;
    for _ in 0..LEVEL_ROUNDS {
        let Some(found) = sums.bias(&SVector::zeros(), inflation) else { break };
        level_px = found.px.amax().max(stated_px);
        sums.set_bias_level(level_px);
    }
    level_px
}

/// Whether an estimated bias leaves less of a seam point's error than one that is held.
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
        // What cannot be placed takes no part in the fit.
        let Some(placement) = placement(observations, o, fit.parameters()) else { continue };
        let moved = tilt.slopes(o, fit.parameters(), &placement) * bias_px;
        o.point_in_camera -= observations.sheet.axes() * moved;
    }
    free
}
