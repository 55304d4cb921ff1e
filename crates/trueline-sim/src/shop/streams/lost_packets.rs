//! Packets that are lost.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use crate::noise::Noise;

/// The losses of one stream.
pub(crate) struct LostPackets {
    share: f64,
    noise: Noise,
}

impl LostPackets {
    pub(crate) fn of(errors: &DrawnErrors, stream: u64) -> Self {
        let share = errors.size_or_zero(ShopError::LostPackets);
        Self { share, noise: errors.noise(ShopError::LostPackets, 1 + stream) }
    }

    /// Whether the next packet is lost.
    pub(crate) fn next_is_lost(&mut self) -> bool {
        self.noise.happens(self.share)
    }
}
