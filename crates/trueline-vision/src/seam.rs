//! Result of the detector for a picture.

use crate::lens::Lens;
use crate::not_found::NotFound;
use nalgebra::{Matrix2, Vector2};
use trueline_dataset::{Feature, FrameStamp, Measured, correlation_of};

/// Which joint the laser shines on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Joint {
    /// Two plates at an angle; the seam is where their surfaces meet.
    Fillet,
    /// A plate on a plate; the seam is the edge of the upper one.
    Lap,
    /// Two bevelled plates; the seam is the bottom of the groove.
    VGroove,
    /// Two plates side by side; the seam is the middle of the gap.
    Butt,
    /// The outside corner of a block; the seam is where its faces meet.
    Corner,
    /// A plate over nothing that the laser reaches; the seam is where the stripe ends.
    Edge,
    /// A step with a lit riser. Two lines: 0 where the upper surface meets the riser, 1 where the lower one does.
    Step,
    /// A groove with lit faces and any root. Two lines, its shoulders: 0 is the left one in the picture.
    Groove,
    /// A V-block, or a machined V with a relief slot: the line in which its faces would meet.
    VBlock,
}

impl Joint {
    /// All joints, in the order in which they are tested: the special ones before the general ones.
    pub const ALL: [Self; 9] = [
        Self::Step,
        Self::VGroove,
        Self::Groove,
        Self::Fillet,
        Self::VBlock,
        Self::Lap,
        Self::Corner,
        Self::Butt,
        Self::Edge,
    ];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Fillet => "fillet",
            Self::Lap => "lap",
            Self::VGroove => "v-groove",
            Self::Butt => "butt",
            Self::Corner => "corner",
            Self::Edge => "edge",
            Self::Step => "step",
            Self::Groove => "groove",
            Self::VBlock => "v-block",
        }
    }
}

/// A seam point in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// Distorted pixel; (0, 0) is the centre of the top-left one.
    pub pixel: Vector2<f64>,
    /// Covariance of the pixel, px².
    pub covariance_px2: Matrix2<f64>,
    /// Point of the laser sheet, m, in coordinates of [`trueline_model::LaserSheet`].
    pub on_sheet_m: Vector2<f64>,
    /// Covariance of the point, m².
    pub covariance_m2: Matrix2<f64>,
    /// How good the stripe was, 0 to 1: the part of the sections on its weaker segment that show it.
    pub quality: f64,
    /// Width of the gap, m: of a butt joint, and, to a tile or so, of an object that hides the crossing of two faces; else
    /// zero.
    pub gap_m: f64,
}

/// Added to every covariance: light that moves with the pixel grid and the lens, px. Clean pictures of our simulator scatter
/// by 0.003 px, noise alone would give 0.001.
pub(crate) const GRID_SIGMA_PX: f64 = 0.004;

impl Seam {
    /// From a point in the ideal picture and its covariance.
    ///
    /// # Errors
    /// [`NotFound::OutOfView`] for a point outside the picture, or with a ray that misses the sheet.
    pub fn from_ideal(
        lens: &Lens,
        ideal: &Vector2<f64>,
        covariance_px2: &Matrix2<f64>,
        quality: f64,
    ) -> Result<Self, NotFound> {
        let (pixel, d_pixel) = lens.distorted(ideal);
        let [width, height] = lens.camera().size.map(f64::from);
        let inside = pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x <= width - 1.0 && pixel.y <= height - 1.0;
        let (on_sheet_m, d_sheet) = lens.on_sheet(ideal).filter(|_| inside).ok_or(NotFound::OutOfView)?;
        let covariance = covariance_px2 + Matrix2::identity() * GRID_SIGMA_PX.powi(2);
        Ok(Self {
            pixel,
            covariance_px2: d_pixel * covariance * d_pixel.transpose(),
            on_sheet_m,
            covariance_m2: d_sheet * covariance * d_sheet.transpose(),
            quality,
            gap_m: 0.0,
        })
    }

    /// The feature that a calibration takes in.
    #[must_use]
    pub fn feature(&self, stamp: &FrameStamp) -> Feature {
        Feature {
            stamp_ns: stamp.stamp_ns,
            line: 0,
            frame: Some(stamp.frame),
            device_ns: stamp.device_ns,
            measured: Measured::Pixel(self.pixel.into()),
            sigma: Some(self.sigma_px()),
            correlation: correlation_of(&self.covariance_px2),
        }
    }

    /// The same seam, found in a picture with pixels of `factor` × `factor` of this lens's.
    pub(crate) fn unbinned(self, factor: usize) -> Self {
        let k = factor as f64;
        let pixel = (self.pixel * k).add_scalar(0.5 * (k - 1.0));
        Self { pixel, covariance_px2: self.covariance_px2 * (k * k), ..self }
    }

    /// Standard deviations along u and v, px.
    #[must_use]
    pub fn sigma_px(&self) -> [f64; 2] {
        [self.covariance_px2.m11.sqrt(), self.covariance_px2.m22.sqrt()]
    }
}

/// Largest uncertainty of a seam point, px.
const MOST_SIGMA_PX: f64 = 5.0;

/// Checks that the covariance (px²) of a point is small enough.
///
/// # Errors
/// [`NotFound::Uncertain`] if it is too large or NaN.
pub fn judged(covariance_px2: &Matrix2<f64>) -> Result<(), NotFound> {
    let variance = covariance_px2.trace();
    if variance <= MOST_SIGMA_PX.powi(2) {
        return Ok(());
    }
    Err(NotFound::Uncertain { sigma_px: variance.sqrt(), most_px: MOST_SIGMA_PX })
}
