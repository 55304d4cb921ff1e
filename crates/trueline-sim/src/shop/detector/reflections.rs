//! Reflections, which the detector mistakes for the seam over several images.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use super::stretches;
use std::f64::consts::TAU;

/// Duration of one, s.
const LASTS_S: [f64; 2] = [0.1, 0.7];
/// How far it is from the seam, as a part of half the field of view.
const AWAY: [f64; 2] = [0.08, 0.5];

/// The reflections of a scan.
pub(super) struct Reflections {
    stretches_s: Vec<[f64; 2]>,
    /// Displacement in the two coordinates, as parts of half the field.
    away: Vec<[f64; 2]>,
}

impl Reflections {
    pub(super) fn of(errors: &DrawnErrors, duration_s: f64) -> Self {
        let Some(share) = errors.size(ShopError::Reflections) else {
            return Self { stretches_s: Vec::new(), away: Vec::new() };
        };
        let mut noise = errors.noise(ShopError::Reflections, 1);
        let stretches_s = stretches::drawn(&mut noise, share.min(0.5), duration_s, LASTS_S);
        let mut away = || {
            let (distance, direction) = (noise.uniform(AWAY[0], AWAY[1]), noise.uniform(0.0, TAU));
            [distance * direction.cos(), distance * direction.sin()]
        };
        let away = stretches_s.iter().map(|_| away()).collect();
        Self { stretches_s, away }
    }

    /// Displacement of the feature at a time, as parts of half the field; `None` without a reflection.
    pub(super) fn at(&self, time_s: f64) -> Option<[f64; 2]> {
        stretches::at(&self.stretches_s, time_s).map(|number| self.away[number])
    }
}
