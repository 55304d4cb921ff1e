//! Seam points of a recording with stripes only: the intersection of the two stripes of a frame.

use crate::input::observations::MIN_IMAGES;
use nalgebra::{Matrix2, Vector2, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use trueline_dataset::{Feature, Measured, PlateStripe, Recording, Sensor, correlation_of};
use trueline_model::{Camera, LaserSheet};

/// Minimum sine of the angle between two stripes on the laser sheet: that of 6°, as for plates that meet. The angle in the image of a slanted sheet
/// is smaller.
const LEAST_ANGLE_SINE: f64 = crate::stripe::start::LEAST_ANGLE_SINE;

/// The same recording with the intersection of both stripes of each frame as its seam point. `None` if the recording has enough seam points, or too
/// few intersections.
#[must_use]
pub fn with_corners(recording: &Recording) -> Option<Recording> {
    if recording.stripes.is_empty() || has_enough_images(&recording.features) {
        return None;
    }
    // All stripes are in one table and have the stamps of their images.
    let mut pairs: BTreeMap<(i64, u32), [Option<&PlateStripe>; 2]> = BTreeMap::new();
    for stripe in &recording.stripes {
        let pair = pairs.entry((stripe.stamp_ns, stripe.plate / 2)).or_default();
        pair[stripe.plate as usize % 2] = Some(stripe);
    }
    let features = pairs.into_iter().filter_map(|((stamp_ns, line), [one, other])| {
        let (one, other) = (one?, other?);
        let (measured, covariance) = crossing(&recording.sensor, one, other)?;
        let sigma = Some([covariance.m11.sqrt(), covariance.m22.sqrt()]);
        let correlation = correlation_of(&covariance);
        Some(Feature { stamp_ns, line, frame: one.frame, device_ns: None, measured, sigma, correlation })
    });
    let features: Vec<Feature> = features.collect();
    if !recording.features.is_empty() && features.len() < MIN_IMAGES {
        return None;
    }
    Some(Recording { features, ..recording.clone() })
}

/// Whether the seam points come from enough images to calibrate. Stops counting when that is reached.
fn has_enough_images(features: &[Feature]) -> bool {
    let mut images = BTreeSet::new();
    features.iter().any(|feature| {
        images.insert(feature.stamp_ns);
        images.len() >= MIN_IMAGES
    })
}

/// The intersection of two stripes with its covariance.
fn crossing(sensor: &Sensor, one: &PlateStripe, other: &PlateStripe) -> Option<(Measured, Matrix2<f64>)> {
    let flat = |stripe: &PlateStripe| -> Option<[Vector2<f64>; 2]> {
        let [a, b] = stripe.points.map(|point| flattened(sensor, point));
        Some([a?, b?])
    };
    let lines = [flat(one)?, flat(other)?];
    let along = lines.map(|[a, b]| (b - a).normalize());
    let normals = along.map(|u| Vector2::new(-u.y, u.x));
    let [on_sheet, beside] = [direction_on_sheet(sensor, one)?, direction_on_sheet(sensor, other)?];
    if on_sheet.perp(&beside).abs() < LEAST_ANGLE_SINE {
        return None;
    }
    let inverse = Matrix2::from_rows(&normals.map(|n| n.transpose())).try_inverse()?;
    let at = inverse * Vector2::new(normals[0].dot(&lines[0][0]), normals[1].dot(&lines[1][0]));
    // Variance of each line at the intersection, from its two support points weighted by distance.
    let variance = |k: usize, sigma: f64| {
        let [a, b] = lines[k];
        let t = along[k].dot(&(at - a)) / (b - a).norm();
        ((1.0 - t).powi(2) + t * t) * sigma * sigma
    };
    let variances = Vector2::new(variance(0, one.sigma), variance(1, other.sigma));
    Some((bent(sensor, &at)?, inverse * Matrix2::from_diagonal(&variances) * inverse.transpose()))
}

/// Direction of a stripe on the sheet, a unit vector.
fn direction_on_sheet(sensor: &Sensor, stripe: &PlateStripe) -> Option<Vector2<f64>> {
    let [a, b] = stripe.points.map(|point| match (point, sensor) {
        (Measured::Pixel(pixel), Sensor::CameraLaser { camera, laser_plane_in_camera }) => {
            let sheet = LaserSheet::from_plane(*laser_plane_in_camera);
            let (point, _) = sheet.intersect(&camera.ray(&Vector2::from(pixel)).ok()?.0)?;
            Some(sheet.coordinates(&point))
        }
        _ => flattened(sensor, point),
    });
    (b? - a?).try_normalize(0.0)
}

/// A point in coordinates in which straight stripes are straight: ideal pixels for a camera, the sheet for other sensors.
fn flattened(sensor: &Sensor, point: Measured) -> Option<Vector2<f64>> {
    match (point, sensor) {
        (Measured::Pixel(pixel), Sensor::CameraLaser { camera, .. }) => {
            let (ray, _) = camera.ray(&Vector2::from(pixel)).ok()?;
            Some(ray.xy().component_mul(&camera.focal) + camera.centre)
        }
        (Measured::Profile(point), Sensor::Profiler) => Some(Vector2::from(point)),
        (Measured::Point(point), Sensor::Points { laser_plane_in_camera: Some(plane) }) => {
            Some(LaserSheet::from_plane(*plane).coordinates(&point.into()))
        }
        _ => None,
    }
}

/// The inverse.
fn bent(sensor: &Sensor, at: &Vector2<f64>) -> Option<Measured> {
    match sensor {
        Sensor::CameraLaser { camera, .. } => {
            let Camera { centre, focal, .. } = camera;
            let ray = (at - centre).component_div(focal);
            camera.project(&Vector3::new(ray.x, ray.y, 1.0)).map(|pixel| Measured::Pixel(pixel.into()))
        }
        Sensor::Profiler => Some(Measured::Profile((*at).into())),
        Sensor::Points { laser_plane_in_camera } => {
            let sheet = LaserSheet::from_plane((*laser_plane_in_camera)?);
            Some(Measured::Point(sheet.point(at).into()))
        }
    }
}
