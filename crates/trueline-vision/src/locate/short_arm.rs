//! A short arm where a long one ends: the ray from there along which the picture has a ridge without a break.
//!
//! An arm of two or three tiles is too short to be seen as a segment. At the end of a long arm the place of the search is
//! known. Of all rays from there the one with the largest excess in its *weakest* stretch counts, so glints, shades and
//! borders have no effect.

use crate::fastest::fastest;
use crate::frame::Frame;
use crate::lens::Lens;
use crate::line::Line2;
use crate::locate::line_segment::{LineSegment, SegmentMark};
use crate::picture::Level;
use crate::region::PictureRegion;
use nalgebra::Vector2;

/// How far from the last edgel of the long arm the corner may lie, px, and the steps between the places that are tried.
const REACH_PX: f64 = 16.0;
const STEP_PX: f64 = 2.0;
/// Directions that are tried: 4° apart, and none within 12° of the long arm's line.
const DIRECTIONS: usize = 90;
const LEAST_BEND_RAD: f64 = 0.21;
/// A ray begins this far from the corner, px. Its stretches overlap by half, so that no gap of their length falls between
/// them. This many of them must show the ridge.
const BEGINS_PX: f64 = 6.0;
const STRETCH: usize = 4;
const APART: usize = 2;
const FEWEST: usize = 13;
const MOST: usize = 80;
/// A stretch belongs to the arm if it has this part of its contrast.
const GOES_ON: f32 = 0.4;
/// The weakest stretch has at least this part of the long arm's contrast, and the weakest of a ray elsewhere at most this part
/// of it.
const LEAST: f32 = 0.1;
const RIVAL: f32 = 0.5;
/// A ray elsewhere differs by more than this, rad.
const ELSEWHERE_RAD: f64 = 0.35;
/// The sides of a ray with which it is compared: from and to, px from its middle.
const SIDE_PX: [i32; 2] = [4, 7];
/// Distances between the edgels that represent the arm, px.
const MARK_PX: f64 = 8.0;

/// A ray in the picture, and how much its weakest stretch and all of it stand out.
#[derive(Clone, Copy, Debug)]
struct Ray {
    from: Vector2<f64>,
    heading_rad: f64,
    weakest: f32,
    mean: f32,
}

impl Ray {
    /// Whether it belongs to one arm all along.
    fn is_even(&self) -> bool {
        self.weakest > GOES_ON * self.mean
    }
}

/// Search for a short arm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShortArmSearch<'a, L> {
    /// The picture and its lens.
    pub(crate) frame: Frame<'a, L>,
    /// The part of it that counts.
    pub(crate) region: &'a PictureRegion,
    /// How far the surface itself stands out from itself, levels: an arm does so by more.
    pub(crate) usual: f32,
}

/// The short arm at an end of a long one, in ideal pixels; `None` if there is none, or several could be.
pub(crate) fn short_arm<L: Level>(
    search: &ShortArmSearch<'_, L>,
    long: &LineSegment,
    at_last: bool,
) -> Option<LineSegment> {
    let lens = search.frame.lens;
    let [first, last] = long.span();
    let (end_s, outward) = if at_last { (last, 1.0) } else { (first, -1.0) };
    let end = lens.distorted(&long.line.at(end_s)).0;
    let before = lens.distorted(&long.line.at(end_s - outward)).0;
    let along = (end - before).normalize();
    let rays = fastest!(sweep(search, [end, along]));
    let best = rays.iter().flatten().max_by(|a, b| a.weakest.total_cmp(&b.weakest))?;
    let elsewhere = rays.iter().flatten().filter(|ray| turn(ray, best) > ELSEWHERE_RAD);
    let rival = elsewhere.fold(0.0_f32, |most, ray| most.max(ray.weakest));
    let stands_out = best.mean > search.usual && best.weakest > LEAST * long.brightness as f32;
    if !(best.is_even() && stands_out && rival < RIVAL * best.weakest) {
        return None;
    }
    let near = near_by(search, [best.from, along], best.heading_rad);
    let best = near.max_by(|a, b| a.mean.total_cmp(&b.mean)).unwrap_or(*best);
    let goes_on = |number: &usize| search.stretch(&best, *number).is_some_and(|s| s > GOES_ON * best.mean);
    let stretches = FEWEST + (FEWEST..MOST).take_while(goes_on).count();
    segment(lens, long, &best, BEGINS_PX + ((stretches - 1) * APART + STRETCH) as f64)
}

/// Angle between two rays, rad.
fn turn(a: &Ray, b: &Ray) -> f64 {
    let apart = (a.heading_rad - b.heading_rad).rem_euclid(std::f64::consts::TAU);
    apart.min(std::f64::consts::TAU - apart)
}

/// In each direction the ray that stands out most.
#[inline(always)]
fn sweep<L: Level>(
    search: &ShortArmSearch<'_, L>,
    [end, along]: [Vector2<f64>; 2],
) -> [Option<Ray>; DIRECTIONS] {
    let line_rad = along.y.atan2(along.x);
    std::array::from_fn(|direction| {
        let heading_rad = line_rad + direction as f64 * std::f64::consts::TAU / DIRECTIONS as f64;
        if (heading_rad - line_rad).sin().abs() < LEAST_BEND_RAD.sin() {
            return None;
        }
        let steps = (2.0 * REACH_PX / STEP_PX) as usize;
        let places = (0..=steps).map(|k| end + along * (k as f64 * STEP_PX - REACH_PX));
        let rays = places.filter_map(|from| search.ray(from, heading_rad));
        rays.max_by(|a, b| a.weakest.total_cmp(&b.weakest))
    })
}

/// Rays near one: shifted along a direction by up to 2 px, and turned by up to 4°.
fn near_by<L: Level>(
    search: &ShortArmSearch<'_, L>,
    [from, shift]: [Vector2<f64>; 2],
    heading_rad: f64,
) -> impl Iterator<Item = Ray> {
    let steps = || (-4..=4).map(f64::from);
    let all = steps().flat_map(move |px| steps().map(move |deg| [0.5 * px, deg.to_radians()]));
    all.filter_map(move |[px, rad]| search.ray(from + shift * px, heading_rad + rad))
}

impl<L: Level> ShortArmSearch<'_, L> {
    /// Whether an arm leads from a pixel towards another without a break, as far as a short one must. A row of glints does
    /// not.
    pub(crate) fn leads(&self, from: Vector2<f64>, to: Vector2<f64>) -> bool {
        let along = (to - from).normalize();
        let across = Vector2::new(-along.y, along.x);
        near_by(self, [from, across], along.y.atan2(along.x)).any(|ray| ray.is_even())
    }

    /// Whether the path from a pixel towards another stands out on average, as far as a short arm must reach.
    pub(crate) fn shows(&self, from: Vector2<f64>, to: Vector2<f64>) -> bool {
        let along = to - from;
        let ray = Ray { from, heading_rad: along.y.atan2(along.x), weakest: 0.0, mean: 0.0 };
        let sum: Option<f32> = (0..FEWEST).map(|number| self.stretch(&ray, number)).sum();
        sum.is_some_and(|sum| sum > self.usual * FEWEST as f32)
    }

    /// The ray from a place; `None` if it has no ridge all along.
    #[inline(always)]
    fn ray(&self, from: Vector2<f64>, heading_rad: f64) -> Option<Ray> {
        let mut ray = Ray { from, heading_rad, weakest: f32::INFINITY, mean: 0.0 };
        for number in 0..FEWEST {
            let contrast = self.stretch(&ray, number).filter(|contrast| *contrast > 0.0)?;
            ray.weakest = ray.weakest.min(contrast);
            ray.mean += contrast / FEWEST as f32;
        }
        Some(ray)
    }

    /// Excess of a stretch of a ray over the brighter of its sides, levels; `None` outside the region or the picture.
    #[inline(always)]
    fn stretch(&self, ray: &Ray, number: usize) -> Option<f32> {
        let (sin, cos) = ray.heading_rad.sin_cos();
        let (along, across) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
        let begin = BEGINS_PX + (number * APART) as f64;
        let end = ray.from + along * (begin + STRETCH as f64);
        if !self.region.contains(end.x, end.y) {
            return None;
        }
        let mean = |distances_px: std::ops::RangeInclusive<i32>| {
            let mut sum = 0.0_f32;
            let count = STRETCH * distances_px.clone().count();
            for k in 0..STRETCH {
                let at = ray.from + along * (begin + k as f64);
                for distance_px in distances_px.clone() {
                    sum += self.level(at + across * f64::from(distance_px))?;
                }
            }
            Some(sum / count as f32)
        };
        let [low, high] = [mean(-SIDE_PX[1]..=-SIDE_PX[0])?, mean(SIDE_PX[0]..=SIDE_PX[1])?];
        Some(mean(-1..=1)? - low.max(high))
    }

    /// The level of the pixel nearest to a place.
    #[inline(always)]
    fn level(&self, at: Vector2<f64>) -> Option<f32> {
        let picture = self.frame.picture;
        let [u, v] = [at.x.round(), at.y.round()];
        let inside = u >= 0.0 && v >= 0.0 && u < picture.width() as f64 && v < picture.height() as f64;
        inside.then(|| picture.row(v as usize)[u as usize].into())
    }
}

/// A ray as a segment with edgels as thick as the long arm's.
fn segment(lens: &Lens, long: &LineSegment, ray: &Ray, length_px: f64) -> Option<LineSegment> {
    let (sin, cos) = ray.heading_rad.sin_cos();
    let ideal = |s: f64| {
        let pixel = ray.from + Vector2::new(cos, sin) * s;
        Vector2::from(lens.ideal(pixel.x as f32, pixel.y as f32).map(f64::from))
    };
    let [from, to] = [BEGINS_PX, length_px].map(ideal);
    let line = Line2 { point: from, along: (to - from).normalize() };
    let brightness = f64::from(ray.mean);
    let weight = (brightness / long.brightness).sqrt();
    let count = ((to - from).norm() / MARK_PX) as usize;
    let marks = (0..=count).map(|k| SegmentMark { s: k as f64 * MARK_PX, beside_px: 0.0, weight }).collect();
    let is_number = line.along.iter().all(|x| x.is_finite());
    is_number.then_some(LineSegment { line, marks, sigma_px: long.sigma_px, brightness })
}
