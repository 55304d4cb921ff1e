//! Field of view of the sensor, and the distance of a point from leaving it.

use nalgebra::{Vector2, Vector3};
use trueline_model::Camera;

/// The field of view with the margin that detection needs.
#[derive(Clone, Debug, PartialEq)]
pub enum View {
    /// A camera's picture.
    Camera {
        /// The camera.
        camera: Camera,
        /// Distance of the seam from the picture's edge, px.
        margin_px: f64,
        /// Squared radius of the ideal picture within which the lens model holds.
        believed_squared: f64,
        /// Corners of a part of the ideal picture that is surely in view, however the lens distorts.
        surely: [Vector2<f64>; 2],
    },
    /// A window in the sheet: along the stripe, and in depth.
    Window {
        /// Half the width at every depth, m.
        half_width_m: f64,
        /// Nearest and furthest depth, m.
        depth_m: [f64; 2],
        /// Axis in the camera frame along which the width counts.
        stripe: Vector3<f64>,
    },
}

/// Points behind the camera are as far out of view as this.
const BEHIND: f64 = -10.0;

impl View {
    /// A camera's picture with a margin, px.
    #[must_use]
    pub fn of_camera(camera: Camera, margin_px: f64) -> Self {
        let believed_squared = camera.distortion.invertible_radius_squared();
        let surely = surely_seen(&camera, margin_px, believed_squared);
        Self::Camera { camera, margin_px, believed_squared, surely }
    }

    /// Whether a point of the camera frame (m) is in view.
    #[must_use]
    pub fn contains(&self, point_in_camera: &Vector3<f64>) -> bool {
        if let Self::Camera { surely: [low, high], .. } = self
            && point_in_camera.z > 0.0
        {
            let [x, y] = [point_in_camera.x, point_in_camera.y].map(|a| a / point_in_camera.z);
            if x >= low.x && x <= high.x && y >= low.y && y <= high.y {
                return true;
            }
        }
        self.room(point_in_camera) >= 0.0
    }

    /// Distance of a point of the camera frame (m) inside the view, as a part of half the view's size; negative
    /// outside.
    #[must_use]
    pub fn room(&self, point_in_camera: &Vector3<f64>) -> f64 {
        match self {
            Self::Camera { camera, margin_px, believed_squared, .. } => {
                room_in_picture(camera, *margin_px, *believed_squared, point_in_camera)
            }
            Self::Window { half_width_m, depth_m, stripe } => {
                let aside = 1.0 - stripe.dot(point_in_camera).abs() / half_width_m;
                let half_depth = 0.5 * (depth_m[1] - depth_m[0]);
                let middle = 0.5 * (depth_m[1] + depth_m[0]);
                aside.min(1.0 - (point_in_camera.z - middle).abs() / half_depth)
            }
        }
    }
}

/// The picture without its margin as ideal coordinates, reduced by the largest shift of the lens at any point within its
/// corners' radius; empty if the lens model does not hold at that radius.
fn surely_seen(camera: &Camera, margin_px: f64, believed_squared: f64) -> [Vector2<f64>; 2] {
    let edge = |k: usize, pixel: f64| (pixel - 0.5 - camera.centre[k]) / camera.focal[k];
    let low = Vector2::from_fn(|k, _| edge(k, margin_px));
    let high = Vector2::from_fn(|k, _| edge(k, f64::from(camera.size[k]) - margin_px));
    let r = low.abs().sup(&high.abs()).norm();
    let d = &camera.distortion;
    let radial = d.k1.abs() * r.powi(3) + d.k2.abs() * r.powi(5) + d.k3.abs() * r.powi(7);
    let moved = radial + 3.0 * (d.p1.abs() + d.p2.abs()) * r * r;
    if r * r < believed_squared {
        [low.add_scalar(moved), high.add_scalar(-moved)]
    } else {
        [Vector2::repeat(1.0), Vector2::repeat(-1.0)]
    }
}

fn room_in_picture(camera: &Camera, margin_px: f64, believed_squared: f64, point: &Vector3<f64>) -> f64 {
    if point.z <= 0.0 {
        return BEHIND;
    }
    let ideal = point.xy() / point.z;
    // If the lens model folds back, the pixel is meaningless; the pinhole gives its distance outside.
    let believed = ideal.norm_squared() < believed_squared;
    let seen = if believed { camera.distortion.distort(&ideal).0 } else { ideal };
    let pixel = seen.component_mul(&camera.focal) + camera.centre;
    let half = Vector2::new(f64::from(camera.size[0]), f64::from(camera.size[1])) * 0.5;
    let from_edge = |k: usize| {
        // A pixel's centre is half a pixel inside its edge.
        let x = pixel[k] + 0.5;
        (x.min(2.0 * half[k] - x) - margin_px) / half[k]
    };
    let room = from_edge(0).min(from_edge(1));
    if believed { room } else { room.min(-1e-3) }
}
