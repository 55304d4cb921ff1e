//! The shape of a printed board: how its sheet bends, and how the printer stretched it.
//!
//! A sheet of paper on a table is bent by a fraction of a millimetre, in the same way in all pictures of it. Left out, that
//! bend is explained by the camera: on real pictures the focal length moved by 3 %, at an uncertainty of 0.4 %. A quadratic
//! surface is enough there. It continues beyond the squares, where the stripe may lie. It looks the same whichever corner
//! the board is counted from: another origin adds a tilt and an offset, which are the pose's.
//!
//! With ξ and η from the middle of the corners, in half diagonals h: z = h (q₁ ξ² + q₂ ξη + q₃ η²), x grows by the part q₄ and y shrinks
//! by it, and x grows by q₅ of y.

use crate::board::Board;
use nalgebra::{SMatrix, SVector, Vector2, Vector3};

/// Numbers of a sheet's shape.
pub const SHEET_SIZE: usize = 5;

/// Prior standard deviations of sheets: their bend as a part of the half diagonal, and the stretch of printers. 0.05 lifts
/// the corner of a sheet of 300 mm by 7 mm.
const USUAL: [f64; SHEET_SIZE] = [0.05, 0.05, 0.05, 2e-3, 2e-3];

/// A sheet's shape; zero is flat, and printed true.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SheetShape(SVector<f64, SHEET_SIZE>);

/// The surface at one place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    /// Height above the board's plane, m; positive away from the camera.
    pub height_m: f64,
    /// d height / d (x, y) on the board.
    pub slope: Vector2<f64>,
    /// d height / d shape, m.
    pub d_shape: SMatrix<f64, 1, SHEET_SIZE>,
}

impl SheetShape {
    /// Whether a board determines its shape. One with as many columns as rows may be counted from either side in each
    /// picture.
    #[must_use]
    pub fn is_seen_on(board: &Board) -> bool {
        board.columns != board.rows
    }

    /// A shape of five numbers.
    #[must_use]
    pub fn new(numbers: [f64; SHEET_SIZE]) -> Self {
        Self(numbers.into())
    }

    /// The five numbers.
    #[must_use]
    pub fn numbers(&self) -> [f64; SHEET_SIZE] {
        self.0.into()
    }

    /// How far the sheet rises from its middle to its corners, m: the largest, with its sign.
    #[must_use]
    pub fn rise_m(&self, board: &Board) -> f64 {
        let half = board.middle();
        let at =
            |sign: f64| self.surface(board, &Vector2::new(half.x + sign * half.x, 2.0 * half.y)).height_m;
        let (one, other) = (at(1.0), at(-1.0));
        if one.abs() > other.abs() { one } else { other }
    }

    pub(crate) fn moved(&self, step: &SVector<f64, SHEET_SIZE>) -> Self {
        Self(self.0 + step)
    }

    /// Information and pull of the prior, and its cost.
    pub(crate) fn prior(&self) -> (SVector<f64, SHEET_SIZE>, SVector<f64, SHEET_SIZE>, f64) {
        let information = SVector::<f64, SHEET_SIZE>::from_fn(|k, _| 1.0 / (USUAL[k] * USUAL[k]));
        let pull = information.component_mul(&self.0);
        (information, pull, 0.5 * self.0.dot(&pull))
    }

    /// The surface at a place in the board's own frame, m.
    pub(crate) fn surface(&self, board: &Board, place: &Vector2<f64>) -> Surface {
        let middle = board.middle().xy();
        let half_m = middle.norm();
        let at = (place - middle) / half_m;
        let [xx, xy, yy, ..] = self.numbers();
        let d_shape = SMatrix::<f64, 1, SHEET_SIZE>::from_row_slice(&[
            half_m * at.x * at.x,
            half_m * at.x * at.y,
            half_m * at.y * at.y,
            0.0,
            0.0,
        ]);
        Surface {
            height_m: d_shape[0] * xx + d_shape[1] * xy + d_shape[2] * yy,
            slope: Vector2::new(2.0 * xx * at.x + xy * at.y, xy * at.x + 2.0 * yy * at.y),
            d_shape,
        }
    }

    /// A corner of the board where its sheet has it, in the board's own frame, m; and d point / d shape.
    pub(crate) fn corner(
        &self,
        board: &Board,
        column: usize,
        row: usize,
    ) -> (Vector3<f64>, SMatrix<f64, 3, SHEET_SIZE>) {
        let nominal = board.corner(column, row);
        let surface = self.surface(board, &nominal.xy());
        let from_middle = nominal - board.middle();
        let [.., stretch, shear] = self.numbers();
        let point = Vector3::new(
            nominal.x + stretch * from_middle.x + shear * from_middle.y,
            nominal.y - stretch * from_middle.y,
            surface.height_m,
        );
        let mut d_shape = SMatrix::<f64, 3, SHEET_SIZE>::zeros();
        d_shape.fixed_rows_mut::<1>(2).copy_from(&surface.d_shape);
        d_shape[(0, 3)] = from_middle.x;
        d_shape[(1, 3)] = -from_middle.y;
        d_shape[(0, 4)] = from_middle.y;
        (point, d_shape)
    }
}
