//! One stop: where the robot was, and the stripe on the plate as the two numbers that a straight stripe is.

use crate::projection::project;
use nalgebra::{Matrix2, Vector2};
use trueline_geometry::Pose;
use trueline_model::Camera;

/// The fewest pixels of a stripe.
const FEWEST_PIXELS: usize = 10;

/// The robot's pose and the stripe that the camera saw there.
#[derive(Clone, Debug)]
pub struct PlateStop {
    /// `base_from_tool` if the robot carries the sensor; its inverse if it carries the plate.
    pub base_from_tool: Pose,
    /// Pixels along the stripe.
    pub stripe: Vec<Vector2<f64>>,
}

/// A straight stripe as two of its pixels with independent errors across it, one standard deviation of the pixels' places to
/// either side of their middle. They contain the full result of a regression of all pixels.
#[derive(Clone, Copy, Debug)]
pub struct Support {
    /// `base_from_tool`, as in [`PlateStop`].
    pub base_from_tool: Pose,
    /// The two pixels.
    pub pixels: [Vector2<f64>; 2],
    /// Standard deviation of their mean, and of half their difference, across the stripe, px.
    pub sigma_px: f64,
}

impl Support {
    /// Of a stop, by a camera that is nearly right: it only takes the lens distortion out and puts it back. `None` for a stripe
    /// that is too short.
    #[must_use]
    pub fn of(camera: &Camera, stop: &PlateStop) -> Option<Self> {
        let ideal: Vec<Vector2<f64>> =
            stop.stripe.iter().filter_map(|pixel| Some(camera.ray(pixel).ok()?.0.xy())).collect();
        if ideal.len() < FEWEST_PIXELS {
            return None;
        }
        let count = ideal.len() as f64;
        let middle = ideal.iter().sum::<Vector2<f64>>() / count;
        let moments =
            ideal.iter().fold(Matrix2::zeros(), |sum, p| sum + (p - middle) * (p - middle).transpose());
        let eigen = moments.symmetric_eigen();
        let along: Vector2<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
        let reach = (eigen.eigenvalues.max() / count).sqrt();
        let across_px = (eigen.eigenvalues.min().max(0.0) / (count - 2.0)).sqrt() * camera.focal.mean();
        let pixel = |side: f64| {
            let ideal = middle + along * (side * reach);
            project(camera, &ideal.push(1.0)).map(|(pixel, ..)| pixel)
        };
        (reach > 0.0).then_some(Self {
            base_from_tool: stop.base_from_tool,
            pixels: [pixel(-1.0)?, pixel(1.0)?],
            sigma_px: across_px / count.sqrt(),
        })
    }
}
