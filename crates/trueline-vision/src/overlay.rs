//! What was found, drawn into the picture.

use crate::lens::Lens;
use crate::locate::line_segment::LineSegment;
use crate::region::PictureRegion;
use crate::seam::Seam;

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

    /// A segment: dots along its line, beside the stripe so that it stays visible.
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

    /// A seam: an open cross, and the ellipse of three standard deviations where it is large enough to see.
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
