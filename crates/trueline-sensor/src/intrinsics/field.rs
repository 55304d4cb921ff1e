//! Uncertainty of a camera over the picture, and the difference of two cameras there.
//!
//! A small rotation of the camera with a matching shift of its principal point changes no pixel. So the measure is the
//! change of pixels that no rotation compensates. So the best rotation is first removed from the change over the whole
//! picture (mrcal's implied rotation). The rest is the uncertainty of a direction measured with the camera.

use crate::projection::{CAMERA_SIZE, CameraVector, project};
use nalgebra::{DMatrix, DVector, Matrix2x3, SMatrix, Vector2};
use trueline_geometry::so3;
use trueline_model::Camera;

/// Columns and rows of the grid over the picture.
pub const GRID: [usize; 2] = [16, 12];

/// A property over the picture, row by row of the grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// The places, px.
    pub pixels: Vec<Vector2<f64>>,
    /// The values, px.
    pub values_px: Vec<f64>,
}

impl Field {
    /// Root mean square over the picture, px.
    #[must_use]
    pub fn rms_px(&self) -> f64 {
        (self.values_px.iter().map(|v| v * v).sum::<f64>() / self.values_px.len().max(1) as f64).sqrt()
    }
}

/// How pixels over the picture move with the camera's parameters, freed of rotation.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    pixels: Vec<Vector2<f64>>,
    /// Two rows for each pixel.
    d_pixels: DMatrix<f64>,
}

impl Sensitivity {
    /// Of a camera; pixels without a ray are left out.
    #[must_use]
    pub fn of(camera: &Camera) -> Self {
        let mut pixels = Vec::new();
        let mut rows: Vec<(SMatrix<f64, 2, CAMERA_SIZE>, Matrix2x3<f64>)> = Vec::new();
        for pixel in grid(camera.size) {
            let Ok((ray, _)) = camera.ray(&pixel) else { continue };
            let Some((_, d_camera, d_point)) = project(camera, &ray) else { continue };
            // Turning the ray by δ moves it by δ × r.
            rows.push((d_camera, -d_point * so3::hat(&ray)));
            pixels.push(pixel);
        }
        let mut d_camera = DMatrix::zeros(2 * rows.len(), CAMERA_SIZE);
        let mut d_rotation = DMatrix::zeros(2 * rows.len(), 3);
        for (k, (c, r)) in rows.iter().enumerate() {
            d_camera.fixed_view_mut::<2, CAMERA_SIZE>(2 * k, 0).copy_from(c);
            d_rotation.fixed_view_mut::<2, 3>(2 * k, 0).copy_from(r);
        }
        let turned = (d_rotation.transpose() * &d_rotation)
            .cholesky()
            .map(|normal| &d_rotation * normal.solve(&(d_rotation.transpose() * &d_camera)));
        Self { pixels, d_pixels: turned.map_or(d_camera.clone(), |turned| d_camera - turned) }
    }

    /// Standard deviation of a pixel along each axis (root mean of the two), from the covariance of the parameters.
    #[must_use]
    pub fn uncertainty(&self, covariance: &SMatrix<f64, CAMERA_SIZE, CAMERA_SIZE>) -> Field {
        let of_pixel = |k: usize| {
            let d_pixel = self.d_pixels.fixed_view::<2, CAMERA_SIZE>(2 * k, 0);
            (0.5 * (d_pixel * covariance * d_pixel.transpose()).trace()).max(0.0).sqrt()
        };
        Field { values_px: (0..self.pixels.len()).map(of_pixel).collect(), pixels: self.pixels.clone() }
    }

    /// Distance by which pixels move when the parameters do.
    #[must_use]
    pub fn movement(&self, difference: &CameraVector) -> Field {
        let moved = &self.d_pixels * DVector::from_column_slice(difference.as_slice());
        let of_pixel = |k: usize| moved.fixed_rows::<2>(2 * k).norm();
        Field { values_px: (0..self.pixels.len()).map(of_pixel).collect(), pixels: self.pixels.clone() }
    }
}

fn grid([width, height]: [u32; 2]) -> impl Iterator<Item = Vector2<f64>> {
    let [columns, rows] = GRID;
    let at = |k: usize, count: usize, size: u32| (k as f64 + 0.5) / count as f64 * f64::from(size) - 0.5;
    (0..rows)
        .flat_map(move |r| (0..columns).map(move |c| (c, r)))
        .map(move |(c, r)| Vector2::new(at(c, columns, width), at(r, rows, height)))
}
