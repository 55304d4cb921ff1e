//! The plane of the laser in the camera frame, with axes of its own.

use nalgebra::{Matrix3, Vector3};
use trueline_model::LaserSheet;

/// The sheet in the camera frame.
#[derive(Clone, Copy, Debug)]
pub struct SheetFrame {
    origin_m: Vector3<f64>,
    /// Columns e₁, e₂, n.
    axes: Matrix3<f64>,
}

impl SheetFrame {
    /// Of a sheet.
    #[must_use]
    pub fn of(sheet: &LaserSheet) -> Self {
        let axes = sheet.axes();
        let (e1, e2) = (axes.column(0).into_owned(), axes.column(1).into_owned());
        Self { origin_m: *sheet.origin(), axes: Matrix3::from_columns(&[e1, e2, e1.cross(&e2)]) }
    }

    /// A point of the camera frame in the sheet's axes: two coordinates and the distance, m.
    #[must_use]
    pub fn coordinates(&self, point_in_camera: &Vector3<f64>) -> Vector3<f64> {
        self.axes.transpose() * (point_in_camera - self.origin_m)
    }

    /// The sheet's axes in the camera frame: e₁, e₂, n.
    #[must_use]
    pub fn axes(&self) -> &Matrix3<f64> {
        &self.axes
    }

    /// Its origin in the camera frame, m.
    #[must_use]
    pub fn origin_m(&self) -> &Vector3<f64> {
        &self.origin_m
    }
}
