//! The calibration target: a chessboard of known size.

use nalgebra::{Vector2, Vector3};

/// A chessboard by its inner corners, where four squares meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// Inner corners along the first direction.
    pub columns: usize,
    /// Inner corners along the second direction.
    pub rows: usize,
    /// Side of a square, m.
    pub square_m: f64,
}

impl Board {
    /// A corner in the board's own frame, m: x along the columns, y along the rows, z away from the viewer.
    #[must_use]
    pub fn corner(&self, column: usize, row: usize) -> Vector3<f64> {
        Vector3::new(column as f64 * self.square_m, row as f64 * self.square_m, 0.0)
    }

    /// The middle of the inner corners, m.
    #[must_use]
    pub fn middle(&self) -> Vector3<f64> {
        Vector3::new((self.columns - 1) as f64, (self.rows - 1) as f64, 0.0) * (0.5 * self.square_m)
    }

    /// Number of inner corners.
    #[must_use]
    pub fn corners(&self) -> usize {
        self.columns * self.rows
    }
}

/// A corner that was found in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundCorner {
    /// Its column on the board.
    pub column: usize,
    /// Its row on the board.
    pub row: usize,
    /// Its place in the picture, px.
    pub pixel: Vector2<f64>,
}

/// One picture of the board.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The corners that were found. With fewer than all of them the count of columns and rows begins at the first
    /// visible one. A plain board has no marks that would fix the count, and nothing here needs it.
    pub corners: Vec<FoundCorner>,
    /// Whether every corner of the board was found.
    pub complete: bool,
}
