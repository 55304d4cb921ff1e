//! Expected size of a residual: the covariance that whitens it.
//!
//! Σ = Σ_feature + σ_r² B Bᵀ + σ_t² ṙ ṙᵀ: the feature's own noise, the robot's position noise mapped to the sheet by B, and the stamp's jitter times
//! the velocity ṙ = ∂r/∂t_d of the point across the sheet.

use nalgebra::{Matrix2, Matrix2x3, Vector2};

/// Standard deviations shared by all observations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseLevels {
    /// Robot position, per axis, m.
    pub robot_sigma_m: f64,
    /// Stamp jitter, s.
    pub stamp_sigma_s: f64,
    /// Factor on all of them: ratio of the residuals to the expected ones.
    pub factor: f64,
}

/// A lower-triangular W with W Σ Wᵀ = I, row by row: \[w₁₁, w₂₁, w₂₂\].
///
/// Single precision is sufficient: a weight error of 1e-7 moves an optimum by less than 1e-7 of its sigma. The whitener is all that a solve stores
/// for each observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Whitener(pub [f32; 3]);

impl Whitener {
    /// The whitener of a covariance. `None` if it is not positive definite.
    #[must_use]
    pub fn of(covariance: &Matrix2<f64>) -> Option<Self> {
        let (a, b, c) = (covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]);
        let l11 = a.sqrt();
        let l21 = b / l11;
        let l22 = (c - l21 * l21).sqrt();
        let whitener = Self([1.0 / l11, -l21 / (l11 * l22), 1.0 / l22].map(|w| w as f32));
        whitener.0.iter().all(|w| w.is_finite()).then_some(whitener)
    }

    /// The same for an isotropic standard deviation.
    #[must_use]
    pub(crate) fn isotropic(sigma: f64) -> Self {
        Self([1.0 / sigma, 0.0, 1.0 / sigma].map(|w| w as f32))
    }

    /// W.
    #[must_use]
    #[inline]
    pub fn matrix(&self) -> Matrix2<f64> {
        let [w11, w21, w22] = self.0.map(f64::from);
        Matrix2::new(w11, 0.0, w21, w22)
    }

    /// W r.
    #[must_use]
    #[inline]
    pub fn apply(&self, r: &Vector2<f64>) -> Vector2<f64> {
        let [w11, w21, w22] = self.0.map(f64::from);
        Vector2::new(w11 * r.x, w21 * r.x + w22 * r.y)
    }
}

/// A symmetric 2×2 matrix from \[xx, xy, yy\].
#[must_use]
pub fn symmetric(c: [f64; 3]) -> Matrix2<f64> {
    Matrix2::new(c[0], c[1], c[1], c[2])
}

impl NoiseLevels {
    /// Σ of one observation in the sheet, m².
    #[must_use]
    pub fn covariance(
        &self,
        feature: [f64; 3],
        onto_sheet: &Matrix2x3<f64>,
        d_time_offset: &Vector2<f64>,
    ) -> Matrix2<f64> {
        let expected = symmetric(feature)
            + onto_sheet * onto_sheet.transpose() * self.robot_sigma_m.powi(2)
            + d_time_offset * d_time_offset.transpose() * self.stamp_sigma_s.powi(2);
        expected * self.factor.powi(2)
    }

    /// The whitener for the noise of feature and robot alone, with the sheet perpendicular to the line.
    #[must_use]
    pub(crate) fn coarse_whitener(&self, feature: [f64; 3]) -> Whitener {
        let robot = self.robot_sigma_m.powi(2);
        let expected = symmetric([feature[0] + robot, feature[1], feature[2] + robot]);
        Whitener::of(&(expected * self.factor.powi(2)))
            .unwrap_or_else(|| Whitener::isotropic(self.factor * self.robot_sigma_m.max(1e-9)))
    }
}
