//! What is measured of the seam: the point where the stripe meets it, or the stripes on both of its plates.

use crate::cell::Cell;
use crate::criterion::SensorCovariance;
use crate::evidence::{Evidence, FrameRows};
use crate::plate_rows::{self, PLATES_ALL, PLATES_FORM, ROWS};
use crate::prediction::Prediction;
use crate::seam_goal::SeamGoal;
use crate::sights::{NoiseLeft, Sights};
use crate::stripes_ahead::plates;
use crate::surroundings::Plate;
use crate::truth::Truth;
use crate::wrong_cells::SeenBy;
use nalgebra::{UnitVector3, Vector3};
use trueline_geometry::so3;
use trueline_method::Measurements;
use trueline_method::assess::tilt_bias::BIAS;
use trueline_method::problem::unknowns::{LOCAL_ALL, LOCAL_BOWED, LOCAL_STRAIGHT};

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// The seam's point in each frame.
    SeamPoint,
    /// The stripes on the two plates that meet in the seam.
    Plates([Plate; 2]),
}

/// What is measured in the frames of a scan.
#[derive(Clone, Debug)]
pub(crate) enum Measured {
    /// Seam points: two residuals each.
    SeamPoints(Evidence<2, LOCAL_ALL>),
    /// Stripes: two support points on each plate.
    Stripes(Evidence<ROWS, PLATES_ALL>),
}

/// Unknowns of a scan of seam points, with the bias of the feature.
const POINTS_AND_BIAS: usize = LOCAL_ALL + BIAS;
/// The same of stripes.
const STRIPES_AND_BIAS: usize = PLATES_ALL + BIAS;

impl Target {
    /// What a calibration will use; `None` where that is whole stripes and the cell does not name its plates.
    #[must_use]
    pub fn of(cell: &Cell, measurements: Measurements) -> Option<Self> {
        match measurements {
            Measurements::Seam => Some(Self::SeamPoint),
            Measurements::Auto | Measurements::Stripe | Measurements::Both => plates(cell).map(Self::Plates),
        }
    }

    /// Of the frames that a search asks what they tell, one of so many is enough: stripes cost more than a seam point, and what is
    /// clearly better is looked at in every frame anyway.
    pub(crate) fn rough_frames(&self) -> usize {
        match self {
            Self::SeamPoint => 1,
            Self::Plates(_) => 2,
        }
    }

    /// The normals of the plates; `None` where none are looked at.
    pub(crate) fn normals(&self) -> Option<[UnitVector3<f64>; 2]> {
        match self {
            Self::SeamPoint => None,
            Self::Plates(plates) => Some(plates.map(|plate| plate.normal)),
        }
    }

    /// What frames tell of which so many cells see something.
    pub(crate) fn measured(
        &self,
        cell: &Cell,
        truth: &Truth,
        sights: &Sights,
        seen_by: &[SeenBy],
    ) -> Measured {
        match self {
            Self::SeamPoint => Measured::SeamPoints(seam_points(cell, sights, seen_by)),
            Self::Plates(plates) => {
                let normals = plates.map(|plate| plate.normal);
                Measured::Stripes(plate_rows::stripes(cell, (truth, &normals), sights, seen_by))
            }
        }
    }
}

impl Measured {
    /// The covariance in a hurry; `None` if something is not shown at all.
    pub(crate) fn covariance(&self) -> Option<SensorCovariance> {
        match self {
            Self::SeamPoints(points) => points.covariance::<LOCAL_BOWED>(),
            Self::Stripes(stripes) => stripes.covariance::<PLATES_FORM>(),
        }
    }

    /// What the scan promises.
    pub(crate) fn prediction(&self) -> Option<Prediction> {
        self.prediction_until(usize::MAX)
    }

    /// What its first so many frames promise.
    pub(crate) fn prediction_until(&self, sights: usize) -> Option<Prediction> {
        match self {
            Self::SeamPoints(points) => points.prediction::<LOCAL_BOWED>(sights),
            Self::Stripes(stripes) => stripes.prediction::<PLATES_FORM>(sights),
        }
    }

    /// The seam error that is left of a goal's, m; `None` where something is not shown at all.
    pub(crate) fn seam_error_m(
        &self,
        goal: &SeamGoal,
        cell: &Cell,
        sights: &Sights,
        seen_by: &[SeenBy],
    ) -> Option<f64> {
        match self {
            Self::SeamPoints(points) => {
                goal.left_m::<2, LOCAL_ALL, POINTS_AND_BIAS>(cell, sights, points, None)
            }
            Self::Stripes(stripes) => {
                let points = seam_points(cell, sights, seen_by);
                let left = goal.bias_left::<2, LOCAL_ALL, POINTS_AND_BIAS>(sights, &points)?;
                goal.left_m::<ROWS, PLATES_ALL, STRIPES_AND_BIAS>(cell, sights, stripes, Some(left))
            }
        }
    }
}

/// Seam points; a frame in which no camera sees it tells nothing.
fn seam_points(cell: &Cell, sights: &Sights, seen_by: &[SeenBy]) -> Evidence<2, LOCAL_ALL> {
    let left = NoiseLeft::of(cell);
    let rows = sights.list.iter().zip(seen_by).enumerate().filter(|(_, (_, seen))| seen.seam > 0.0);
    let frames = rows.filter_map(|(k, (sight, seen))| {
        let (whitener, sheet_per_px) = sight.whitener(cell, &left)?;
        let by_shift = whitener * sight.onto_sheet();
        let arm: Vector3<f64> = sight.arm();
        Some(FrameRows {
            sight: k,
            share: seen.seam,
            columns: whitener * sight.columns(),
            by_px: whitener * sheet_per_px,
            by_turn: -(by_shift * so3::hat(&arm)),
            by_shift,
        })
    });
    Evidence {
        frames: frames.collect(),
        stride: sights.stride() as f64,
        asked: LOCAL_STRAIGHT,
        shape: LOCAL_BOWED,
        known_of_form: sights.bow_sigma_m().powi(-2),
    }
}
