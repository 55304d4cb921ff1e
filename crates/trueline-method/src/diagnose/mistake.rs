//! A mistake, with the correction of a recording.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use trueline_dataset::{Measured, Recording, RobotSample, Sensor};
use trueline_geometry::{Pose, se3};

/// One mistake.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mistake {
    /// Short name.
    pub name: &'static str,
    /// The probable mistake and its remedy.
    pub says: &'static str,
    /// The recording without it. `None` if it cannot have been made.
    pub mend: fn(&Recording) -> Option<Recording>,
}

/// The recording with other poses.
pub(super) fn with_poses(recording: &Recording, pose: impl Fn(&RobotSample) -> Pose) -> Recording {
    let mend = |sample: &RobotSample| RobotSample { base_from_tool: pose(sample), ..*sample };
    Recording { robot: recording.robot.iter().map(mend).collect(), ..recording.clone() }
}

/// The recording with other positions.
pub(super) fn with_positions(
    recording: &Recording,
    position: impl Fn(&RobotSample) -> Vector3<f64>,
) -> Recording {
    with_poses(recording, |sample| se3::from_parts(sample.base_from_tool.rotation, position(sample)))
}

/// The recording with other attitudes.
pub(super) fn with_rotations(
    recording: &Recording,
    rotation: impl Fn(&RobotSample) -> UnitQuaternion<f64>,
) -> Recording {
    with_poses(recording, |sample| {
        se3::from_parts(rotation(sample), sample.base_from_tool.translation.vector)
    })
}

/// Reorders (w, x, y, z) into (x, y, z, w).
#[must_use]
pub(crate) fn reordered(rotation: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let q = rotation.quaternion();
    UnitQuaternion::new_normalize(Quaternion::new(q.k, q.w, q.i, q.j))
}

/// Reorders (x, y, z, w) into (w, x, y, z).
#[must_use]
pub(crate) fn reordered_back(rotation: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let q = rotation.quaternion();
    UnitQuaternion::new_normalize(Quaternion::new(q.i, q.j, q.k, q.w))
}

/// The recording with other features and stripes. A stripe's σ scales with its length.
pub(super) fn with_features(recording: &Recording, measured: impl Fn(Measured) -> Measured) -> Recording {
    let mut mended = recording.clone();
    for feature in &mut mended.features {
        feature.measured = measured(feature.measured);
    }
    for stripe in &mut mended.stripes {
        let before = length(&stripe.points);
        stripe.points = stripe.points.map(&measured);
        stripe.sigma *= length(&stripe.points) / before;
    }
    mended
}

/// Distance of two points, px or m. Readers reject equal points and points of different kinds.
fn length(points: &[Measured; 2]) -> f64 {
    match points {
        [Measured::Pixel(a), Measured::Pixel(b)] | [Measured::Profile(a), Measured::Profile(b)] => {
            (a[0] - b[0]).hypot(a[1] - b[1])
        }
        [Measured::Point(a), Measured::Point(b)] => (Vector3::from(*a) - Vector3::from(*b)).norm(),
        _ => f64::NAN,
    }
}

/// The recording with other stamps of its images, ns.
pub(super) fn with_image_stamps(recording: &Recording, stamp_ns: impl Fn(i64) -> i64) -> Recording {
    let mut mended = recording.clone();
    for feature in &mut mended.features {
        feature.stamp_ns = stamp_ns(feature.stamp_ns);
    }
    for stripe in &mut mended.stripes {
        stripe.stamp_ns = stamp_ns(stripe.stamp_ns);
    }
    mended
}

/// The recording with other pixels, given the size of the image. `None` without a camera.
pub(super) fn with_pixels(
    recording: &Recording,
    pixel: impl Fn([f64; 2], [u32; 2]) -> [f64; 2],
) -> Option<Recording> {
    let Sensor::CameraLaser { camera, .. } = &recording.sensor else { return None };
    let size = camera.size;
    Some(with_features(recording, |measured| match measured {
        Measured::Pixel(uv) => Measured::Pixel(pixel(uv, size)),
        other => other,
    }))
}
