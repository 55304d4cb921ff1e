//! The one look at every part of the picture: the brightest level and the mean of each tile.
//!
//! Every second row is read for the peak and every fourth for the mean. A stripe less than two rows thick
//! is no stripe that could be measured, and half of the picture is never fetched from memory.

use crate::fastest::{FastLoop, run_fastest};
use crate::picture::{Level, Picture};

/// More tiles than this are no stripe; the ones that stand out most are kept.
pub const MOST_CANDIDATES: usize = 1500;

/// Tiles from which the median level is taken.
const SAMPLED: usize = 1000;

/// Side of a tile, px.
pub const TILE: usize = 16;
/// Tiles beside each other that are read together: of fewer the sums within a tile take longer than the reading.
const GROUP: usize = 16;
const PEAK_ROWS: usize = 2;
const MEAN_ROWS: usize = 4;

/// Peaks and means of the tiles of a picture.
#[derive(Clone, Debug, Default)]
pub struct Tiles {
    columns: usize,
    rows: usize,
    peaks: Vec<f32>,
    means: Vec<f32>,
    counts: Vec<u32>,
}

/// How bright something must be, compared with its surroundings, to be looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contrast {
    /// The least excess of a tile's peak over its mean.
    pub least: f32,
    /// The usual excess of tiles without a stripe.
    pub usual: f32,
}

impl Tiles {
    /// Measures all tiles. Columns and rows beyond the last whole tile belong to no tile.
    pub fn measure<L: Level>(&mut self, picture: &Picture<'_, L>) {
        self.columns = picture.width() / TILE;
        self.rows = picture.height() / TILE;
        self.peaks.clear();
        self.means.clear();
        let size = self.columns * self.rows;
        self.peaks.resize(size, 0.0);
        self.means.resize(size, 0.0);
        let Self { columns, peaks, means, .. } = self;
        run_fastest(TileLook { picture, columns: *columns, peaks, means });
    }

    /// How far a tile must stand out. Most tiles show no stripe: their median excess, and the spread about
    /// it, is that of the noise; `least` is 8 sigma above it, and no less than a fiftieth of the brightest.
    pub fn contrast(&mut self) -> Contrast {
        let excess = |(peak, mean): (&f32, &f32)| peak - mean;
        let top = self.peaks.iter().zip(&self.means).map(excess).fold(0.0_f32, f32::max);
        if top <= 0.0 {
            return Contrast { least: f32::INFINITY, usual: 0.0 };
        }
        // Counted in bins, since a sort would take longer than reading the picture.
        const BINS: usize = 2048;
        let bin = top / (BINS - 1) as f32;
        self.counts.clear();
        self.counts.resize(BINS, 0);
        for tile in self.peaks.iter().zip(&self.means) {
            self.counts[(excess(tile) / bin).max(0.0) as usize] += 1;
        }
        let quantile = |part: f32| {
            let wanted = (part * self.peaks.len() as f32) as u32;
            let mut seen = 0;
            let found = self.counts.iter().position(|count| {
                seen += count;
                seen > wanted
            });
            (found.unwrap_or(BINS - 1) as f32 + 0.5) * bin
        };
        let (usual, lower) = (quantile(0.5), quantile(0.16));
        let spread = (usual - lower).max(bin);
        Contrast { least: (usual + 8.0 * spread).max(0.02 * top), usual }
    }

    /// Tiles that stand out: the pixel of their middle, their peak and the level around them.
    pub(crate) fn standing_out(&self, contrast: Contrast) -> impl Iterator<Item = Candidate> + '_ {
        let tiles = self.peaks.iter().zip(&self.means).enumerate();
        tiles.filter(move |(_, (peak, mean))| *peak - *mean > contrast.least).map(move |(at, (peak, _))| {
            let (column, row) = (at % self.columns, at / self.columns);
            Candidate {
                u: (column * TILE + TILE / 2) as f32,
                v: (row * TILE + TILE / 2) as f32,
                peak: *peak,
                around: self.around_tile(column, row, 1),
            }
        })
    }

    /// The darkest mean of the tiles within `reach` tiles of a candidate.
    #[must_use]
    pub fn around(&self, candidate: &Candidate, reach: usize) -> f32 {
        self.around_tile(candidate.u as usize / TILE, candidate.v as usize / TILE, reach)
    }

    /// The greatest excess of a tile's peak over its mean, levels.
    #[must_use]
    pub(crate) fn greatest_excess(&self) -> f32 {
        self.peaks.iter().zip(&self.means).map(|(peak, mean)| peak - mean).fold(0.0, f32::max)
    }

    /// The brightest tile's peak, levels.
    #[must_use]
    pub fn brightest(&self) -> f32 {
        self.peaks.iter().copied().fold(0.0, f32::max)
    }

    /// The median of the means of about a thousand tiles, levels.
    #[must_use]
    pub(crate) fn median_level(&self) -> f32 {
        let mut some: Vec<f32> =
            self.means.iter().step_by(self.means.len().div_ceil(SAMPLED).max(1)).copied().collect();
        let middle = some.len() / 2;
        if some.is_empty() { 0.0 } else { *some.select_nth_unstable_by(middle, f32::total_cmp).1 }
    }

    /// The darkest mean of a tile and its neighbours: a stripe never covers them all.
    fn around_tile(&self, column: usize, row: usize, reach: usize) -> f32 {
        let near = |at: usize, count: usize| at.saturating_sub(reach)..(at + reach + 1).min(count);
        let mut darkest = f32::INFINITY;
        for r in near(row, self.rows) {
            for c in near(column, self.columns) {
                darkest = darkest.min(self.means[r * self.columns + c]);
            }
        }
        darkest
    }
}

/// A tile in which the stripe may run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Column of the tile's middle, px.
    pub u: f32,
    /// Row of the tile's middle, px.
    pub v: f32,
    /// Brightest level.
    pub peak: f32,
    /// Level of the surroundings.
    pub around: f32,
}

/// A picture, and where the peaks and means of its tiles are written.
struct TileLook<'a, L> {
    picture: &'a Picture<'a, L>,
    columns: usize,
    peaks: &'a mut [f32],
    means: &'a mut [f32],
}

impl<L: Level> FastLoop for TileLook<'_, L> {
    /// Peaks and means of all tiles, row by row.
    #[inline(always)]
    fn run(self) {
        let Self { picture, columns, peaks, means } = self;
        if columns == 0 {
            return;
        }
        let tiles = peaks.chunks_exact_mut(columns).zip(means.chunks_exact_mut(columns));
        for (row, (peaks, means)) in tiles.enumerate() {
            let groups = peaks.chunks_mut(GROUP).zip(means.chunks_mut(GROUP));
            for (group, (peaks, means)) in groups.enumerate() {
                let (u, v) = (group * GROUP * TILE, row * TILE);
                if peaks.len() == GROUP {
                    measure_group::<L, { GROUP * TILE }>(picture, u, v, peaks, means);
                    continue;
                }
                for (k, (peak, mean)) in peaks.chunks_mut(1).zip(means.chunks_mut(1)).enumerate() {
                    measure_group::<L, TILE>(picture, u + k * TILE, v, peak, mean);
                }
            }
        }
    }
}

/// Peaks and means of tiles beside each other, `WIDTH` pixels together, of which the first pixel is given.
#[inline(always)]
fn measure_group<L: Level, const WIDTH: usize>(
    picture: &Picture<'_, L>,
    u: usize,
    v: usize,
    peaks: &mut [f32],
    means: &mut [f32],
) {
    let mut brightest = [L::default(); WIDTH];
    let mut sums = [L::Sum::default(); WIDTH];
    for k in (0..TILE).step_by(PEAK_ROWS) {
        let levels = &picture.row(v + k)[u..u + WIDTH];
        for c in 0..WIDTH {
            brightest[c] = brightest[c].max(levels[c]);
        }
        if k % MEAN_ROWS == 0 {
            for c in 0..WIDTH {
                sums[c] = L::together(sums[c], L::Sum::from(levels[c]));
            }
        }
    }
    // A column counts as far as the one beside it does: a hot pixel has nothing beside it, a stripe has.
    let mut beside = [L::default(); WIDTH];
    for c in 0..WIDTH - 1 {
        beside[c] = if c % TILE == TILE - 1 { L::default() } else { brightest[c].min(brightest[c + 1]) };
    }
    let (beside, sums) = (gathered(beside, L::max), gathered(sums, L::together));
    for (k, (peak, mean)) in peaks.iter_mut().zip(means).enumerate() {
        *peak = beside[k * TILE].into();
        let sum: u32 = sums[k * TILE].into();
        *mean = sum as f32 / (TILE * TILE / MEAN_ROWS) as f32;
    }
}

/// In the first place of each tile all of its values made one: each with that half a tile ahead, a quarter ahead, and so on, for
/// all tiles at once.
#[inline(always)]
fn gathered<T: Copy, const WIDTH: usize>(mut values: [T; WIDTH], two: impl Fn(T, T) -> T) -> [T; WIDTH] {
    let mut ahead = TILE / 2;
    while ahead > 0 {
        for c in 0..WIDTH - ahead {
            values[c] = two(values[c], values[c + ahead]);
        }
        ahead /= 2;
    }
    values
}
