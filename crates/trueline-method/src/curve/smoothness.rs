//! Smoothness of the curve: restricted maximum likelihood of the size of its third differences.
//!
//! The curve is first fitted loosely, then stiffened with the same weights. With changing weights, bends would be rejected as
//! outliers. At a loose optimum the cost is quadratic in the curve, so one set of equations gives every size: −½\[ν log(J/ν) +
//! log|H| + log|S| − q log λ\], J = rss + λ |bends|², λ = 1/s3² in units of the noise.

use crate::curve::arrow::{Arrow, ArrowRoot, SHARED};
use crate::curve::equations::{Known, add_known, add_prior};
use crate::curve::fit::Fitted;
use crate::curve::plates::Plates;
use crate::curve::sight::step_between;

/// Third differences of the loosest curve with knots of 10 mm, m: a corner of a few millimetres' radius.
const LOOSEST_M: f64 = 30e-3;
/// … and of the stiffest, m: a straight line.
const STIFFEST_M: f64 = 0.3e-6;
/// Third differences are proportional to this power of the knot spacing; those above are for this spacing, m.
const BY_SPACING: (f64, f64) = (2.5, 10e-3);
/// Factor from one size to the next.
const GRID: f64 = 3.0;
/// Consecutive failures that end the search.
const WORSE: usize = 2;

/// The loosest size for a spacing of the knots, m.
#[must_use]
pub(crate) fn loosest_m(spacing_m: f64) -> f64 {
    LOOSEST_M * (spacing_m / BY_SPACING.1).powf(BY_SPACING.0)
}

/// The equations at a state, by their parts.
#[derive(Clone, Debug)]
pub(crate) struct Parts {
    data: Arrow,
    prior: Arrow,
    known: Arrow,
    squares: f64,
    bent_m2: f64,
    off: f64,
    readings: f64,
    curve: usize,
    penalties: usize,
}

impl Parts {
    /// From a fit.
    #[must_use]
    pub(crate) fn of(fitted: &Fitted, known: &Known) -> Self {
        let state = &fitted.state;
        let [mut prior, mut of_known] = [(); 2].map(|()| state.arrow());
        add_prior(&mut prior, state);
        add_known(&mut of_known, &fitted.state.at, known);
        // The prior of the plates is as much data as the readings.
        let of_plates = |plates: &Plates| (plates.squares(), plates.priors(), plates.unknowns());
        let (turned, priors, angles) = state.plates.as_ref().map_or((0.0, 0, 0), of_plates);
        let off = step_between(&fitted.state.at, &known.centre);
        Self {
            data: fitted.equations(),
            prior,
            known: of_known,
            squares: fitted.squares() + turned,
            bent_m2: state.bends().iter().map(|bend| bend.norm_squared()).sum(),
            off: off.dot(&(known.information * off)),
            readings: fitted.rows() + priors as f64,
            curve: state.of_form() + state.of_place() + angles,
            penalties: 2 * state.bends().len(),
        }
    }

    /// With third differences of a size, m.
    #[must_use]
    pub(crate) fn with(&self, s3_m: f64) -> Arrow {
        self.data.plus(&self.prior, s3_m.powi(-2)).plus(&self.known, 1.0)
    }

    /// With the weakest prior for which the equations have a solution, of a size, m.
    #[must_use]
    pub(crate) fn of_data(&self, s3_m: f64) -> Arrow {
        self.data.plus(&self.prior, s3_m.powi(-2))
    }

    /// Restricted log likelihood of a size, m; `None` if the equations have no solution.
    #[must_use]
    pub(crate) fn evidence(&self, s3_m: f64) -> Option<f64> {
        let (equations, stiffness) = (self.with(s3_m), s3_m.powi(-2));
        let root = equations.root()?;
        let gain = equations.gradient.dot(&root.solve(&equations.gradient));
        let left = self.squares + stiffness * self.bent_m2 + self.off - gain;
        let freedom = self.freedom();
        let logs = root.log_det_curve() + root.log_det_shared() - self.penalties as f64 * stiffness.ln();
        (left > 0.0 && freedom > 0.0).then(|| -0.5 * (freedom * (left / freedom).ln() + logs))
    }

    /// ν: degrees of freedom of the noise.
    #[must_use]
    pub(crate) fn freedom(&self) -> f64 {
        self.readings - (SHARED + self.curve - self.penalties) as f64
    }

    /// Effective number of unknowns: tr(M⁻¹ JᵀWJ).
    #[must_use]
    pub(crate) fn effective(&self, root: &ArrowRoot) -> f64 {
        let inverse = root.inverse();
        let size = self.data.size();
        let pairs = (0..size).flat_map(|i| (0..size).map(move |j| (i, j)));
        pairs.map(|(i, j)| inverse[(i, j)] * self.data.entry(i, j)).sum()
    }

    /// Variance of the noise over the expected one.
    #[must_use]
    pub(crate) fn noise_variance(&self, effective: f64) -> f64 {
        self.squares / (self.readings - effective).max(1.0)
    }
}

/// The most likely size, m, with its restricted log likelihood; `None` if no equations have a solution.
#[must_use]
pub(crate) fn likeliest(parts: &Parts, spacing_m: f64) -> Option<(f64, f64)> {
    let least_m = STIFFEST_M * (spacing_m / BY_SPACING.1).powf(BY_SPACING.0);
    let (mut s3_m, mut best, mut worse) = (loosest_m(spacing_m), None, 0);
    while s3_m >= least_m && worse < WORSE {
        let evidence = parts.evidence(s3_m);
        match (evidence, best) {
            (Some(found), Some((_, before))) if found <= before => worse += 1,
            (Some(found), _) => (best, worse) = (Some((s3_m, found)), 0),
            (None, _) => worse += 1,
        }
        s3_m /= GRID;
    }
    best
}
