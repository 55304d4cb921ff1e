//! Distorted pixels to ideal ones and back.
//!
//! Ideal pixels are of the same camera without distortion. It maps straight lines of a plane to straight lines, so
//! the segments of a stripe, straight in the laser sheet, are straight there too. The noise of a pixel is the same
//! everywhere. So the fits are made there. Their results are judged in the sheet.

use nalgebra::{Matrix2, Vector2, Vector3};
use trueline_geometry::Plane;
use trueline_model::{Camera, LaserSheet};

/// Distance of the grid's nodes, px. Distortion bends by some 1e-4 px per px², so the middle between nodes is off by
/// 1e-4 · 16² / 8 = 0.003 px. Only first guesses are looked up; results are computed.
const STEP: usize = 16;

/// A camera's lens and its laser sheet, prepared for many pixels.
#[derive(Clone, Debug)]
pub struct Lens {
    camera: Camera,
    plane: Plane,
    sheet: LaserSheet,
    columns: usize,
    /// Ideal pixel at each node; not a number where the lens cannot be inverted.
    nodes: Vec<[f32; 2]>,
}

impl Lens {
    /// Prepares a camera and its sheet.
    #[must_use]
    pub fn new(camera: Camera, sheet: Plane) -> Self {
        let [columns, rows] = camera.size.map(|n| (n as usize).div_ceil(STEP) + 1);
        let last = camera.size.map(|n| f64::from(n) - 1.0);
        let mut nodes = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            for column in 0..columns {
                // The last nodes lie beyond the picture: they are extrapolated by a pixel at its border.
                let pixel = Vector2::new((column * STEP) as f64, (row * STEP) as f64);
                let inside = Vector2::new(pixel.x.min(last[0]), pixel.y.min(last[1]));
                let node = camera.ray(&inside).map_or([f32::NAN; 2], |(ray, d_ray_d_pixel)| {
                    let d_ideal = d_ray_d_pixel.fixed_rows::<2>(0) * (pixel - inside);
                    let ideal = (ray.xy() + d_ideal).component_mul(&camera.focal) + camera.centre;
                    [ideal.x as f32, ideal.y as f32]
                });
                nodes.push(node);
            }
        }
        Self { camera, plane: sheet, sheet: LaserSheet::from_plane(sheet), columns, nodes }
    }

    /// The camera.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The laser plane in the camera frame.
    #[must_use]
    pub fn plane(&self) -> &Plane {
        &self.plane
    }

    /// The sheet.
    #[must_use]
    pub fn sheet(&self) -> &LaserSheet {
        &self.sheet
    }

    /// The ideal pixel of a distorted one, looked up; NaN if there is none.
    #[must_use]
    pub fn ideal(&self, u: f32, v: f32) -> [f32; 2] {
        let step = STEP as f32;
        let (x, y) = (u.max(0.0) / step, v.max(0.0) / step);
        let (column, row) = (x as usize, y as usize);
        let (p, q) = (x - column as f32, y - row as f32);
        let at = (row * self.columns + column).min(self.nodes.len().saturating_sub(self.columns + 2));
        let [a, b] = [self.nodes[at], self.nodes[at + 1]];
        let [c, d] = [self.nodes[at + self.columns], self.nodes[at + self.columns + 1]];
        [0, 1].map(|k| (a[k] * (1.0 - p) + b[k] * p) * (1.0 - q) + (c[k] * (1.0 - p) + d[k] * p) * q)
    }

    /// The distorted pixel of an ideal one, and d distorted / d ideal (2×2); computed, not looked up.
    #[must_use]
    pub fn distorted(&self, ideal: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let camera = &self.camera;
        let normalised = (ideal - camera.centre).component_div(&camera.focal);
        let (value, jacobian) = camera.distortion.distort(&normalised);
        let focal = Matrix2::from_diagonal(&camera.focal);
        let d_normalised = Matrix2::new(1.0 / camera.focal.x, 0.0, 0.0, 1.0 / camera.focal.y);
        (value.component_mul(&camera.focal) + camera.centre, focal * jacobian * d_normalised)
    }

    /// The point of the sheet that an ideal pixel sees, in coordinates of the sheet (m), and its derivative
    /// (m/px). `None` where the ray does not meet the sheet before the camera.
    #[must_use]
    pub fn on_sheet(&self, ideal: &Vector2<f64>) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let normalised = (ideal - self.camera.centre).component_div(&self.camera.focal);
        let (point, d_point_d_ray) = self.sheet.intersect(&normalised.push(1.0))?;
        let d_ray = d_point_d_ray.fixed_columns::<2>(0)
            * Matrix2::new(1.0 / self.camera.focal.x, 0.0, 0.0, 1.0 / self.camera.focal.y);
        Some((self.sheet.coordinates(&point), self.sheet.axes().transpose() * d_ray))
    }

    /// The ideal pixel of a point of the sheet, and d ideal / d point (px/m).
    #[must_use]
    pub fn from_sheet(&self, on_sheet: &Vector2<f64>) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let point: Vector3<f64> = self.sheet.point(on_sheet);
        if point.z <= 0.0 {
            return None;
        }
        let normalised = point.xy() / point.z;
        let axes = self.sheet.axes();
        let d_normalised = (axes.fixed_rows::<2>(0) - normalised * axes.fixed_rows::<1>(2)) / point.z;
        let focal = Matrix2::from_diagonal(&self.camera.focal);
        Some((normalised.component_mul(&self.camera.focal) + self.camera.centre, focal * d_normalised))
    }

    /// Unit vector in the sheet that leads away from the camera.
    #[must_use]
    pub fn away(&self) -> Vector2<f64> {
        self.sheet.axes().transpose() * Vector3::z()
    }

    /// Distance to the right in the sheet of the point at an ideal pixel, m. It is measured along the sheet's direction
    /// of constant distance from the camera, towards the right of the picture, or downwards if the sheet stands upright
    /// in it. `None` where the ray does not meet the sheet.
    #[must_use]
    pub(crate) fn sideways_m(&self, ideal: &Vector2<f64>) -> Option<f64> {
        let away = self.away();
        let sideways = Vector2::new(away.y, -away.x).normalize();
        let in_camera = self.sheet.axes() * sideways;
        let forward = if in_camera.x.abs() >= in_camera.y.abs() { in_camera.x } else { in_camera.y };
        self.on_sheet(ideal).map(|(point, _)| forward.signum() * sideways.dot(&point))
    }
}
