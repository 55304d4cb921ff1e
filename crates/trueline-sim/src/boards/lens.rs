//! From a pixel to its ray, by fixed-point iteration: the ideal point is the distorted one less the distortion there.

use nalgebra::{Vector2, Vector3};
use trueline_model::Camera;

/// The iteration gains at least a digit a round for lenses that bend by less than a tenth.
const ROUNDS: usize = 15;

/// The ray (x, y, 1) of a pixel.
pub(super) fn ray(camera: &Camera, u_px: f64, v_px: f64) -> Vector3<f64> {
    let k = &camera.distortion;
    let seen =
        Vector2::new((u_px - camera.centre.x) / camera.focal.x, (v_px - camera.centre.y) / camera.focal.y);
    let mut ideal = seen;
    for _ in 0..ROUNDS {
        let (x, y) = (ideal.x, ideal.y);
        let r2 = x * x + y * y;
        let radial = r2 * (k.k1 + r2 * (k.k2 + r2 * k.k3));
        let added = Vector2::new(
            x * radial + 2.0 * k.p1 * x * y + k.p2 * (r2 + 2.0 * x * x),
            y * radial + k.p1 * (r2 + 2.0 * y * y) + 2.0 * k.p2 * x * y,
        );
        ideal = seen - added;
    }
    Vector3::new(ideal.x, ideal.y, 1.0)
}
