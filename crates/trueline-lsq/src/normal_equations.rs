//! The sums a Gauss–Newton step needs.

use nalgebra::{DMatrix, DVector};

/// H = Σ JᵀWJ, g = Σ JᵀWr and the cost ½ Σ ρ at one state.
///
/// Memory is needed for the unknowns only: n² + n numbers for any number of residuals.
#[derive(Clone, Debug)]
pub struct NormalEquations {
    /// Gauss–Newton Hessian H, n×n, symmetric (both halves are filled).
    pub hessian: DMatrix<f64>,
    /// Gradient g of the cost.
    pub gradient: DVector<f64>,
    /// Cost ½ Σ ρ(|r|²).
    pub cost: f64,
}

impl NormalEquations {
    /// Zeroed equations for `dimension` unknowns.
    #[must_use]
    pub fn zeros(dimension: usize) -> Self {
        Self { hessian: DMatrix::zeros(dimension, dimension), gradient: DVector::zeros(dimension), cost: 0.0 }
    }

    /// Sets everything to zero and keeps the memory.
    pub fn clear(&mut self) {
        self.hessian.fill(0.0);
        self.gradient.fill(0.0);
        self.cost = 0.0;
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.cost.is_finite()
            && self.gradient.iter().all(|x| x.is_finite())
            && self.hessian.iter().all(|x| x.is_finite())
    }
}
