//! Edgels of a thin stripe on a surface that is lit itself, in daylight: where a short bar is brighter than both of its sides.
//!
//! A window's moments see a stripe on dark ground. On bright ground they see the ground, its shades and its borders. The ridge of a
//! stripe remains there: along a bar it is brighter than on *either* side, and so are neither shades nor borders.

use crate::fastest::fastest;
use crate::locate::edgel::Edgel;
use crate::picture::{Level, Picture};
use crate::region::PictureRegion;

/// Distance of the sampled places, px.
const STEP: usize = 8;
/// Largest number of places.
const MOST_SITES: usize = 4000;
/// Half of a bar's length, and how far to each side of it is looked, px.
const HALF_LENGTH: usize = 6;
const LENGTH: usize = 2 * HALF_LENGTH + 1;
const HALF_WIDTH: usize = 12;
const WIDTH: usize = 2 * HALF_WIDTH + 1;
/// Directions that are tried: 11.25° apart.
const DIRECTIONS: usize = 16;
/// The ridge is three pixels wide, and lies this far from the place at most, px; its sides are four pixels each, three away from it.
const MOST_BESIDE: usize = 5;
const SIDE: std::ops::Range<usize> = 4..8;
/// Distance of the middle of a side from a ridge, px.
pub(crate) const MIDDLE_OF_SIDE_PX: f64 = 5.5;
/// A bar must exceed bars elsewhere by this multiple of their spread: most places show no stripe.
const SPREADS: f32 = 3.5;

/// A bar at one place, in the direction in which it stands out most.
#[derive(Clone, Copy, Debug)]
struct Bar {
    at: [f32; 2],
    along: [f32; 2],
    contrast: f32,
    sigma_px: f32,
    /// Whether all of its comparison lies in the region.
    is_inside: bool,
}

/// The pixels of a bar and of its sides about a place, in one direction.
#[derive(Clone, Debug)]
struct BarPixels {
    along: [f32; 2],
    /// Places in the picture's levels relative to that of the bar, by distance from the middle line, for each step along it.
    steps: [[isize; WIDTH]; LENGTH],
}

impl BarPixels {
    fn all(columns: usize) -> impl Iterator<Item = Self> {
        (0..DIRECTIONS).map(move |direction| {
            let (sin, cos) = (direction as f32 * std::f32::consts::PI / DIRECTIONS as f32).sin_cos();
            let place = |s: f32, d: f32| {
                let (x, y) = ((s * cos - d * sin).round() as isize, (s * sin + d * cos).round() as isize);
                y * columns as isize + x
            };
            let step = |along: usize| {
                let s = along as f32 - HALF_LENGTH as f32;
                std::array::from_fn(|k| place(s, k as f32 - HALF_WIDTH as f32))
            };
            Self { along: [cos, sin], steps: std::array::from_fn(step) }
        })
    }
}

/// Finds ridges; keeps its memory from one picture to the next.
#[derive(Clone, Debug)]
pub(crate) struct RidgeFinder {
    most_sites: usize,
    /// For each direction, in pictures of [`Self::columns`].
    pixels: Vec<BarPixels>,
    columns: usize,
    bars: Vec<Bar>,
    contrasts: Vec<f32>,
    /// Usual contrast of bars, and its spread, in levels.
    usual: f32,
    spread: f32,
}

impl Default for RidgeFinder {
    fn default() -> Self {
        Self {
            most_sites: MOST_SITES,
            pixels: Vec::new(),
            columns: 0,
            bars: Vec::new(),
            contrasts: Vec::new(),
            usual: 0.0,
            spread: 0.0,
        }
    }
}

impl RidgeFinder {
    /// One that searches all places of a region, at any number: for pictures without a time limit.
    pub(crate) fn everywhere() -> Self {
        Self { most_sites: usize::MAX, ..Self::default() }
    }

    /// The edgels of ridges within a region of a picture; none if the region has more places than allowed.
    pub(crate) fn find<L: Level>(
        &mut self,
        picture: &Picture<'_, L>,
        region: &PictureRegion,
        edgels: &mut Vec<Edgel>,
    ) {
        edgels.clear();
        self.bars.clear();
        if self.columns != picture.width() {
            self.columns = picture.width();
            self.pixels.clear();
            self.pixels.extend(BarPixels::all(self.columns));
        }
        let margin = HALF_WIDTH + HALF_LENGTH;
        let [columns, rows] = [picture.width(), picture.height()]
            .map(|size| (margin..size.saturating_sub(margin)).step_by(STEP));
        let sites = rows.flat_map(|v| columns.clone().map(move |u| [u, v]));
        for site in sites.filter(|site| region.contains(site[0] as f64, site[1] as f64)) {
            if self.bars.len() == self.most_sites {
                return;
            }
            let far = HALF_WIDTH as f64;
            let around = [[far, 0.0], [-far, 0.0], [0.0, far], [0.0, -far]];
            let is_inside =
                around.iter().all(|[du, dv]| region.contains(site[0] as f64 + du, site[1] as f64 + dv));
            self.bars.push(Bar { is_inside, ..fastest!(best_bar(picture, &self.pixels, site)) });
        }
        if self.measure_usual().is_none() {
            return;
        }
        let least = self.usual + SPREADS * self.spread;
        for bar in self.bars.iter().filter(|bar| bar.contrast > least) {
            let cell = |at: [f32; 2]| at.map(|x| x as usize / STEP);
            if edgels.iter().rev().take(2 * MOST_SITES / STEP).any(|e| cell([e.u, e.v]) == cell(bar.at)) {
                continue;
            }
            let Bar { at: [u, v], along, contrast, sigma_px, .. } = *bar;
            edgels.push(Edgel { u, v, along, sigma_px, brightness: contrast });
        }
    }

    /// Excess that a line of bars must have over the surface's own pattern, levels.
    pub(crate) fn more_than_usual(&self) -> f32 {
        self.usual + self.spread
    }

    fn measure_usual(&mut self) -> Option<()> {
        self.contrasts.clear();
        self.contrasts.extend(self.bars.iter().filter(|bar| bar.is_inside).map(|bar| bar.contrast));
        let mut quantile = |part: f32| {
            let at = (part * self.contrasts.len() as f32) as usize;
            (at < self.contrasts.len()).then(|| *self.contrasts.select_nth_unstable_by(at, f32::total_cmp).1)
        };
        // A quarter of a normal distribution lies 0.674 of its spread below the middle.
        let (usual, lower) = (quantile(0.5)?, quantile(0.25)?);
        (self.usual, self.spread) = (usual, ((usual - lower) / 0.674).max(1e-3));
        Some(())
    }
}

/// The bar that stands out most about a place.
#[inline(always)]
fn best_bar<L: Level>(picture: &Picture<'_, L>, directions: &[BarPixels], [u, v]: [usize; 2]) -> Bar {
    let (at, contrast) = ([u as f32, v as f32], f32::NEG_INFINITY);
    let mut best = Bar { at, along: [1.0, 0.0], contrast, sigma_px: 1.0, is_inside: true };
    let place = v * picture.width() + u;
    for direction in directions {
        let [cos, sin] = direction.along;
        let profile = profile(picture.levels(), place, &direction.steps);
        for middle in HALF_WIDTH - MOST_BESIDE..=HALF_WIDTH + MOST_BESIDE {
            let side =
                |first: usize| profile[first..first + SIDE.len()].iter().sum::<f32>() / SIDE.len() as f32;
            let ground = side(middle + SIDE.start).max(side(middle + 1 - SIDE.end));
            let contrast = profile[middle - 1..=middle + 1].iter().sum::<f32>() / 3.0 - ground;
            if contrast > best.contrast {
                let (beside, sigma_px) = middle_and_width(&profile, middle, ground);
                let beside = beside - HALF_WIDTH as f32;
                let at = [u as f32 - beside * sin, v as f32 + beside * cos];
                best = Bar { at, along: [cos, sin], contrast, sigma_px, is_inside: true };
            }
        }
    }
    best
}

/// Mean level along a bar by distance from its middle line.
#[inline(always)]
fn profile<L: Level>(levels: &[L], place: usize, steps: &[[isize; WIDTH]; LENGTH]) -> [f32; WIDTH] {
    let mut sums = [0.0_f32; WIDTH];
    for step in steps {
        for (sum, relative) in sums.iter_mut().zip(step) {
            *sum += levels[place.wrapping_add_signed(*relative)].into();
        }
    }
    sums.map(|sum| sum / LENGTH as f32)
}

/// Centre of gravity and standard deviation of the light above the ground between a ridge's sides, px.
fn middle_and_width(profile: &[f32; WIDTH], middle: usize, ground: f32) -> (f32, f32) {
    let (mut mass, mut first, mut second) = (0.0, 0.0, 0.0);
    let from = middle + 1 - SIDE.start;
    for (k, level) in profile[from..middle + SIDE.start].iter().enumerate() {
        let (light, d) = ((level - ground).max(0.0), (from + k) as f32 - middle as f32);
        mass += light;
        first += light * d;
        second += light * d * d;
    }
    let mass = mass.max(f32::MIN_POSITIVE);
    let mean = first / mass;
    (middle as f32 + mean, (second / mass - mean * mean).max(0.25).sqrt())
}
