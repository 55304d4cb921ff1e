//! Profile likelihood, where the curvature at the optimum underestimates the uncertainty.
//!
//! If a scan determines a rotation of the sensor only to half a degree or worse, the valley bends within the uncertainty. The least certain rotation
//! is moved by two standard deviations to either side, and everything else is refitted. A quadratic cost grows by 4. A side with less growth extends
//! proportionally further \[Pawitan2001, ch. 3\].

use crate::problem::parameters::ROTATION;
use crate::problem::prior::Prior;
use crate::solve::fit::Fit;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use nalgebra::{DMatrix, DVector, Matrix3};
use trueline_lsq::LeastSquares;

/// Rotations known better than this have a quadratic cost, rad: 0.5°.
const CURVED_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;
/// Range of the profile to either side, in standard deviations.
const SIGMAS: f64 = 2.0;
/// A smaller widening is within the accuracy of two fits.
const LEAST: f64 = 1.1;
/// Largest factor on an uncertainty. If the cost hardly grows, the rotation is undetermined and the scan is refused.
pub(crate) const MOST: f64 = 20.0;

/// An uncertainty that is larger than that from the curvature.
#[derive(Clone, Debug)]
pub(crate) struct Widening {
    /// One standard deviation from the curvature, as a step of all unknowns.
    pub sigma: DVector<f64>,
    /// The factor.
    pub by: f64,
}

impl Widening {
    /// Its addition to the covariance.
    #[must_use]
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        &self.sigma * self.sigma.transpose() * (self.by.powi(2) - 1.0)
    }
}

/// Finds it for a fit and its noise covariance. `None` if the cost is quadratic.
#[must_use]
pub(crate) fn widening(solver: &Solver<'_>, fit: &Fit, covariance: &DMatrix<f64>) -> Option<Widening> {
    if !solver.settings.fixed.is_empty() || fit.prior.is_some() {
        return None;
    }
    let turns: Matrix3<f64> = covariance.fixed_view::<3, 3>(ROTATION, ROTATION).into();
    let eigen = turns.symmetric_eigen();
    let worst = eigen.eigenvalues.imax();
    let sigma_rad = eigen.eigenvalues[worst].max(0.0).sqrt();
    if sigma_rad <= CURVED_RAD {
        return None;
    }
    let about = eigen.eigenvectors.column(worst).into_owned();
    // The others follow the rotation according to the covariance.
    let sigma = covariance.columns(ROTATION, 3) * about / sigma_rad;
    let by = [1.0, -1.0].into_iter().map(|side| {
        let grown = growth(solver, fit, &(&sigma * (side * SIGMAS)), &about.into());
        grown.map_or(MOST, |grown| SIGMAS / grown.max(SIGMAS.powi(2) / MOST.powi(2)).sqrt())
    });
    let by = by.fold(1.0, f64::max);
    (by > LEAST).then_some(Widening { sigma, by })
}

/// Growth of twice the cost when the rotation about a tool axis is moved by a step and held. `None` if nothing fits.
fn growth(solver: &Solver<'_>, fit: &Fit, step: &DVector<f64>, about: &[f64; 3]) -> Option<f64> {
    let at = fit.parameters();
    let away = at.retract(step);
    let mut prior = Prior::at(&away.guess());
    prior.hold_rotation(about);
    let held = Solver { settings: FitSettings { prior: Some(&prior), ..solver.settings }, ..*solver };
    let moved = held.converge_from(fit, away).ok()?;
    // Both with the same weights.
    let problem = fit.problem(solver.observations, solver.settings.config);
    Some(2.0 * (problem.cost(moved.parameters()) - problem.cost(at)))
}
