//! What the answer owes to errors that it does not estimate, as columns beside the unknowns.

use crate::assess::robot_field::RobotSigmas;
use crate::assess::seam_error::{Share, ShareOf};
use crate::curve::arrow::{ArrowRoot, SHARED};
use crate::curve::fit::Fitted;
use crate::curve::moved::Moves;
use crate::curve::readings::Readings;
use crate::curve::robot;
use crate::input::shape_knowledge::ShapeCovariance;
use nalgebra::{DMatrix, Matrix2xX, SMatrix, Vector2};
use trueline_model::SheetShape;

/// The errors that are considered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Errors {
    /// How far the robot is off.
    pub robot: RobotSigmas,
    /// The shape of the sensor; `None` of an exact one.
    pub shape: Option<ShapeError>,
}

/// How well the shape of a sensor is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShapeError {
    /// Covariance of its five numbers.
    pub covariance: ShapeCovariance,
    /// The point of the sheet about which they are counted, m.
    pub origin_m: Vector2<f64>,
}

/// One of them at a fit.
pub(crate) struct Considered {
    of: ShareOf,
    /// How it moves the readings.
    pub moves: Moves,
    shape: Option<DMatrix<f64>>,
}

impl Considered {
    /// What it makes of all unknowns.
    #[must_use]
    pub(crate) fn share(&self, fitted: &Fitted, root: &ArrowRoot) -> Share {
        Share { of: self.of, columns: self.moves.columns(fitted, root), shape: self.shape.clone() }
    }
}

impl Errors {
    /// Noise alone.
    #[cfg(test)]
    pub(crate) const NONE: Self =
        Self { robot: RobotSigmas { position_m: 0.0, attitude_rad: 0.0 }, shape: None };

    /// All of them at a fit.
    #[must_use]
    pub(crate) fn at(&self, readings: &Readings, fitted: &Fitted) -> Vec<Considered> {
        let moves = robot::moves(readings, fitted, self.robot);
        let robot = Considered { of: ShareOf::Robot, moves, shape: None };
        let shape = self.shape.as_ref().and_then(|shape| shape.at(readings));
        std::iter::once(robot).chain(shape).collect()
    }
}

impl ShapeError {
    /// `None` where the covariance has no root.
    fn at(&self, readings: &Readings) -> Option<Considered> {
        let half: SMatrix<f64, 5, 5> = self.covariance.cholesky()?.l();
        let exact = SheetShape::exact_about(&self.origin_m);
        let by_reading = |(k, reading): (usize, &crate::curve::readings::Reading)| {
            let by = exact.d_corrected_d_shape(&reading.in_sheet)? * half;
            Some((k, Matrix2xX::from_column_slice(by.as_slice())))
        };
        let list = readings.list.iter().enumerate().filter_map(by_reading).collect();
        Some(Considered {
            of: ShareOf::Sensor,
            moves: Moves { errors: half.ncols(), readings: list },
            shape: Some(DMatrix::from_column_slice(5, 5, half.as_slice())),
        })
    }
}

/// The part of a share in the clock and the hand-eye transform.
#[must_use]
pub(crate) fn of_shared(share: &Share) -> Share {
    let shared = share.columns.nrows() - SHARED;
    Share { columns: share.columns.rows(shared, SHARED).into_owned(), ..share.clone() }
}
