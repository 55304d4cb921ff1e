//! What the detector says of a picture.

use crate::lens::Lens;
use nalgebra::{Matrix2, Vector2};
use trueline_dataset::{Feature, FrameStamp, Measured};

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
}

impl Joint {
    /// All joints, in the order in which they are told apart: the special ones before the general ones.
    pub const ALL: [Self; 4] = [Self::VGroove, Self::Fillet, Self::Lap, Self::Butt];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Fillet => "fillet",
            Self::Lap => "lap",
            Self::VGroove => "v-groove",
            Self::Butt => "butt",
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
    /// Width of the gap, m, for a butt joint; else zero.
    pub gap_m: f64,
}

/// What is added to every covariance: light that wanders with the pixel grid and the lens, px. Clean pictures
/// of our simulator scatter by 0.003 px where noise alone would say 0.001.
const GRID_SIGMA_PX: f64 = 0.004;

impl Seam {
    /// From a point in the ideal picture and its covariance.
    ///
    /// # Errors
    /// [`NotFound::OutOfView`] for a point outside the picture, or whose ray misses the sheet.
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
        }
    }

    /// Standard deviations along u and v, px.
    #[must_use]
    pub fn sigma_px(&self) -> [f64; 2] {
        [self.covariance_px2.m11.sqrt(), self.covariance_px2.m22.sqrt()]
    }
}

/// Why there is no seam point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum NotFound {
    /// Nothing in the picture looks like a stripe.
    #[error("no laser stripe in the picture")]
    NoStripe,
    /// One straight stripe.
    #[error("a single straight piece of stripe: no joint")]
    OnePiece,
    /// Several segments, but not as this joint has them.
    #[error("the pieces of the stripe do not form this joint")]
    NotThisJoint,
    /// The stripe goes on where it should end.
    #[error("the stripe goes on beyond the place where its pieces cross")]
    GoesOn,
    /// The gap is not the one that the other pictures show.
    #[error("the gap is not as wide as in most other pictures")]
    OddGap,
    /// The point is not where the pictures before and after have the seam.
    #[error("the point is far from where the pictures before and after have the seam")]
    Jumps,
    /// Two places are as likely.
    #[error("two places are about as likely")]
    Ambiguous,
    /// Too little of the stripe is to be seen.
    #[error("too little of the stripe is visible beside the seam")]
    TooLittle,
    /// The point would not be known well enough to be of use.
    #[error("the seam point cannot be told to within 5 px")]
    Uncertain,
    /// The segments meet outside the picture.
    #[error("the seam is out of view")]
    OutOfView,
}

impl NotFound {
    /// A stable word for programs.
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoStripe => "no-stripe",
            Self::OnePiece => "single-segment",
            Self::NotThisJoint => "not-this-joint",
            Self::GoesOn => "stripe-continues",
            Self::OddGap => "odd-gap",
            Self::Jumps => "far-from-neighbours",
            Self::Ambiguous => "ambiguous",
            Self::TooLittle => "too-little-stripe",
            Self::Uncertain => "uncertain",
            Self::OutOfView => "out-of-view",
        }
    }
}

/// A seam point must be known to this, px.
const MOST_SIGMA_PX: f64 = 5.0;

/// Whether a covariance (px²) is one of a point that is of use; what is not a number is not.
#[must_use]
pub fn known_well(covariance_px2: &Matrix2<f64>) -> bool {
    covariance_px2.trace() <= MOST_SIGMA_PX.powi(2)
}

/// How long segments of stripe must be to be believed, px: a spark drawn out by its flight is straight as well.
/// Both grow with the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lengths {
    /// The shorter of two segments.
    pub shorter_px: f64,
    /// The longer.
    pub longer_px: f64,
}

impl Lengths {
    /// For a camera's pictures: 3 % and 8 % of the diagonal, and no less than four and six tiles.
    #[must_use]
    pub fn of(lens: &Lens) -> Self {
        let [width, height] = lens.camera().size.map(f64::from);
        let diagonal = width.hypot(height);
        Self { shorter_px: (0.03 * diagonal).max(64.0), longer_px: (0.08 * diagonal).max(96.0) }
    }

    /// Whether two lengths are enough.
    #[must_use]
    pub fn suffice(&self, lengths_px: [f64; 2]) -> bool {
        let [a, b] = lengths_px;
        a.min(b) >= self.shorter_px && a.max(b) >= self.longer_px
    }
}
