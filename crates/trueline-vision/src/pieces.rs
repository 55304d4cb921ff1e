//! Straight pieces of a stripe anywhere in a picture, in any surroundings.
//!
//! A seam needs the one stripe and its joint. A measurement of the laser plane on a board has no joint, and beside the
//! stripe there are squares, margins and the edge of a table. So every bright ridge is a piece here, each measured as the
//! stripes of a seam are; which of them are the laser's is for the caller, who has several pictures.

use crate::frame::Frame;
use crate::lens::Lens;
use crate::line::Line2;
use crate::locate::binning::{BinnedLevels, FACTORS, bin, binned_lens};
use crate::locate::edgel::Edgel;
use crate::locate::line_segment::{LineSegment, SegmentFinder};
use crate::locate::ridge_edgel::{MIDDLE_OF_SIDE_PX, RidgeFinder};
use crate::locate::segment_parts::SegmentParts;
use crate::locate::tiles::TILE;
use crate::measure::cross_section::BESIDE;
use crate::measure::stripe_meter::{Fit, StripeMeter};
use crate::measure::template::Template;
use crate::picture::Picture;
use crate::region::PictureRegion;
use nalgebra::{Vector2, Vector3};
use trueline_geometry::Plane;
use trueline_model::Camera;

/// Stretches of a piece that are measured separately, px: over this length a stripe on a bent surface is straight.
const STRETCH_PX: f64 = 48.0;

/// A stretch shows the stripe if it has this part of the piece's usual amplitude.
const PRESENT: f64 = 0.25;

/// A middle farther off the line of its stretch than this number of standard deviations is rejected.
const OUTLIER_SIGMAS: f64 = 4.0;

/// Lines that are tried for one segment: a short stripe has few of all ridges.
const TRIALS: usize = 1500;

/// A measured piece of stripe.
#[derive(Clone, Debug, PartialEq)]
pub struct StripePiece {
    /// Its middle at every section that shows it, in order along it, px of the picture.
    pub pixels: Vec<Vector2<f64>>,
    /// Standard deviation of a middle across the stripe, px.
    pub sigma_px: f64,
    /// Width at half of its height, px.
    pub width_px: f64,
    /// From its first middle to its last, px.
    pub length_px: f64,
    /// How far it stands above its surroundings, in levels.
    pub contrast: f64,
    /// Pixels that were made one, along each axis, to measure it.
    pub factor: usize,
}

/// Painted under a pair of pixels beside the stripe.
pub trait Paint {
    /// Whether both pixels, and all between them, show one paint.
    fn is_plain_between(&self, a: &Vector2<f64>, b: &Vector2<f64>) -> bool;
}

/// Finds pieces in pictures of one camera; keeps its memory from one picture to the next.
#[derive(Clone, Debug)]
pub struct PieceFinder {
    lenses: [Option<Lens>; FACTORS.len()],
    ridges: RidgeFinder,
    edgels: Vec<Edgel>,
    finder: SegmentFinder,
    segments: Vec<LineSegment>,
    parts: SegmentParts,
    meter: StripeMeter,
    binned: BinnedLevels,
}

impl PieceFinder {
    /// A finder for a camera.
    #[must_use]
    pub fn new(camera: &Camera) -> Self {
        // The place of the laser's sheet is not needed here: the pieces determine it.
        let lens = Plane::new(Vector3::z(), 1.0).map(|sheet| Lens::new(*camera, sheet));
        Self {
            lenses: FACTORS.map(|factor| lens.as_ref().and_then(|lens| binned_lens(lens, factor))),
            ridges: RidgeFinder::everywhere(),
            edgels: Vec::new(),
            finder: SegmentFinder::with_trials(TRIALS),
            segments: Vec::new(),
            parts: SegmentParts::default(),
            meter: StripeMeter::on_paint(),
            binned: BinnedLevels::default(),
        }
    }

    /// All pieces of a picture within a region, at every scale at which they are seen, the longest first.
    pub fn find(
        &mut self,
        picture: &Picture<'_, u16>,
        region: &PictureRegion,
        paint: &dyn Paint,
    ) -> Vec<StripePiece> {
        let mut pieces = Vec::new();
        let mut memory = std::mem::take(&mut self.binned);
        let lenses = std::mem::take(&mut self.lenses);
        for (factor, lens) in FACTORS.into_iter().zip(&lenses) {
            let Some(lens) = lens else { continue };
            let smaller = if factor == 1 { Some(*picture) } else { bin(picture, factor, &mut memory) };
            let Some(smaller) = smaller else { continue };
            let frame = Frame { picture: &smaller, lens };
            self.find_at(frame, factor, region, paint, &mut pieces);
        }
        (self.binned, self.lenses) = (memory, lenses);
        pieces.sort_by(|a, b| b.length_px.total_cmp(&a.length_px));
        pieces
    }

    fn find_at(
        &mut self,
        frame: Frame<'_, u16>,
        factor: usize,
        region: &PictureRegion,
        paint: &dyn Paint,
        pieces: &mut Vec<StripePiece>,
    ) {
        let Some(region) = region.binned(factor) else { return };
        self.ridges.find(frame.picture, &region, &mut self.edgels);
        self.edgels.retain(|edgel| is_on_plain_paint(edgel, factor, paint));
        self.finder.find(&self.edgels, frame.lens, &mut self.segments);
        let parts = self.parts.of(&self.segments);
        let measured = parts.iter().filter_map(|part| measure(&mut self.meter, part, frame, factor, paint));
        pieces.extend(measured);
    }
}

/// Whether the sides that a ridge is brighter than show one paint. The corners of printed squares are ridges as well, they lie in rows,
/// and there are more of them than a short stripe has edgels.
fn is_on_plain_paint(edgel: &Edgel, factor: usize, paint: &dyn Paint) -> bool {
    let at = Vector2::new(f64::from(edgel.u), f64::from(edgel.v));
    let across = Vector2::new(f64::from(-edgel.along[1]), f64::from(edgel.along[0])) * MIDDLE_OF_SIDE_PX;
    paint.is_plain_between(&unbinned(at - across, factor), &unbinned(at + across, factor))
}

/// Measures a part of a segment in a picture that was made smaller by `factor`.
fn measure(
    meter: &mut StripeMeter,
    part: &LineSegment,
    frame: Frame<'_, u16>,
    factor: usize,
    paint: &dyn Paint,
) -> Option<StripePiece> {
    let half = 0.5 * TILE as f64;
    let span = [part.span()[0] - half, part.span()[1] + half];
    let (line, template) = meter.learn(&part.line, span, part.sigma_px, frame)?;
    let from = part.line.station(&line.point);
    let span = [span[0] - from, span[1] - from];
    let whole = meter.fit_with(&line, span, &template, frame)?;
    let count = ((span[1] - span[0]) / STRETCH_PX).ceil().max(1.0);
    let step = (span[1] - span[0]) / count;
    let mut piece = Measured {
        frame,
        factor,
        paint,
        reach_px: template.reach_px + BESIDE as f64 + 1.0,
        middles: Vec::new(),
        squares: 0.0,
    };
    for k in 0..count as usize {
        let stretch = [span[0] + step * k as f64, span[0] + step * (k + 1) as f64];
        if let Some(fit) = settled(meter, &line, stretch, &template, frame)
            && fit.amplitude > PRESENT * whole.amplitude
        {
            piece.add(meter, &fit);
        }
    }
    piece.concluded(&whole, &template)
}

/// The fit over a stretch from a line that already runs through it: shifts are small and are not cut short.
fn settled(
    meter: &mut StripeMeter,
    line: &Line2,
    span: [f64; 2],
    template: &Template,
    frame: Frame<'_, u16>,
) -> Option<Fit> {
    let mut fit = meter.fit_with(line, span, template, frame)?;
    let half = 0.5 * (span[1] - span[0]);
    for _ in 0..2 {
        let middle = fit.line.station(&line.at(0.5 * (span[0] + span[1])));
        fit = meter.fit_with(&fit.line, [middle - half, middle + half], template, frame)?;
    }
    Some(fit)
}

/// The collected middles of a piece.
struct Measured<'a> {
    frame: Frame<'a, u16>,
    factor: usize,
    paint: &'a dyn Paint,
    /// Range of the search for the stripe on each side of its middle, px of the smaller picture.
    reach_px: f64,
    middles: Vec<Vector2<f64>>,
    /// Sum of squared distances of the middles from the lines of their stretches, px² of the smaller picture.
    squares: f64,
}

impl Measured<'_> {
    fn add(&mut self, meter: &StripeMeter, fit: &Fit) {
        let across = fit.line.normal() * self.reach_px;
        for middle in meter.middles(fit) {
            let off_px = fit.line.distance(&middle.ideal);
            let pixel = |ideal: Vector2<f64>| unbinned(self.frame.lens.distorted(&ideal).0, self.factor);
            let is_plain =
                || self.paint.is_plain_between(&pixel(middle.ideal - across), &pixel(middle.ideal + across));
            if off_px.abs() <= OUTLIER_SIGMAS * middle.sigma_px && is_plain() {
                self.middles.push(pixel(middle.ideal));
                self.squares += off_px * off_px;
            }
        }
    }

    fn concluded(self, whole: &Fit, template: &Template) -> Option<StripePiece> {
        let (first, last) = (self.middles.first()?, self.middles.last()?);
        let scale = self.factor as f64;
        let sigma_px = (self.squares / self.middles.len() as f64).sqrt() * scale;
        let width_px = template.width_px() * scale;
        let length_px = (last - first).norm();
        // Smaller pictures of 16 bits hold means: levels are the picture's.
        let contrast = whole.amplitude;
        let factor = self.factor;
        Some(StripePiece { sigma_px, width_px, length_px, contrast, factor, pixels: self.middles })
    }
}

/// The pixel of the picture that one of the picture made smaller is.
fn unbinned(pixel: Vector2<f64>, factor: usize) -> Vector2<f64> {
    let k = factor as f64;
    (pixel * k).add_scalar(0.5 * (k - 1.0))
}
