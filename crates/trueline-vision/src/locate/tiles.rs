//! The one look at every part of the picture: the brightest level and the mean of each tile.
//!
//! Every second row is used for the peak and every fourth for the mean: a stripe less than two rows thick could not be
//! measured.

use crate::fastest::{FastLoop, fastest, run_fastest};
use crate::picture::{Level, Picture};

/// Largest number of tiles of a stripe; the ones that stand out most are kept.
pub const MOST_CANDIDATES: usize = 1500;

/// Tiles from which the median level is taken.
const SAMPLED: usize = 1000;

/// Side of a tile, px.
pub const TILE: usize = 16;
/// Largest number of adjacent tiles that are read together: the data of their columns stay in the nearest memory.
const STRIP: usize = 160;
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

/// Required brightness, compared with the surroundings.
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

    /// How far a tile must stand out. Most tiles show no stripe: their median excess, and its spread, are those of
    /// the noise. `least` is 8 sigma above it, and at least a fiftieth of the brightest.
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
        fastest!(count_excesses(&self.peaks, &self.means, bin, &mut self.counts));
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

/// Counts the tiles by excess in bins; negative ones are in the first bin.
#[inline(always)]
fn count_excesses(peaks: &[f32], means: &[f32], bin: f32, counts: &mut [u32]) {
    // Many bins are found at once, then counted.
    let mut bins = [0_i32; TILE];
    for (peaks, means) in peaks.chunks(TILE).zip(means.chunks(TILE)) {
        for ((found, peak), mean) in bins.iter_mut().zip(peaks).zip(means) {
            *found = ((peak - mean) / bin).max(0.0) as i32;
        }
        for found in &bins[..peaks.len()] {
            counts[*found as usize] += 1;
        }
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
        let mut of_strip = Columns::new();
        let tiles = peaks.chunks_exact_mut(columns).zip(means.chunks_exact_mut(columns));
        for (row, (peaks, means)) in tiles.enumerate() {
            let strips = peaks.chunks_mut(STRIP).zip(means.chunks_mut(STRIP));
            for (strip, (peaks, means)) in strips.enumerate() {
                measure_strip(picture, [strip * STRIP * TILE, row * TILE], &mut of_strip, peaks, means);
            }
        }
    }
}

/// Peaks and sums of the columns of a strip.
struct Columns<L: Level> {
    brightest: [L; STRIP * TILE],
    beside: [L; STRIP * TILE],
    sums: [L::Sum; STRIP * TILE],
}

impl<L: Level> Columns<L> {
    fn new() -> Self {
        let levels = [L::default(); STRIP * TILE];
        Self { brightest: levels, beside: levels, sums: [L::Sum::default(); STRIP * TILE] }
    }
}

/// Peaks and means of adjacent tiles; the first pixel is given. Rows are read from one end to the other: memory is quickest
/// so.
#[inline(always)]
fn measure_strip<L: Level>(
    picture: &Picture<'_, L>,
    [u, v]: [usize; 2],
    columns: &mut Columns<L>,
    peaks: &mut [f32],
    means: &mut [f32],
) {
    let width = peaks.len() * TILE;
    let Columns { brightest, beside, sums } = columns;
    let (brightest, beside, sums) = (&mut brightest[..width], &mut beside[..width], &mut sums[..width]);
    for k in 0..TILE {
        let levels = &picture.row(v + k)[u..u + width];
        if k % PEAK_ROWS != 0 {
            touch(levels);
        } else if k == 0 {
            brightest.copy_from_slice(levels);
            for (sum, level) in sums.iter_mut().zip(levels) {
                *sum = L::Sum::from(*level);
            }
        } else {
            for (brightest, level) in brightest.iter_mut().zip(levels) {
                *brightest = (*brightest).max(*level);
            }
            if k % MEAN_ROWS == 0 {
                for (sum, level) in sums.iter_mut().zip(levels) {
                    *sum = L::together(*sum, L::Sum::from(*level));
                }
            }
        }
    }
    // A column counts as far as the one beside it does: a hot pixel has nothing beside it, a stripe has.
    for (beside, two) in beside.iter_mut().zip(brightest.windows(2)) {
        *beside = two[0].min(two[1]);
    }
    for last in beside.iter_mut().skip(TILE - 1).step_by(TILE) {
        *last = L::default();
    }
    let of_tiles = beside.as_chunks::<TILE>().0.iter().zip(sums.as_chunks::<TILE>().0);
    for ((peak, mean), (beside, sums)) in peaks.iter_mut().zip(means).zip(of_tiles) {
        *peak = beside.iter().copied().fold(L::default(), L::max).into();
        let sum: u32 = sums.iter().copied().fold(L::Sum::default(), L::together).into();
        *mean = sum as f32 / (TILE * TILE / MEAN_ROWS) as f32;
    }
}

/// Reads levels, and does nothing with them: memory that is read without a gap arrives several times as fast as every second row of it
/// would. All of them, since one instruction reads many.
#[inline(always)]
fn touch<L: Level>(levels: &[L]) {
    std::hint::black_box(levels.iter().fold(L::default(), |any, level| any.max(*level)));
}
