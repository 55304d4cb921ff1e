//! A PC that stalls: nothing is stamped meanwhile, and then all that has queued up at once.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;

/// Time between two stalls, s, and by how much that varies.
const EVERY_S: [f64; 2] = [8.0, 1.0];

/// The stalls of a PC; both streams have the same.
pub(crate) struct Stalls {
    spans_s: Vec<[f64; 2]>,
}

impl Stalls {
    /// The stalls between two times since the start of the scan, s.
    pub(crate) fn of(errors: &DrawnErrors, [start_s, end_s]: [f64; 2]) -> Self {
        let mut spans_s = Vec::new();
        if let Some(length_s) = errors.size(ShopError::Stalls) {
            let mut noise = errors.noise(ShopError::Stalls, 1);
            let mut begin_s = start_s + noise.uniform(0.0, EVERY_S[0]);
            while begin_s < end_s {
                spans_s.push([begin_s, begin_s + length_s * noise.uniform(0.6, 1.4)]);
                begin_s += EVERY_S[0] + noise.normal(EVERY_S[1]).clamp(-0.5 * EVERY_S[0], EVERY_S[0]);
            }
        }
        Self { spans_s }
    }

    /// When a packet that arrives at a time is stamped, s.
    pub(crate) fn after(&self, time_s: f64) -> f64 {
        let span = self.spans_s.iter().find(|[begin, end]| (*begin..*end).contains(&time_s));
        span.map_or(time_s, |[_, end]| *end)
    }
}
