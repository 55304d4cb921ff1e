//! Errors that are not estimated (consider parameters), as columns beside the unknowns.

use crate::assess::robot_field::RobotSigmas;
use crate::assess::share::{Share, ShareOf};
use crate::assess::tilt_bias::{BIAS, TiltBias};
use crate::config::PartMoves;
use crate::curve::arrow::{ArrowRoot, SHARED};
use crate::curve::fit::Fitted;
use crate::curve::moved::Moves;
use crate::curve::readings::{Reading, Readings};
use crate::curve::robot;
use crate::curve::rows::Moved;
use crate::curve::sight::{ByForm, moving};
use crate::input::observations::Observations;
use crate::input::shape_knowledge::ShapeCovariance;
use crate::problem::parameters::Parameters;
use crate::problem::placement::placement;
use nalgebra::{DMatrix, Matrix2xX, SMatrix, Vector2};
use trueline_geometry::Pose;
use trueline_model::{Placement, SheetShape};

/// Errors that are considered.
#[derive(Clone, Copy)]
pub(crate) struct Errors<'a> {
    /// Errors of the robot.
    pub robot: RobotSigmas,
    /// Error of the sensor's shape; `None` if it is exact.
    pub shape: Option<ShapeError>,
    /// Radius of the edge.
    pub edge: EdgeError,
    /// A part that moves between passes; `None` if it lies still.
    pub part: Option<PartMoves>,
    /// Bias of the detector; `None` if it has none.
    pub detector: Option<DetectorError<'a>>,
}

/// Radius of an edge whose outermost point the detector finds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeError {
    /// The radius, m.
    pub radius_m: f64,
    /// Whether the edge is seen from the camera's origin; if not, along the range of a profiler.
    pub from_origin: bool,
}

/// A detector whose point moves with the tilt.
#[derive(Clone, Copy)]
pub(crate) struct DetectorError<'a> {
    /// Its shift for 10° of tilt, px.
    pub px: f64,
    /// The detections, one for each reading.
    pub observations: &'a Observations,
}

/// Uncertainty of a sensor's shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShapeError {
    /// Covariance of the five numbers.
    pub covariance: ShapeCovariance,
    /// Origin of the five numbers in the sheet, m.
    pub origin_m: Vector2<f64>,
    /// Whether the scan may estimate it.
    pub is_estimated: bool,
}

/// One considered error at a fit.
pub(crate) struct Considered {
    /// Kind of error.
    pub of: ShareOf,
    /// Displacement of the readings.
    pub moves: Moves,
    /// Error of the sensor's shape for each column (5 × columns), for that kind.
    pub shape: Option<DMatrix<f64>>,
    /// Whether the scan may improve what is known of it.
    pub is_estimated: bool,
}

impl Considered {
    /// Its contribution to all unknowns.
    #[must_use]
    pub(crate) fn share(&self, fitted: &Fitted, root: &ArrowRoot) -> Share {
        Share { of: self.of, columns: self.moves.columns(fitted, root), shape: self.shape.clone() }
    }
}

impl Errors<'_> {
    /// Noise alone.
    #[cfg(test)]
    pub(crate) const NONE: Self = Self {
        robot: RobotSigmas { position_m: 0.0, attitude_rad: 0.0 },
        shape: None,
        part: None,
        edge: EdgeError { radius_m: 0.0, from_origin: false },
        detector: None,
    };

    /// All considered errors at a fit.
    #[must_use]
    pub(crate) fn at(&self, readings: &Readings, fitted: &Fitted) -> Vec<Considered> {
        let moves = robot::moves(readings, fitted, self.robot, robot::MOST_READINGS);
        let robot = Considered { of: ShareOf::Robot, moves, shape: None, is_estimated: false };
        let shape = self.shape.as_ref().and_then(|shape| shape.at(readings, fitted));
        let part = self.part.and_then(|part| part.at(fitted));
        let edge = (self.edge.radius_m > 0.0).then(|| self.edge.at(readings, fitted));
        let detector = self.detector.as_ref().map(|detector| detector.at(fitted));
        // Those that may be improved are neighbours.
        std::iter::once(robot).chain(shape).chain(part).chain(edge).chain(detector).collect()
    }
}

impl EdgeError {
    /// The detected point is nearer to the sensor by the radius, perpendicular to the curve. The plates beside the edge do not move.
    fn at(&self, readings: &Readings, fitted: &Fitted) -> Considered {
        let at = &fitted.state.at;
        let camera = at.tool_from_camera.rotation.to_rotation_matrix().into_inner();
        let by_reading = |(k, reading): (usize, &Reading)| {
            let seen = fitted.sights[k].as_ref().filter(|seen| seen.of_point().is_some())?;
            let range = readings.sheet.axes().column(1).into_owned();
            let view = if self.from_origin { -reading.point } else { range };
            let towards = moving(readings, reading, at)?.attitude * camera * view;
            let square = (towards - seen.tangent * seen.tangent.dot(&towards)).try_normalize(0.0)?;
            Some((k, Moved::from_column_slice((seen.by_shift * square * self.radius_m).as_slice())))
        };
        let list = readings.list.iter().enumerate().filter_map(by_reading).collect();
        Considered {
            of: ShareOf::EdgeRadius,
            moves: Moves { errors: 1, readings: list, every: 1 },
            shape: None,
            is_estimated: false,
        }
    }
}

impl DetectorError<'_> {
    fn at(&self, fitted: &Fitted) -> Considered {
        let at = Parameters::straight(&fitted.state.at, Vec::new());
        let places = self.observations.list.iter().map(|o| placement(self.observations, o, &at));
        let places: Vec<Option<Placement>> = places.collect();
        let poses: Vec<Pose> = places.iter().flatten().map(|place| place.base_from_tool).collect();
        let tilt = TiltBias::about(&poses);
        let by_reading = |(k, place): (usize, &Option<Placement>)| {
            let by = tilt.slopes(&self.observations.list[k], &at, place.as_ref()?) * self.px;
            // The whole picture is shifted, so every stripe is.
            Some((
                k,
                match &fitted.sights[k].as_ref()?.by_form {
                    ByForm::Point(_) => of_point(by.as_slice()),
                    ByForm::Feet(feet) => {
                        Moved::from_fn(BIAS, |row, error| feet[row].normal.dot(&by.column(error)))
                    }
                },
            ))
        };
        let list = places.iter().enumerate().filter_map(by_reading).collect();
        Considered {
            of: ShareOf::Detector,
            moves: Moves { errors: BIAS, readings: list, every: 1 },
            shape: None,
            is_estimated: false,
        }
    }
}

impl ShapeError {
    /// `None` if the covariance has no root.
    fn at(&self, readings: &Readings, fitted: &Fitted) -> Option<Considered> {
        let half: SMatrix<f64, 5, 5> = self.covariance.cholesky()?.l();
        let exact = SheetShape::exact_about(&self.origin_m);
        let by_reading = |(k, reading): (usize, &Reading)| {
            let moved = |in_sheet: &Vector2<f64>| Some(exact.d_corrected_d_shape(in_sheet)? * half);
            match (&fitted.sights[k].as_ref()?.by_form, reading.supports()) {
                (ByForm::Feet(feet), Some(supports)) => {
                    let mut by = Moved::zeros(half.ncols());
                    for (row, (foot, support)) in feet.iter().zip(supports).enumerate() {
                        by.set_row(row, &foot.normal.tr_mul(&moved(&support.in_sheet)?));
                    }
                    Some((k, by))
                }
                _ => Some((k, of_point(moved(&reading.in_sheet)?.as_slice()))),
            }
        };
        let list = readings.list.iter().enumerate().filter_map(by_reading).collect();
        Some(Considered {
            of: ShareOf::Sensor,
            moves: Moves { errors: half.ncols(), readings: list, every: 1 },
            shape: Some(DMatrix::from_column_slice(5, 5, half.as_slice())),
            is_estimated: self.is_estimated,
        })
    }
}

/// Displacements of a seam point in the sheet, two numbers for each error.
fn of_point(columns: &[f64]) -> Moved {
    let in_sheet = Matrix2xX::from_column_slice(columns);
    Moved::from_fn(in_sheet.ncols(), |row, error| if row < 2 { in_sheet[(row, error)] } else { 0.0 })
}

/// Clock and hand-eye rows of a contribution.
#[must_use]
pub(crate) fn of_shared(share: &Share) -> Share {
    let shared = share.columns.nrows() - SHARED;
    Share { columns: share.columns.rows(shared, SHARED).into_owned(), ..share.clone() }
}
