//! Draws the findings into the picture.

use crate::detector::Detector;
use crate::lens::Lens;
use crate::locate::line_segment::LineSegment;
use crate::region::PictureRegion;
use crate::seam::Seam;
use trueline_dataset::GrayImage;

const PIECE: [u8; 3] = [0, 160, 255];
const REGION: [u8; 3] = [120, 220, 120];
const SEAM: [u8; 3] = [255, 60, 30];
const ELLIPSE: [u8; 3] = [255, 220, 0];

/// A colour picture.
#[derive(Clone, Debug)]
pub struct Canvas {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Canvas {
    /// A picture to draw on; of 16 bits the brightest pixel is white.
    #[must_use]
    pub fn of_picture(image: &GrayImage) -> Self {
        Self::new(image.width, image.height, &image.levels_u8())
    }

    /// A picture with its region, its line segments and its seams, of the detector that just examined it.
    #[must_use]
    pub fn of_examined<'a>(
        image: &GrayImage,
        detector: &Detector,
        seams: impl Iterator<Item = &'a Seam>,
    ) -> Self {
        let mut canvas = Self::of_picture(image);
        if let Some(region) = detector.region() {
            canvas.region(region);
        }
        for segment in detector.segments() {
            canvas.segment(segment, detector.lens());
        }
        seams.for_each(|seam| canvas.seam(seam));
        canvas
    }

    /// The part of at most `size` (columns, rows) about a pixel.
    #[must_use]
    pub fn cut_out(&self, about_px: [f64; 2], size: [usize; 2]) -> Self {
        let [width, height] = [size[0].min(self.width), size[1].min(self.height)];
        let first = |at: f64, size: usize, length: usize| {
            (at.round().max(0.0) as usize).saturating_sub(size / 2).min(length - size)
        };
        let left = first(about_px[0], width, self.width);
        let top = first(about_px[1], height, self.height);
        let row = |v: usize| 3 * (v * self.width + left)..3 * (v * self.width + left + width);
        let rgb = (top..top + height).flat_map(|v| self.rgb[row(v)].iter().copied()).collect();
        Self { width, height, rgb }
    }

    /// Columns and rows, px.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// A gray picture to draw on, row by row; pixels that are missing are black.
    #[must_use]
    pub fn new(width: usize, height: usize, levels: &[u8]) -> Self {
        let mut rgb: Vec<u8> = levels.iter().flat_map(|level| [*level; 3]).collect();
        rgb.resize(3 * width * height, 0);
        Self { width, height, rgb }
    }

    /// Red, green and blue, pixel by pixel.
    #[must_use]
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// A segment: dots along its line, next to the stripe so that it stays visible.
    pub fn segment(&mut self, segment: &LineSegment, lens: &Lens) {
        let [from, to] = segment.span();
        let beside = segment.line.normal() * (3.0 * segment.sigma_px + 6.0);
        let steps = ((to - from) / 8.0).ceil() as usize;
        for k in 0..=steps {
            let at = segment.line.at(from + (to - from) * k as f64 / steps.max(1) as f64);
            for side in [-1.0, 1.0] {
                let pixel = lens.distorted(&(at + beside * side)).0;
                self.dot(pixel.x, pixel.y, PIECE);
            }
        }
    }

    /// The border of a region: dots.
    pub fn region(&mut self, region: &PictureRegion) {
        let corners = region.corners();
        for (k, from) in corners.iter().enumerate() {
            let to = corners[(k + 1) % corners.len()];
            let steps = ((to - from).norm() / 10.0).ceil().clamp(1.0, 1e4);
            for step in 0..steps as usize {
                let at = from.lerp(&to, step as f64 / steps);
                self.dot(at.x, at.y, REGION);
            }
        }
    }

    /// A seam: an open cross, and the ellipse of three standard deviations if it is large enough.
    pub fn seam(&mut self, seam: &Seam) {
        let (u, v) = (seam.pixel.x, seam.pixel.y);
        self.cross(u, v);
        let Some(root) = seam.covariance_px2.cholesky() else { return };
        for k in 0..180 {
            let angle = f64::from(k) * std::f64::consts::TAU / 180.0;
            let off = root.l() * nalgebra::Vector2::new(angle.cos(), angle.sin()) * 3.0;
            self.dot(u + off.x, v + off.y, ELLIPSE);
        }
    }

    /// An open cross about a pixel.
    pub fn cross(&mut self, u: f64, v: f64) {
        for k in 8..30 {
            let off = f64::from(k);
            for (x, y) in [(off, 0.0), (-off, 0.0), (0.0, off), (0.0, -off)] {
                self.dot(u + x, v + y, SEAM);
            }
        }
    }

    /// Two by two pixels, so that it is still there when the picture is shown at half its size.
    fn dot(&mut self, u: f64, v: f64, colour: [u8; 3]) {
        for (column, row) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let (column, row) = (u.round() + column, v.round() + row);
            if column >= 0.0 && row >= 0.0 && column < self.width as f64 && row < self.height as f64 {
                let at = 3 * (row as usize * self.width + column as usize);
                self.rgb[at..at + 3].copy_from_slice(&colour);
            }
        }
    }
}
