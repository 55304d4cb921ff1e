//! Start of the fit: a laser plane and a plate for an approximate hand-eye transform.
//!
//! With the plate's normal n in base, the camera at c and the pixel's ray r in base, X = λ r with λ = (d − n·c)/(n·r). The
//! laser plane l·X = 1 then gives (l·r) (d − n·c) = n·r: linear in l and a = d l, if these are treated as independent. So
//! the normal is all that has to be searched for.

use super::state::PlateState;
use super::stop::Support;
use nalgebra::{Matrix6, Vector3, Vector6};
use trueline_geometry::{Plane, Pose};
use trueline_model::Camera;

/// Directions of the plate's normal that are tried: one every nine degrees.
const NORMALS: usize = 256;

/// A laser plane nearer than this, or farther than its inverse, is impossible, m.
const NEAREST_M: f64 = 1e-3;

/// States to begin from, the best first.
pub(super) fn candidates(camera: &Camera, tool_from_camera: &Pose, stops: &[Support]) -> Vec<PlateState> {
    let rays = rays(camera, tool_from_camera, stops);
    let mut found: Vec<(f64, PlateState)> = (0..NORMALS)
        .filter_map(|k| {
            let (misfit, laser_plane, plate) = with_normal(&direction(k), &rays)?;
            let state = PlateState {
                camera: *camera,
                laser_plane_in_camera: laser_plane,
                tool_from_camera: *tool_from_camera,
                plate_in_base: plate,
            };
            Some((misfit, state))
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, state)| state).collect()
}

/// Directions spread evenly over half a sphere (a spiral by the golden angle).
fn direction(k: usize) -> Vector3<f64> {
    let z = (k as f64 + 0.5) / NORMALS as f64;
    let (sin, cos) = (2.399_963_229_728_653 * k as f64).sin_cos();
    let ring = (1.0 - z * z).sqrt();
    Vector3::new(ring * cos, ring * sin, z)
}

/// A pixel's ray in the camera and in base, and where the camera is.
struct Seen {
    in_camera: Vector3<f64>,
    in_base: Vector3<f64>,
    camera_in_base: Vector3<f64>,
}

fn rays(camera: &Camera, tool_from_camera: &Pose, stops: &[Support]) -> Vec<Seen> {
    let of_stop = |stop: &Support| {
        let base_from_camera = stop.base_from_tool * tool_from_camera;
        stop.pixels.map(|pixel| {
            let (ray, _) = camera.ray(&pixel).ok()?;
            Some(Seen {
                in_camera: ray,
                in_base: base_from_camera.rotation * ray,
                camera_in_base: base_from_camera.translation.vector,
            })
        })
    };
    stops.iter().flat_map(of_stop).flatten().collect()
}

/// The planes for a normal of the plate, and how badly they fit.
fn with_normal(normal: &Vector3<f64>, rays: &[Seen]) -> Option<(f64, Plane, Plane)> {
    let row = |seen: &Seen| {
        let r = seen.in_camera;
        let l = -r * normal.dot(&seen.camera_in_base);
        (Vector6::new(r.x, r.y, r.z, l.x, l.y, l.z), normal.dot(&seen.in_base))
    };
    let (mut matrix, mut right, mut squares) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
    for seen in rays {
        let (row, value) = row(seen);
        matrix += row * row.transpose();
        right += row * value;
        squares += value * value;
    }
    let solved = matrix.svd(true, true).solve(&right, 1e-14 * matrix.norm()).ok()?;
    let misfit = rays.iter().map(row).map(|(row, value)| (row.dot(&solved) - value).powi(2)).sum::<f64>();
    let (a, l): (Vector3<f64>, Vector3<f64>) =
        (solved.fixed_rows::<3>(0).into(), solved.fixed_rows::<3>(3).into());
    let inverse_m = l.norm();
    if !(NEAREST_M..1.0 / NEAREST_M).contains(&inverse_m) {
        return None;
    }
    let laser_plane = Plane::new(l / inverse_m, 1.0 / inverse_m)?;
    Some((misfit / squares, laser_plane, Plane::new(*normal, a.dot(&l) / l.norm_squared())?))
}
