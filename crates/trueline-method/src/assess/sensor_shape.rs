//! Estimates the sensor's own calibration from the scan.

use crate::assess::corrected_sensor::total;
use crate::assess::misfit_cause::MisfitCause;
use crate::input::shape_knowledge::{ShapeKnowledge, least_covariance};
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, SMatrix, SVector};
use trueline_dataset::Recording;
use trueline_model::SheetShape;

/// The shape of the sensor's sheet, and whether it shows an error of the sensor's own calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorShape {
    /// The estimated correction beyond that of the sensor's file.
    pub found: SheetShape,
    /// Total correction.
    pub shape: SheetShape,
    /// Standard deviation of h₁ … h₅ from all errors.
    pub sigma: [f64; 5],
    /// Their prior standard deviation.
    pub prior_sigma: [f64; 5],
    /// Whether the sensor's file states the prior. Else it is assumed.
    pub stated: bool,
    /// hᵀ C_h⁻¹ h with robot and feature bias in C_h: χ²₅ for a correct sensor.
    pub wald: f64,
    /// The same with the file's uncertainty in C_h as well: the error beyond the stated one. `None` if the file states none.
    pub wald_beyond_stated: Option<f64>,
    /// The same with the cause of the residuals estimated beside it. `None` without such a cause.
    pub wald_beside_cause: Option<f64>,
}

/// Limit above which the sensor's own calibration is off. Chance exceeds it once in thousands of scans.
pub const WALD_LIMIT: f64 = 25.0;
/// Distances from the middle of the field at which a shape is described, m.
const REACH_M: f64 = 0.030;
/// A component whose uncertainty exceeds this fraction of its prior comes from the prior.
const FROM_PRIOR: f64 = 0.7;

impl SensorShape {
    /// From a solution and the covariance of all unknowns. `None` if the shape was held.
    #[must_use]
    pub fn of(
        recording: &Recording,
        at: &Parameters,
        covariance: &DMatrix<f64>,
        knowledge: &ShapeKnowledge,
    ) -> Option<Self> {
        let found = at.shape?;
        let first = at.unknowns().shape().start;
        let own = covariance.fixed_view::<5, 5>(first, first).into_owned();
        let wald = wald(&SVector::from(found.h), &own)?;
        let sigma = std::array::from_fn(|k| own[(k, k)].max(0.0).sqrt());
        let prior_sigma = std::array::from_fn(|k| knowledge.covariance[(k, k)].sqrt());
        let shape = total(recording, &found);
        let stated = knowledge.stated;
        let beyond = || self::wald(&SVector::from(found.h), &(own + knowledge.covariance));
        let wald_beyond_stated = stated.then(beyond).flatten();
        let wald_beside_cause = None;
        Some(Self { found, shape, sigma, prior_sigma, stated, wald, wald_beyond_stated, wald_beside_cause })
    }

    /// The same shape, tested against the file's uncertainty. `None` if the file states none.
    #[must_use]
    pub(crate) fn beyond_stated(self) -> Option<Self> {
        Some(Self { wald: self.wald_beyond_stated?, ..self })
    }

    /// The same with a cause that explains the residuals. Its effect on the shape is no error of the sensor.
    #[must_use]
    pub fn beside(self, cause: Option<&MisfitCause>, at: &Parameters, covariance: &DMatrix<f64>) -> Self {
        let first = at.unknowns().shape().start;
        let wald_beside_cause = cause.and_then(|cause| {
            let h = SVector::from(self.found.h) + cause.step.fixed_rows::<5>(first);
            let of_both = covariance + &cause.added_covariance;
            wald(&h, &of_both.fixed_view::<5, 5>(first, first).into_owned())
        });
        Self { wald_beside_cause, ..self }
    }

    /// Whether the scan has improved the prior of the shape.
    #[must_use]
    pub fn improved(&self) -> bool {
        (0..5).any(|k| !self.is_from_prior(k))
    }

    /// Whether the sensor's own calibration is off.
    #[must_use]
    pub fn is_off(&self) -> bool {
        self.wald > WALD_LIMIT && self.wald_beside_cause.is_none_or(|wald| wald > WALD_LIMIT)
    }

    /// Whether a component comes from the prior.
    #[must_use]
    pub fn is_from_prior(&self, component: usize) -> bool {
        self.sigma[component] > FROM_PRIOR * self.prior_sigma[component]
    }

    /// Largest component relative to its uncertainty.
    #[must_use]
    pub fn clearest(&self) -> f64 {
        (0..5).map(|k| self.significance(k)).fold(0.0, f64::max)
    }

    fn significance(&self, component: usize) -> f64 {
        (self.found.h[component] / self.sigma[component]).abs()
    }

    /// The result in words: components above twice their uncertainty, or else the most significant observable one.
    #[must_use]
    pub fn words(&self) -> Vec<String> {
        let significance = |k: &usize| self.significance(*k);
        let clear: Vec<usize> = (0..5).filter(|k| significance(k) > 2.0).collect();
        let seen = (0..5).filter(|k| !self.is_from_prior(*k));
        let most = seen.max_by(|a, b| significance(a).total_cmp(&significance(b)));
        let named = if clear.is_empty() { most.into_iter().collect() } else { clear };
        named.into_iter().map(|k| self.word(k)).collect()
    }

    fn word(&self, k: usize) -> String {
        let (h, sigma) = (self.found.h[k], self.sigma[k]);
        let reach = if k < 3 { 1.0 } else { REACH_M };
        let percent = format!("{:.2} ± {:.2} %", 100.0 * (h * reach).abs(), 100.0 * sigma * reach);
        let longer = if h > 0.0 { "short" } else { "long" };
        let off_mm = (h * reach * REACH_M).abs() * 1e3;
        let reach_mm = REACH_M * 1e3;
        match k {
            0 | 1 => format!(
                "{} are {percent} too {longer} ({off_mm:.2} mm at {reach_mm:.0} mm from the middle)",
                ["widths", "depths"][k]
            ),
            2 => format!(
                "width shifts with depth by {percent} ({off_mm:.2} mm at {reach_mm:.0} mm from the middle)"
            ),
            _ => format!(
                "the scale changes by {percent} over {reach_mm:.0} mm {} ({off_mm:.2} mm there)",
                ["along the stripe", "of depth"][k - 3]
            ),
        }
    }
}

/// hᵀ C⁻¹ h. Values below the resolution of a sensor's file count as unknown: exact scans give a shape of 1e-15, which is rounding.
fn wald(h: &SVector<f64, 5>, covariance: &SMatrix<f64, 5, 5>) -> Option<f64> {
    Some(h.dot(&(covariance + least_covariance()).cholesky()?.solve(h)))
}
