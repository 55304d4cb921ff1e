//! Target of the measurement: the meeting point of stripe and seam, or the stripes on its plates.

use crate::cell::Cell;
use crate::criterion::SensorCovariance;
use crate::evidence::{Evidence, FrameRows};
use crate::joint::{Joint, NoJoint};
use crate::plate_rows::{self, EDGED_ALL, EDGED_FORM, EDGED_ROWS, MEETING_ALL, MEETING_FORM, MEETING_ROWS};
use crate::predicted_frames::{NoiseLeft, PredictedFrame, PredictedFrames};
use crate::prediction::Prediction;
use crate::robustness_to_guess::SeenBy;
use crate::seam_goal::SeamGoal;
use crate::truth::Truth;
use nalgebra::{DMatrix, Matrix2, Matrix2xX, Matrix3x2, UnitVector3, Vector3};
use trueline_method::Measurements;
use trueline_method::assess::tilt_bias::BIAS;
use trueline_method::problem::unknowns::{LINES, LOCAL_ALL, LOCAL_BOWED, LOCAL_STRAIGHT};

/// Kind of measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// The seam's point in each frame.
    SeamPoint,
    /// The stripes on the plates of the joint; where these do not meet, the point of the edge as well.
    Stripes(Joint),
}

/// Measurements in the frames of a scan.
#[derive(Clone, Debug)]
pub(crate) enum Measured {
    /// Seam points: two residuals each.
    SeamPoints(Evidence<2, LOCAL_ALL>),
    /// Stripes on plates that meet: two support points on each.
    Meeting(Evidence<MEETING_ROWS, MEETING_ALL>),
    /// Stripes on plates that do not, and the edge point.
    Edged(Evidence<EDGED_ROWS, EDGED_ALL>),
}

/// Unknowns of a scan of seam points, with the bias of the feature.
const POINTS_AND_BIAS: usize = LOCAL_ALL + BIAS;
/// The same of stripes on plates that meet.
const MEETING_AND_BIAS: usize = MEETING_ALL + BIAS;
/// The same of stripes and an edge.
const EDGED_AND_BIAS: usize = EDGED_ALL + BIAS;

impl Target {
    /// Measurements of a calibration.
    ///
    /// # Errors
    /// [`NoJoint`] for whole stripes if the cell's plates make no joint.
    pub fn of(cell: &Cell, measurements: Measurements) -> Result<Self, NoJoint> {
        match measurements {
            Measurements::Seam => Ok(Self::SeamPoint),
            Measurements::Auto | Measurements::Stripe | Measurements::Both => {
                Joint::of(cell).map(Self::Stripes)
            }
        }
    }

    /// In a search, one of this many frames is enough: stripes cost more than a seam point, and clearly better paths are
    /// checked in every frame anyway.
    pub(crate) fn rough_frames(&self) -> usize {
        match self {
            Self::SeamPoint => 1,
            Self::Stripes(_) => 2,
        }
    }

    /// The joint of the used plates; `None` if none are used.
    pub(crate) fn joint(&self) -> Option<&Joint> {
        match self {
            Self::SeamPoint => None,
            Self::Stripes(joint) => Some(joint),
        }
    }

    /// Information of frames, of which this many cells see something.
    pub(crate) fn measured(
        &self,
        cell: &Cell,
        truth: &Truth,
        sights: &PredictedFrames,
        seen_by: &[SeenBy],
    ) -> Measured {
        match self {
            Self::SeamPoint => Measured::SeamPoints(seam_points(cell, sights, seen_by)),
            Self::Stripes(joint) if joint.edge_on.is_some() => {
                Measured::Edged(plate_rows::stripes(cell, (truth, joint), sights, seen_by))
            }
            Self::Stripes(joint) => {
                Measured::Meeting(plate_rows::stripes(cell, (truth, joint), sights, seen_by))
            }
        }
    }
}

impl Measured {
    /// A fast covariance, of time offset and hand-eye and of the external axes; `None` if something is not determined at all.
    pub(crate) fn covariance(&self) -> Option<(SensorCovariance, DMatrix<f64>)> {
        match self {
            Self::SeamPoints(points) => points.covariance::<LOCAL_BOWED>(),
            Self::Meeting(stripes) => stripes.covariance::<MEETING_FORM>(),
            Self::Edged(stripes) => stripes.covariance::<EDGED_FORM>(),
        }
    }

    /// Prediction for the scan.
    pub(crate) fn prediction(&self) -> Option<Prediction> {
        self.prediction_until(usize::MAX)
    }

    /// Prediction for its first `sights` frames.
    pub(crate) fn prediction_until(&self, sights: usize) -> Option<Prediction> {
        match self {
            Self::SeamPoints(points) => points.prediction::<LOCAL_BOWED>(sights),
            Self::Meeting(stripes) => stripes.prediction::<MEETING_FORM>(sights),
            Self::Edged(stripes) => stripes.prediction::<EDGED_FORM>(sights),
        }
    }

    /// The remaining seam error of a goal, m; `None` if something is not determined at all.
    pub(crate) fn seam_error_m(&self, goal: &SeamGoal, cell: &Cell, sights: &PredictedFrames) -> Option<f64> {
        // The edge of a stripe is where two fitted lines cross, whatever its radius is.
        let sharp = SeamGoal { edge_radius_m: 0.0, ..goal.clone() };
        match self {
            Self::SeamPoints(points) => goal.left_m::<2, LOCAL_ALL, POINTS_AND_BIAS>(cell, sights, points),
            Self::Meeting(stripes) => {
                sharp.left_m::<MEETING_ROWS, MEETING_ALL, MEETING_AND_BIAS>(cell, sights, stripes)
            }
            Self::Edged(stripes) => {
                sharp.left_m::<EDGED_ROWS, EDGED_ALL, EDGED_AND_BIAS>(cell, sights, stripes)
            }
        }
    }
}

/// Seam points; a frame without a visible seam has no information.
fn seam_points(cell: &Cell, sights: &PredictedFrames, seen_by: &[SeenBy]) -> Evidence<2, LOCAL_ALL> {
    let left = NoiseLeft::of(cell);
    let rows = sights.list.iter().zip(seen_by).enumerate().filter(|(_, (_, seen))| seen.seam > 0.0);
    let frames = rows.filter_map(|(k, (sight, seen))| {
        let (whitener, sheet_per_px) = sight.whitener(cell, &left)?;
        Some(FrameRows {
            sight: k,
            share: seen.seam,
            columns: whitener * sight.columns(),
            by_px: whitener * sheet_per_px,
            by_shift: whitener * sight.onto_sheet(),
            by_turn: whitener * sight.by_turn(),
            by_axes: by_axes(&whitener, sight, sights),
            piece: None,
        })
    });
    let mut frames: Vec<FrameRows<2, LOCAL_ALL>> = frames.collect();
    let held = match (&cell.course, cell.seam.direction()) {
        (Some(_), Some(along)) => {
            frames.iter_mut().for_each(|frame| of_a_bent_seam(frame, sights, &along));
            (LINES..LOCAL_STRAIGHT).collect()
        }
        _ => Vec::new(),
    };
    Evidence {
        frames,
        stride: sights.stride() as f64,
        asked: LOCAL_STRAIGHT,
        shape: LOCAL_BOWED,
        known_of_form: sights.bow_sigma_m().powi(-2),
        held,
        axis_sigmas: sights.axis_sigmas().to_vec(),
    }
}

/// Whitened derivatives by the numbers of the external axes, in units of their priors.
fn by_axes(whitener: &Matrix2<f64>, sight: &PredictedFrame, sights: &PredictedFrames) -> Matrix2xX<f64> {
    let mut by = whitener * sight.by_axes();
    for (mut column, sigma) in by.column_iter_mut().zip(sights.axis_sigmas()) {
        column *= *sigma;
    }
    by
}

/// A curved seam of unknown form: each piece has its own place instead of line and bow.
fn of_a_bent_seam(frame: &mut FrameRows<2, LOCAL_ALL>, sights: &PredictedFrames, along: &UnitVector3<f64>) {
    /// Length of a piece, m. It lies between the knot spacing of the estimator's answer, 5 mm, and that of a curve with 10 mm and
    /// no prior, which has nearly its ±. Three passes over a ring and a corner state 1.0 to 1.3 times the planned ±.
    const PIECE_M: f64 = 7e-3;
    /// Index of the middle piece. No seam has more pieces on either side.
    const MOST: f64 = 1e6;
    frame.columns.fixed_columns_mut::<{ LOCAL_BOWED - LINES }>(LINES).fill(0.0);
    let least = along.iamin();
    let axis = Vector3::from_fn(|k, _| if k == least { 1.0 } else { 0.0 });
    let first = (axis - along.into_inner() * along.dot(&axis)).normalize();
    let across = Matrix3x2::from_columns(&[first, along.cross(&first)]);
    let piece = ((sights.list[frame.sight].along_m / PIECE_M).floor() + MOST).max(0.0) as usize;
    frame.piece = Some((piece, frame.by_shift * across));
}
