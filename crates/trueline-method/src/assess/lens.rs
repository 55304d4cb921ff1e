//! The distortion of a camera's lens from a scan: corrections of k1 and k2.

use nalgebra::{Matrix2, Vector2};
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_model::{Camera, LaserSheet};

/// Correction of the lens to its file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensCorrection {
    /// True minus stated k1 and k2. An unobservable number is zero.
    pub distortion: [f64; 2],
    /// Their standard deviations from noise.
    pub sigma: [f64; 2],
}

/// Difference steps of k1 and k2. They are far above rounding, and points depend on them linearly.
const STEPS: [f64; 2] = [1e-4, 1e-3];

/// Motion of a feature in the sheet for each unit of k1 and of k2, m. `None` without a camera.
#[must_use]
pub(crate) fn moves(recording: &Recording, sheet: &LaserSheet, row: usize) -> Option<Matrix2<f64>> {
    let Sensor::CameraLaser { camera, .. } = &recording.sensor else { return None };
    let Measured::Pixel(pixel) = recording.features.get(row)?.measured else { return None };
    let seen = |by: [f64; 2]| {
        let (ray, _) = with(camera, by).ray(&Vector2::from(pixel)).ok()?;
        Some(sheet.coordinates(&sheet.intersect(&ray)?.0))
    };
    let slope = |by: [f64; 2], step: f64| Some((seen(by)? - seen(by.map(|number| -number))?) / (2.0 * step));
    let [k1, k2] = STEPS;
    Some(Matrix2::from_columns(&[slope([k1, 0.0], k1)?, slope([0.0, k2], k2)?]))
}

/// A camera with k1 and k2 increased by these amounts.
#[must_use]
pub(crate) fn with(camera: &Camera, by: [f64; 2]) -> Camera {
    let mut camera = *camera;
    camera.distortion.k1 += by[0];
    camera.distortion.k2 += by[1];
    camera
}
