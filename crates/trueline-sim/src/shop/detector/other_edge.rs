//! Stretches in which the detector follows the other edge of the joint.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use super::stretches;

/// Duration of one, s.
const LASTS_S: [f64; 2] = [0.3, 1.2];
/// How far the other edge is aside, m.
const ASIDE_M: [f64; 2] = [0.002, 0.006];

/// The runs of a scan.
pub(super) struct OtherEdge {
    stretches_s: Vec<[f64; 2]>,
    aside_m: f64,
}

impl OtherEdge {
    pub(super) fn of(errors: &DrawnErrors, duration_s: f64) -> Self {
        let Some(share) = errors.size(ShopError::OtherEdge) else {
            return Self { stretches_s: Vec::new(), aside_m: 0.0 };
        };
        let mut noise = errors.noise(ShopError::OtherEdge, 1);
        let side = if noise.happens(0.5) { 1.0 } else { -1.0 };
        let aside_m = side * noise.uniform(ASIDE_M[0], ASIDE_M[1]);
        Self { stretches_s: stretches::drawn(&mut noise, share.min(0.5), duration_s, LASTS_S), aside_m }
    }

    /// How far aside the line is that is seen at a time, m; 0 is the seam.
    pub(super) fn aside_m(&self, time_s: f64) -> f64 {
        stretches::at(&self.stretches_s, time_s).map_or(0.0, |_| self.aside_m)
    }
}
