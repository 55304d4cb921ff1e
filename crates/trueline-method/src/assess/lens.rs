//! The distortion of a camera's lens, as far as a scan shows it: k1 and k2 beside what its file states.

use nalgebra::{Matrix2, Vector2};
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_model::{Camera, LaserSheet};

/// What the lens is beside its file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensCorrection {
    /// True minus stated k1 and k2; a number that the scan does not show is zero.
    pub distortion: [f64; 2],
    /// Their standard deviations by noise.
    pub sigma: [f64; 2],
}

/// Steps of k1 and k2 for a difference: far above rounding, and points follow them linearly.
const STEPS: [f64; 2] = [1e-4, 1e-3];

/// How far in the sheet a feature moves for each unit of k1 and of k2, m; `None` where there is no camera.
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

/// A camera with k1 and k2 by so much larger.
#[must_use]
pub(crate) fn with(camera: &Camera, by: [f64; 2]) -> Camera {
    let mut camera = *camera;
    camera.distortion.k1 += by[0];
    camera.distortion.k2 += by[1];
    camera
}
