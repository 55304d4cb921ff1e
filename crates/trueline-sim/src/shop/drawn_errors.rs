//! The errors of one cell: which it has, and how large they are.

use super::error_table::{ErrorRow, ShopError, TABLE};
use super::level::Level;
use crate::noise::Noise;

/// Streams of random numbers of the errors begin here; each kind has [`STREAMS_OF_EACH`].
const FIRST_STREAM: u64 = 4000;
const STREAMS_OF_EACH: u64 = 4;

/// Errors with a size independent of the shop's roughness.
const OF_EVERY_SHOP: [ShopError; 1] = [ShopError::MillisecondStamps];

/// Sizes of a cell's errors, SI; the same seed gives the same ones.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnErrors {
    seed: u64,
    sizes: [Option<f64>; TABLE.len()],
}

impl DrawnErrors {
    /// No error at all.
    #[must_use]
    pub fn none(seed: u64) -> Self {
        Self { seed, sizes: [None; TABLE.len()] }
    }

    /// The errors of a cell of a shop. A cell of a calm shop has the errors of the ordinary one of the same seed that are left, smaller.
    #[must_use]
    pub fn draw(level: Level, seed: u64) -> Self {
        let mut drawn = Self::none(seed);
        for row in &TABLE {
            let (is_there, size) = drawn.one(row, level);
            drawn.sizes[row.error as usize] = is_there.then_some(size);
        }
        drawn
    }

    /// Some kinds alone, of the same size, whether the cell happens to have them or not.
    #[must_use]
    pub fn only(level: Level, seed: u64, kinds: &[ShopError]) -> Self {
        let mut drawn = Self::none(seed);
        for kind in kinds {
            drawn.sizes[*kind as usize] = Some(drawn.one(kind.row(), level).1);
        }
        drawn
    }

    fn one(&self, row: &ErrorRow, level: Level) -> (bool, f64) {
        let mut noise = self.noise(row.error, 0);
        let [by_size, by_share] = level.factors();
        let factor = if OF_EVERY_SHOP.contains(&row.error) { 1.0 } else { by_size };
        let is_there = row.share >= 1.0 || noise.happens(row.share * by_share);
        (is_there, row.median * row.unit.1 * factor * noise_of_size(self.seed, row).exp())
    }

    /// The size of an error, SI; `None` if the cell does not have it.
    #[must_use]
    pub fn size(&self, error: ShopError) -> Option<f64> {
        self.sizes[error as usize]
    }

    /// The same, 0 if the cell does not have it.
    #[must_use]
    pub fn size_or_zero(&self, error: ShopError) -> f64 {
        self.size(error).unwrap_or(0.0)
    }

    /// The errors that the cell has, with their sizes in the table's unit.
    pub fn list(&self) -> impl Iterator<Item = (&'static ErrorRow, f64)> {
        TABLE.iter().filter_map(|row| Some((row, self.size(row.error)? / row.unit.1)))
    }

    /// Random part of an error; streams 1 to 3 of each kind are for its own use.
    pub(crate) fn noise(&self, error: ShopError, stream: u64) -> Noise {
        Noise::new(self.seed, FIRST_STREAM + STREAMS_OF_EACH * error as u64 + stream)
    }
}

/// Logarithm of the size over its median.
fn noise_of_size(seed: u64, row: &ErrorRow) -> f64 {
    Noise::new(seed, FIRST_STREAM + STREAMS_OF_EACH * (TABLE.len() + row.error as usize) as u64)
        .normal(row.spread)
}
