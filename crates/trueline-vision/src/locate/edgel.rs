//! Short straight edgels of a stripe: where, which way, how bright, how thick.
//!
//! Brightness above the surroundings in a window acts as mass; its first two moments give a place and an axis
//! \[Hu1962\]. The window moves across the stripe until it is centred there, so that its border sections both flanks
//! alike.

use crate::fastest::fastest;
use crate::locate::tiles::{Candidate, TILE};
use crate::picture::{Level, Picture};

/// Side of the window, px: three vectors of eight.
pub(crate) const WINDOW: usize = 24;
const HALF: f32 = (WINDOW - 1) as f32 * 0.5;
/// Part of a tile's contrast below which brightness has no mass. It is a little above the surroundings. If the bright part
/// has no direction then, it is half way up: the stripe on a bright surface beside a dark one.
const FLOORS: [f32; 2] = [0.12, 0.5];
/// The thickest mass, as the ratio of its two variances, that still has an axis.
const ROUNDEST: f32 = 0.45;

/// Number of edgels in which the same one is searched.
const REMEMBERED: usize = 24;

/// A short element of the stripe's ridge in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edgel {
    /// Column of its middle, px.
    pub u: f32,
    /// Row of its middle, px.
    pub v: f32,
    /// Unit vector along it.
    pub along: [f32; 2],
    /// Standard deviation of the brightness across it, px.
    pub sigma_px: f32,
    /// Its contrast: mean brightness above the surroundings on the ridge, in levels.
    pub brightness: f32,
}

/// The edgel in a tile that stands out, or `None` if its bright part has no direction.
#[inline(always)]
#[must_use]
pub(crate) fn edgel<L: Level>(picture: &Picture<'_, L>, candidate: &Candidate) -> Option<Edgel> {
    // A loop, not a chain of closures: these would be compiled for any processor.
    for floor in FLOORS {
        if let Some(found) = edgel_above(picture, candidate, floor, 1) {
            return Some(found);
        }
    }
    None
}

/// The same in a window `stride` times as large, with every `stride`-th pixel read.
#[inline(always)]
#[must_use]
pub(crate) fn edgel_at_stride<L: Level>(
    picture: &Picture<'_, L>,
    candidate: &Candidate,
    stride: usize,
) -> Option<Edgel> {
    // Adjacent pixels are read many at once, if known to be adjacent.
    match stride {
        1 => edgel_above(picture, candidate, FLOORS[0], 1),
        _ => edgel_above(picture, candidate, FLOORS[0], stride),
    }
}

#[inline(always)]
fn edgel_above<L: Level>(
    picture: &Picture<'_, L>,
    candidate: &Candidate,
    floor: f32,
    stride: usize,
) -> Option<Edgel> {
    let threshold = candidate.around + floor * (candidate.peak - candidate.around);
    let (mut u, mut v) = (candidate.u, candidate.v);
    let mut found = None;
    for _ in 0..3 {
        let moments = Moments::of(picture, [u, v], threshold, stride)?;
        let axis = moments.axis()?;
        // Only across: along the stripe every window keeps its place.
        let across = [-axis.along[1], axis.along[0]];
        let shift = moments.mean[0] * across[0] + moments.mean[1] * across[1];
        u += shift * across[0];
        v += shift * across[1];
        found = Some(Edgel {
            u,
            v,
            along: axis.along,
            sigma_px: axis.variances[0].max(0.0).sqrt(),
            brightness: 2.0 * moments.mass / (WINDOW as f32 * 2.5 * axis.variances[0].max(0.25).sqrt()),
        });
        if shift.abs() < 0.5 * stride as f32 {
            break;
        }
    }
    // A window that has wandered off belongs to another tile.
    let reach = (WINDOW * stride) as f32;
    found.filter(|e| (e.u - candidate.u).abs() < reach && (e.v - candidate.v).abs() < reach)
}

/// The edgels of all candidates.
pub(crate) fn edgels<L: Level>(picture: &Picture<'_, L>, candidates: &[Candidate], found: &mut Vec<Edgel>) {
    found.clear();
    fastest!(extend(picture, candidates, found));
}

#[inline(always)]
fn extend<L: Level>(picture: &Picture<'_, L>, candidates: &[Candidate], found: &mut Vec<Edgel>) {
    // One for each tile's worth of picture: a tile with an edgel already, found from its neighbour, has nothing new.
    // Candidates come row by row, so that it is among the last few, or a row of tiles ago.
    let tile = |u: f32, v: f32| [u, v].map(|x| x as i32 / TILE as i32);
    for candidate in candidates {
        let recent = found.len().saturating_sub(REMEMBERED);
        let known = |u: f32, v: f32| found[recent..].iter().any(|other| tile(other.u, other.v) == tile(u, v));
        if known(candidate.u, candidate.v) {
            continue;
        }
        if let Some(next) = edgel(picture, candidate).filter(|next| !known(next.u, next.v)) {
            found.push(next);
        }
    }
}

struct Moments {
    mass: f32,
    /// From the window's centre, px.
    mean: [f32; 2],
    /// uu, uv, vv, px².
    second: [f32; 3],
}

struct Axis {
    along: [f32; 2],
    /// Across and along, px².
    variances: [f32; 2],
}

impl Moments {
    #[inline(always)]
    /// Moments about a centre; `None` where the window leaves the picture or all is dark.
    fn of<L: Level>(
        picture: &Picture<'_, L>,
        [u, v]: [f32; 2],
        threshold: f32,
        stride: usize,
    ) -> Option<Self> {
        let px = stride as f32;
        let (left, top) = ((u - HALF * px).round(), (v - HALF * px).round());
        if left < 0.0 || top < 0.0 {
            return None;
        }
        let (column, row) = (left as usize, top as usize);
        if column + WINDOW * stride > picture.width() || row + WINDOW * stride > picture.height() {
            return None;
        }
        // Sums over the window's rows, kept apart by column: adding vectors needs no shuffles.
        let (mut mass, mut first, mut second) = ([0.0_f32; WINDOW], [0.0_f32; WINDOW], [0.0_f32; WINDOW]);
        // Every second row: a place to within a few tenths of a pixel is enough here.
        for k in (0..WINDOW).step_by(2) {
            let y = top + k as f32 * px - v;
            let levels = &picture.row(row + k * stride)[column..column + WINDOW * stride];
            for c in 0..WINDOW {
                let weight = (Into::<f32>::into(levels[c * stride]) - threshold).max(0.0);
                mass[c] += weight;
                first[c] += weight * y;
                second[c] += weight * y * y;
            }
        }
        let mut sums = [0.0_f32; 6];
        for c in 0..WINDOW {
            let x = left + c as f32 * px - u;
            let terms = [mass[c], mass[c] * x, first[c], mass[c] * x * x, first[c] * x, second[c]];
            for (sum, term) in sums.iter_mut().zip(terms) {
                *sum += term;
            }
        }
        let [mass, x, y, xx, xy, yy] = sums;
        if mass <= 0.0 {
            return None;
        }
        let mean = [x / mass, y / mass];
        let second =
            [xx / mass - mean[0] * mean[0], xy / mass - mean[0] * mean[1], yy / mass - mean[1] * mean[1]];
        Some(Self { mass, mean, second })
    }

    /// The axis of the larger variance; `None` if the mass is round.
    fn axis(&self) -> Option<Axis> {
        let [uu, uv, vv] = self.second;
        let (mean, difference) = (0.5 * (uu + vv), 0.5 * (uu - vv));
        let root = (difference * difference + uv * uv).sqrt();
        let variances = [mean - root, mean + root];
        if variances[0] > ROUNDEST * variances[1] {
            return None;
        }
        // The larger eigenvector: (difference + root, uv) or, if that cancels, (uv, root − difference).
        let [u, v] = if difference > 0.0 { [difference + root, uv] } else { [uv, root - difference] };
        let length = (u * u + v * v).sqrt();
        // Along rising u, as an angle within 90° is.
        let sign = if u < 0.0 { -1.0 } else { 1.0 };
        Some(Axis { along: [sign * u / length, sign * v / length], variances })
    }
}
