//! Packets that arrive late: half-normal, and now and then much later.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use crate::noise::Noise;

/// Share of the packets that are much later.
const TAIL_SHARE: f64 = 0.005;
/// Mean of their further lateness over the half-normal's scale: 3 ms beside 0.12 ms.
const TAIL_SCALES: f64 = 25.0;

/// Lateness of one stream.
pub(crate) struct LatePackets {
    scale_s: f64,
    noise: Noise,
}

impl LatePackets {
    pub(crate) fn of(errors: &DrawnErrors, stream: u64) -> Option<Self> {
        let scale_s = errors.size(ShopError::LatePackets)?;
        Some(Self { scale_s, noise: errors.noise(ShopError::LatePackets, 1 + stream) })
    }

    /// Lateness of the next packet, s.
    pub(crate) fn next_s(&mut self) -> f64 {
        let usual_s = self.noise.normal(self.scale_s).abs();
        let is_in_tail = self.noise.happens(TAIL_SHARE);
        let further_s = -self.noise.uniform(f64::MIN_POSITIVE, 1.0).ln() * TAIL_SCALES * self.scale_s;
        usual_s + if is_in_tail { further_s } else { 0.0 }
    }
}

/// Mean lateness of a stream, s.
pub(crate) fn mean_s(errors: &DrawnErrors) -> f64 {
    let scale_s = errors.size_or_zero(ShopError::LatePackets);
    scale_s * ((2.0 / std::f64::consts::PI).sqrt() + TAIL_SHARE * TAIL_SCALES)
}
