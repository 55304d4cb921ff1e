//! What the scan says of the sensor's own calibration.

use crate::input::shape_knowledge::ShapeKnowledge;
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, SVector};
use trueline_model::SheetShape;

/// The shape of the sensor's sheet, and whether the scan shows that the sensor's own calibration is off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorShape {
    /// The shape.
    pub shape: SheetShape,
    /// Standard deviation of h₁ … h₅, everything included.
    pub sigma: [f64; 5],
    /// The same before the scan.
    pub prior_sigma: [f64; 5],
    /// Whether the sensor's file states the latter; else it is assumed.
    pub stated: bool,
    /// hᵀ C_h⁻¹ h with robot and feature bias in C_h: χ²₅ for a sensor without fault.
    pub wald: f64,
}

/// Above this a sensor's own calibration is off; once in thousands of scans by chance.
pub const WALD_LIMIT: f64 = 25.0;
/// A component that is known no better than this part of what was known before comes from there.
const FROM_PRIOR: f64 = 0.7;

impl SensorShape {
    /// From a solution and the covariance of all unknowns; `None` where the shape was held.
    #[must_use]
    pub fn of(at: &Parameters, covariance: &DMatrix<f64>, knowledge: &ShapeKnowledge) -> Option<Self> {
        let shape = at.shape?;
        let first = at.unknowns().shape().start;
        let own = covariance.fixed_view::<5, 5>(first, first).into_owned();
        let h = SVector::from(shape.h);
        let wald = h.dot(&own.cholesky()?.solve(&h));
        let sigma = std::array::from_fn(|k| own[(k, k)].max(0.0).sqrt());
        let prior_sigma = std::array::from_fn(|k| knowledge.covariance[(k, k)].sqrt());
        Some(Self { shape, sigma, prior_sigma, stated: knowledge.stated, wald })
    }

    /// Whether the scan has told more of the shape than was known before.
    #[must_use]
    pub fn improved(&self) -> bool {
        self.sigma.iter().zip(self.prior_sigma).any(|(sigma, prior)| *sigma <= FROM_PRIOR * prior)
    }

    /// Whether the sensor's own calibration is off.
    #[must_use]
    pub fn is_off(&self) -> bool {
        self.wald > WALD_LIMIT
    }
}
