//! A plain plate before a robot, cast forward: for every stop the line in which plate and laser plane meet, projected.

use super::{camera, plane};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};
use trueline_geometry::{Pose, se3, so3};
use trueline_sensor::laser_plane::plate::PlateStop;
use trueline_sensor::projection::project_from_board;

/// Errors of a cell, one standard deviation.
#[derive(Clone, Copy)]
pub(crate) struct Errors {
    pub pixel_px: f64,
    pub position_m: f64,
    pub rotation_rad: f64,
}

pub(crate) const NONE: Errors = Errors { pixel_px: 0.0, position_m: 0.0, rotation_rad: 0.0 };
pub(crate) const USUAL: Errors = Errors { pixel_px: 0.3, position_m: 0.03e-3, rotation_rad: 2e-5 };

pub(crate) fn tool_from_camera() -> Pose {
    se3::from_parts(so3::exp(&Vector3::new(0.4, -0.2, 1.3)), Vector3::new(0.05, -0.03, 0.12))
}

pub(crate) fn base_from_plate() -> Pose {
    se3::from_parts(so3::exp(&Vector3::new(0.1, -0.15, 0.7)), Vector3::new(0.9, -0.2, 0.3))
}

/// `camera_from_plate` (z is the plate's normal) at a stop: near and far, tilted by up to `tilt_rad` to every side, where laser
/// plane and plate meet in the middle of the view.
pub(crate) fn view(k: usize, tilt_rad: f64) -> Pose {
    let (angle, laser) = (2.399_963 * k as f64, plane());
    let depth_m = 0.33 + 0.03 * (k % 6) as f64;
    let x_m = 0.03 * (1.7 * k as f64).sin();
    let n = laser.normal();
    let point = Vector3::new(x_m, (laser.offset() - n.x * x_m - n.z * depth_m) / n.y, depth_m);
    let tilt = tilt_rad * [1.0, 0.6, 0.3][k % 3];
    let rotation = so3::exp(&(Vector3::new(angle.cos(), angle.sin(), 0.0) * tilt))
        * UnitQuaternion::from_scaled_axis(Vector3::z() * 0.4 * (0.9 * k as f64).sin() * tilt_rad.signum());
    // Plates are seen from above: their z points at the camera.
    se3::from_parts(rotation * so3::exp(&(Vector3::x() * std::f64::consts::PI)), point)
}

/// `base_from_tool` of a view that is somewhere on the plate.
pub(crate) fn tool(view: &Pose, k: usize) -> Pose {
    let place = Vector3::new(0.04 * (1.1 * k as f64).cos(), 0.05 * (0.7 * k as f64).sin(), 0.0);
    let on_plate = se3::from_parts(UnitQuaternion::identity(), place);
    base_from_plate() * on_plate * view.inverse() * tool_from_camera().inverse()
}

/// Stops before the plate, with noise.
pub(crate) fn stops(count: usize, tilt_rad: f64, errors: Errors, seed: u64) -> Vec<PlateStop> {
    let mut random = ChaCha12Rng::seed_from_u64(seed);
    let first = random.random_range(0..1000);
    (first..first + count).map(|k| stop(k, tilt_rad, errors, &mut random)).collect()
}

fn stop(k: usize, tilt_rad: f64, errors: Errors, random: &mut ChaCha12Rng) -> PlateStop {
    let view = view(k, tilt_rad);
    let normal_of_plate = view.rotation * Vector3::z();
    let along = normal_of_plate.cross(plane().normal()).normalize();
    let along_on_plate = view.rotation.inverse() * along;
    let normal = |random: &mut ChaCha12Rng, sigma: f64| sigma * sample(random);
    let stripe = (0..120).filter_map(|n| {
        let place = along_on_plate * (0.04 * (f64::from(n) / 59.5 - 1.0));
        let seen = project_from_board(&camera(), &view, &place)?.pixel;
        let noise = Vector2::new(normal(random, errors.pixel_px), normal(random, errors.pixel_px));
        Some(seen + noise)
    });
    let stripe = stripe.collect();
    let mut vector = |sigma: f64| Vector3::from_fn(|_, _| sigma * sample(random));
    let miss = se3::from_parts(so3::exp(&vector(errors.rotation_rad)), vector(errors.position_m));
    PlateStop { base_from_tool: tool(&view, k) * miss, stripe }
}

fn sample(random: &mut ChaCha12Rng) -> f64 {
    StandardNormal.sample(random)
}
