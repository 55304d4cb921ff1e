//! Reduces pictures of thick stripes, so that every stripe is a few pixels thick at the measurement.

use crate::fastest::fastest;
use crate::lens::Lens;
use crate::locate::edgel::{Edgel, WINDOW, edgel_at_stride};
use crate::locate::tiles::{Candidate, Tiles};
use crate::picture::{Level, Picture};

/// Pixels that become one, along each axis, as powers of two: stripes of up to 5, 10, 20 and 40 px.
pub(crate) const FACTORS: [usize; 4] = [1, 2, 4, 8];
/// The thickest stripe measured without reduction, as a part of the window that finds it.
const THICKEST: f32 = 0.23;
/// Candidates that are asked at most.
const ASKED: usize = 48;

/// Factor by which a picture must be reduced to make its stripe thin enough: the best one for most candidates with a
/// clear direction.
pub fn factor<L: Level>(picture: &Picture<'_, L>, tiles: &Tiles, candidates: &[Candidate]) -> usize {
    let every = candidates.len().div_ceil(ASKED).max(1);
    let mut votes = [0.0_f32; FACTORS.len()];
    for candidate in candidates.iter().step_by(every) {
        if let Some((vote, brightness)) = fastest!(wanted(picture, tiles, candidate)) {
            votes[vote] += brightness.sqrt();
        }
    }
    let half = 0.5 * votes.iter().sum::<f32>();
    let mut sum = 0.0;
    let middle = votes.iter().position(|votes| {
        sum += votes;
        sum > half
    });
    FACTORS[middle.unwrap_or(0)]
}

/// The first of the factors at which the stripe at a candidate is thin enough, and how bright it is.
#[inline(always)]
fn wanted<L: Level>(picture: &Picture<'_, L>, tiles: &Tiles, candidate: &Candidate) -> Option<(usize, f32)> {
    // A loop, not a chain of closures: these would be compiled for any processor.
    for (vote, factor) in FACTORS.iter().enumerate() {
        let around = tiles.around(candidate, *factor);
        let edgel = edgel_at_stride(picture, &Candidate { around, ..*candidate }, *factor);
        let thin = |edgel: &Edgel| edgel.sigma_px < THICKEST * (WINDOW * factor) as f32;
        if let Some(edgel) = edgel.filter(thin) {
            return Some((vote, edgel.brightness));
        }
    }
    None
}

/// Memory of a picture that was made smaller.
#[derive(Clone, Debug, Default)]
pub struct BinnedLevels {
    levels: Vec<u16>,
    /// Sums of a few rows, column by column.
    sums: Vec<u32>,
}

/// A picture with `factor` × `factor` pixels made one; columns and rows that are left over are dropped.
pub fn bin<'a, L: Level>(
    picture: &Picture<'_, L>,
    factor: usize,
    memory: &'a mut BinnedLevels,
) -> Option<Picture<'a, u16>> {
    let (width, height) = (picture.width() / factor, picture.height() / factor);
    memory.levels.resize(width * height, 0);
    memory.sums.resize(picture.width(), 0);
    let BinnedLevels { sums, levels } = memory;
    fastest!(add_up(picture, factor, sums, levels));
    Picture::new(width, height, levels)
}

/// Rows are added to each other first, then columns: the first is most of the work, and one instruction adds many.
#[inline(always)]
fn add_up<L: Level>(picture: &Picture<'_, L>, factor: usize, sums: &mut [u32], binned: &mut [u16]) {
    let shift = L::excess_bits(factor.trailing_zeros());
    for (row, out) in binned.chunks_exact_mut((picture.width() / factor).max(1)).enumerate() {
        sums.fill(0);
        for k in 0..factor {
            for (sum, level) in sums.iter_mut().zip(picture.row(row * factor + k)) {
                // 64 levels of 16 bits fit.
                *sum = sum.wrapping_add(L::Sum::from(*level).into());
            }
        }
        for (out, columns) in out.iter_mut().zip(sums.chunks_exact(factor)) {
            *out = (columns.iter().fold(0_u32, |all, sum| all.wrapping_add(*sum)) >> shift) as u16;
        }
    }
}

/// The lens of pictures that were made smaller. `None` for pictures that have nothing left.
#[must_use]
pub(crate) fn binned_lens(lens: &Lens, factor: usize) -> Option<Lens> {
    let k = factor as f64;
    let mut camera = *lens.camera();
    camera.size = camera.size.map(|n| n / factor as u32);
    camera.focal /= k;
    // Pixel 0 of the small picture is centred on the middle of the first `factor` pixels.
    camera.centre = camera.centre.add_scalar(-0.5 * (k - 1.0)) / k;
    (camera.size[0] > 0 && camera.size[1] > 0).then(|| Lens::new(camera, *lens.plane()))
}
