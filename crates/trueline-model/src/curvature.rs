//! A slightly curved seam: a bow in each of the line's two cross directions.
//!
//! p(s) = c + s u₁ + (κ₂ u₂ + κ₃ u₃) φ(s), φ(s) = ((s − s₀)/ℓ)² − 1/3, with ℓ half of the visible length and s₀ its
//! middle. So κ is the height of the bow between middle and ends at any length. It is nearly independent of the
//! line's own offsets: the mean of φ over the visible length is zero.

use nalgebra::Vector2;

/// The bow of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curvature {
    /// κ₂ and κ₃: distance of the ends from a straight line through the middle, m.
    pub bow_m: [f64; 2],
    /// ℓ, half of the visible length, m.
    pub half_length_m: f64,
    /// s₀, the middle of the visible part, along the line from its anchor, m.
    pub middle_m: f64,
}

/// The mean of ((s − s₀)/ℓ)² over the visible length.
pub const MEAN_SQUARE: f64 = 1.0 / 3.0;
/// Prior standard deviation of a seam's bow, at any length, m.
const PRIOR_M: f64 = 0.3e-3;
/// Its increase with length: 1 mm per metre.
const PRIOR_PER_M: f64 = 1e-3;

impl Curvature {
    /// Number of unknowns.
    pub const DIMENSION: usize = 2;

    /// φ at a place `along_m` from the anchor, and dφ/ds (1/m).
    #[must_use]
    pub fn form(&self, along_m: f64) -> (f64, f64) {
        let relative = (along_m - self.middle_m) / self.half_length_m;
        (relative * relative - MEAN_SQUARE, 2.0 * relative / self.half_length_m)
    }

    /// Distance of the seam from the straight line along u₂ and u₃, m.
    #[must_use]
    pub fn offset_at(&self, along_m: f64) -> Vector2<f64> {
        Vector2::from(self.bow_m) * self.form(along_m).0
    }

    /// Prior standard deviation of each bow, m.
    #[must_use]
    pub fn prior_sigma_m(&self) -> f64 {
        PRIOR_M + PRIOR_PER_M * 2.0 * self.half_length_m
    }

    /// Moves the two bows (m).
    #[must_use]
    pub fn retract(&self, step: &Vector2<f64>) -> Self {
        Self { bow_m: [self.bow_m[0] + step.x, self.bow_m[1] + step.y], ..*self }
    }
}
