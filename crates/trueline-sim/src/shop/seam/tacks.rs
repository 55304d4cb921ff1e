//! Tack welds: short bumps on the seam.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use std::f64::consts::PI;

/// Distance from one tack to the next, m.
const SPACING_M: [f64; 2] = [0.080, 0.220];
/// Half of a tack's length, m.
const HALF_LENGTH_M: [f64; 2] = [0.004, 0.008];
/// Displacement across over that in height, standard deviation.
const ACROSS: f64 = 0.3;
/// Heights of a seam's tacks are alike but for this, as a part.
const BETWEEN_TACKS: f64 = 0.3;

/// One tack.
struct Tack {
    at_m: f64,
    half_length_m: f64,
    /// Across and in height, m.
    size_m: [f64; 2],
}

/// The tacks of a seam.
pub(crate) struct Tacks {
    list: Vec<Tack>,
}

impl Tacks {
    pub(crate) fn of(errors: &DrawnErrors, length_m: f64) -> Option<Self> {
        let height_m = errors.size(ShopError::Tacks)?;
        let mut noise = errors.noise(ShopError::Tacks, 1);
        let mut spacing = || noise.uniform(SPACING_M[0], SPACING_M[1]);
        let mut places = Vec::new();
        let mut at_m = -0.5 * length_m + spacing() - SPACING_M[0];
        while at_m < 0.5 * length_m + SPACING_M[0] {
            places.push(at_m);
            at_m += spacing();
        }
        let tack = |at_m: f64| {
            let height_m = height_m * noise.normal(BETWEEN_TACKS).exp();
            Tack {
                at_m,
                half_length_m: noise.uniform(HALF_LENGTH_M[0], HALF_LENGTH_M[1]),
                size_m: [noise.normal(ACROSS) * height_m, height_m],
            }
        };
        Some(Self { list: places.into_iter().map(tack).collect() })
    }

    /// Displacement across and in height at a place along the seam, m.
    pub(crate) fn at(&self, along_m: f64) -> [f64; 2] {
        let mut at = [0.0; 2];
        for tack in &self.list {
            let place = (along_m - tack.at_m) / tack.half_length_m;
            if place.abs() < 1.0 {
                let height = (0.5 * PI * place).cos().powi(2);
                at = [0, 1].map(|axis| at[axis] + tack.size_m[axis] * height);
            }
        }
        at
    }
}
