//! The usual mistakes in recordings, with their corrections.

use crate::diagnose::mistake::{
    Mistake, reordered, reordered_back, with_features, with_image_stamps, with_pixels, with_poses,
    with_positions, with_rotations,
};
use crate::order_statistics::median;
use nalgebra::{UnitQuaternion, Vector3};
use trueline_dataset::{Measured, Recording, Sensor, stamp};
use trueline_geometry::{Plane, so3};
use trueline_model::BrownConrady;

/// The mistakes, the most frequent first.
pub(crate) const MISTAKES: &[Mistake] = &[
    Mistake {
        name: "robot in m, labelled mm",
        says: "the robot's positions are 1000 times too small: they are metres; name the columns x_m, y_m, z_m",
        mend: |r| with_robot_scaled(r, 1e3),
    },
    Mistake {
        name: "robot in mm, labelled m",
        says: "the robot's positions are 1000 times too large: they are millimetres; name the columns x_mm, y_mm, z_mm",
        mend: |r| with_robot_scaled(r, 1e-3),
    },
    Mistake {
        name: "robot in inches, labelled mm",
        says: "the robot's positions are 25.4 times too small: they are inches; multiply x, y and z by 25.4",
        mend: |r| with_robot_scaled(r, MM_PER_INCH),
    },
    Mistake {
        name: "robot in mm, labelled inches",
        says: "the robot's positions are 25.4 times too large: they are millimetres and were converted as inches",
        mend: |r| with_robot_scaled(r, 1.0 / MM_PER_INCH),
    },
    Mistake {
        name: "sensor in inches, labelled mm",
        says: "the sensor's lengths (points, profile or laser plane) are 25.4 times too small: they are inches",
        mend: |r| with_sensor_scaled(r, MM_PER_INCH),
    },
    Mistake {
        name: "sensor in mm, labelled inches",
        says: "the sensor's lengths (points, profile or laser plane) are 25.4 times too large: they are millimetres and were \
               converted as inches",
        mend: |r| with_sensor_scaled(r, 1.0 / MM_PER_INCH),
    },
    Mistake {
        name: "quaternion x y z w",
        says: "the quaternion's columns hold x, y, z, w; their order must be qw, qx, qy, qz",
        mend: |r| Some(with_rotations(r, |p| reordered(&p.base_from_tool.rotation))),
    },
    Mistake {
        name: "quaternion w x y z",
        says: "the quaternion's columns hold w, x, y, z, and their names say qx, qy, qz, qw",
        mend: |r| Some(with_rotations(r, |p| reordered_back(&p.base_from_tool.rotation))),
    },
    Mistake {
        name: "inverted poses",
        says: "the poses are tool_from_base: invert them to base_from_tool; or sensor.toml has the wrong mounting, on the tool or beside \
               the robot (mounted = \"fixed\"): the data cannot separate the two, so check the cell",
        mend: |r| Some(with_poses(r, |p| p.base_from_tool.inverse())),
    },
    Mistake {
        name: "inverted rotations",
        says: "the rotations are tool_from_base while the positions are the tool's in base; conjugate the quaternions",
        mend: |r| Some(with_rotations(r, |p| p.base_from_tool.rotation.inverse())),
    },
    Mistake {
        name: "rho read as translation",
        says: "the positions are the ρ of an SE(3) logarithm (ω, ρ), not the translation: p = V(ω) ρ",
        mend: |r| {
            Some(with_positions(r, |p| {
                so3::left_jacobian(&so3::log(&p.base_from_tool.rotation))
                    * p.base_from_tool.translation.vector
            }))
        },
    },
    Mistake {
        name: "radians read as degrees",
        says: "the attitude turns 57.3 times too little: its angles were radians and were converted as degrees",
        mend: |r| Some(with_rotations(r, |p| scaled_angles(&p.base_from_tool.rotation, 1f64.to_degrees()))),
    },
    Mistake {
        name: "features in m, labelled mm",
        says: "the sensor's lengths (points, profile or laser plane) are 1000 times too small: they are metres",
        mend: |r| with_sensor_scaled(r, 1e3),
    },
    Mistake {
        name: "features in mm, labelled m",
        says: "the sensor's lengths (points, profile or laser plane) are 1000 times too large: they are millimetres",
        mend: |r| with_sensor_scaled(r, 1e-3),
    },
    Mistake {
        name: "u and v swapped",
        says: "u_px and v_px are swapped: u is the column, v the row",
        mend: |r| with_pixels(r, |[u, v], _| [v, u]),
    },
    Mistake {
        name: "u mirrored",
        says: "the images are mirrored left to right",
        mend: |r| with_pixels(r, |[u, v], size| [f64::from(size[0]) - 1.0 - u, v]),
    },
    Mistake {
        name: "v mirrored",
        says: "v_px counts from the bottom; it must count from the top",
        mend: |r| with_pixels(r, |[u, v], size| [u, f64::from(size[1]) - 1.0 - v]),
    },
    Mistake {
        name: "pixels of binned images",
        says: "the pixels belong to images of half the resolution in sensor.toml: scale them or the camera \
            by 2",
        mend: |r| with_pixels(r, |uv, _| uv.map(|x| 2.0 * (x + 0.5) - 0.5)),
    },
    Mistake {
        name: "pixels of full images",
        says: "the pixels belong to images of twice the resolution in sensor.toml: scale them or the camera \
            by 2",
        mend: |r| with_pixels(r, |uv, _| uv.map(|x| 0.5 * (x + 0.5) - 0.5)),
    },
    Mistake {
        name: "image stamps in s, labelled ms",
        says: "the image stamps are 1000 times too small: they are seconds",
        mend: |r| with_times(r, [1.0, 1e3]),
    },
    Mistake {
        name: "image stamps in ms, labelled s",
        says: "the image stamps are 1000 times too large: they are milliseconds",
        mend: |r| with_times(r, [1.0, 1e-3]),
    },
    Mistake {
        name: "image stamps in µs, labelled s",
        says: "the image stamps are 1,000,000 times too large: they are microseconds",
        mend: |r| with_times(r, [1.0, 1e-6]),
    },
    Mistake {
        name: "robot stamps in ms, labelled s",
        says: "the robot's stamps are 1000 times too large: they are milliseconds",
        mend: |r| with_times(r, [1e-3, 1.0]),
    },
    Mistake {
        name: "robot stamps in µs, labelled s",
        says: "the robot's stamps are 1,000,000 times too large: they are microseconds",
        mend: |r| with_times(r, [1e-6, 1.0]),
    },
    Mistake {
        name: "robot stamps in s, labelled ms",
        says: "the robot's stamps are 1000 times too small: they are seconds",
        mend: |r| with_times(r, [1e3, 1.0]),
    },
    Mistake {
        name: "all stamps in ms, labelled s",
        says: "the stamps of robot and images are 1000 times too large: they are milliseconds",
        mend: |r| with_times(r, [1e-3, 1e-3]),
    },
    Mistake {
        name: "all stamps in µs, labelled s",
        says: "the stamps of robot and images are 1,000,000 times too large: they are microseconds",
        mend: |r| with_times(r, [1e-6, 1e-6]),
    },
    Mistake {
        name: "laser plane on the other side",
        says: "the laser plane's normal or offset has the wrong sign in y: its tilt is mirrored",
        mend: with_plane_mirrored,
    },
    Mistake {
        name: "distortion order",
        says: "the distortion is k1, k2, k3, p1, p2; the order must be k1, k2, p1, p2, k3",
        mend: with_distortion_reordered,
    },
    Mistake {
        name: "profile mirrored",
        says: "the profiler's x runs the other way",
        mend: with_profile_mirrored,
    },
    Mistake {
        name: "clocks of different origin",
        says: "robot and images are stamped by clocks that start at different times; stamp both by one clock",
        mend: with_starts_aligned,
    },
];

/// Usual distance of a robot's tool from its base, m. A robot 1000 times too small and a sensor 1000 times too large fit equally well, and only the
/// size separates them.
const USUAL_REACH_M: f64 = 1.0;
/// Usual stand-off of a laser sensor, m.
const USUAL_STAND_OFF_M: f64 = 0.2;
const MM_PER_INCH: f64 = 25.4;

/// Whether a length times a factor is nearer to its usual value, on a logarithmic scale.
fn is_likelier(length_m: f64, factor: f64, usual_m: f64) -> bool {
    let away = |length_m: f64| (length_m / usual_m).ln().abs();
    away(length_m * factor) < away(length_m)
}

fn with_robot_scaled(recording: &Recording, factor: f64) -> Option<Recording> {
    is_likelier(reach_m(recording), factor, USUAL_REACH_M)
        .then(|| with_positions(recording, |p| p.base_from_tool.translation.vector * factor))
}

/// Typical distance of the tool from the base, m.
fn reach_m(recording: &Recording) -> f64 {
    median(recording.robot.iter().map(|s| s.base_from_tool.translation.vector.norm())).unwrap_or(0.0)
}

/// Typical distance of the seam from the sensor, m: that of the laser plane if pixels are measured.
fn stand_off_m(recording: &Recording) -> Option<f64> {
    if let Sensor::CameraLaser { laser_plane_in_camera, .. } = &recording.sensor {
        return Some(laser_plane_in_camera.offset());
    }
    median(recording.features.iter().filter_map(|f| match f.measured {
        Measured::Point([x, y, z]) => Some(Vector3::new(x, y, z).norm()),
        Measured::Profile([x, z]) => Some(x.hypot(z)),
        Measured::Pixel(_) => None,
    }))
}

/// Roll, pitch and yaw times a factor.
fn scaled_angles(rotation: &UnitQuaternion<f64>, factor: f64) -> UnitQuaternion<f64> {
    let (roll, pitch, yaw) = rotation.euler_angles();
    UnitQuaternion::from_euler_angles(roll * factor, pitch * factor, yaw * factor)
}

fn with_sensor_scaled(recording: &Recording, factor: f64) -> Option<Recording> {
    if !is_likelier(stand_off_m(recording)?, factor, USUAL_STAND_OFF_M) {
        return None;
    }
    let mut mended = with_features(recording, |measured| match measured {
        Measured::Pixel(pixel) => Measured::Pixel(pixel),
        Measured::Point(point) => Measured::Point(point.map(|x| x * factor)),
        Measured::Profile(point) => Measured::Profile(point.map(|x| x * factor)),
    });
    match &mut mended.sensor {
        Sensor::CameraLaser { laser_plane_in_camera: plane, .. }
        | Sensor::Points { laser_plane_in_camera: Some(plane) } => {
            *plane = Plane::new(plane.normal().into_inner(), plane.offset() * factor)?;
        }
        Sensor::Profiler | Sensor::Points { laser_plane_in_camera: None } => {}
    }
    Some(mended)
}

fn with_plane_mirrored(recording: &Recording) -> Option<Recording> {
    let mut mended = recording.clone();
    let Sensor::CameraLaser { laser_plane_in_camera: plane, .. } = &mut mended.sensor else { return None };
    let n = plane.normal();
    *plane = Plane::new(Vector3::new(n.x, -n.y, n.z), plane.offset())?;
    Some(mended)
}

fn with_distortion_reordered(recording: &Recording) -> Option<Recording> {
    let mut mended = recording.clone();
    let Sensor::CameraLaser { camera, .. } = &mut mended.sensor else { return None };
    let BrownConrady { k1, k2, p1, p2, k3 } = camera.distortion;
    if [p1, p2, k3] == [0.0; 3] {
        return None;
    }
    camera.distortion = BrownConrady { k1, k2, p1: p2, p2: k3, k3: p1 };
    Some(mended)
}

fn with_profile_mirrored(recording: &Recording) -> Option<Recording> {
    matches!(recording.sensor, Sensor::Profiler).then(|| {
        with_features(recording, |measured| match measured {
            Measured::Profile([x, z]) => Measured::Profile([-x, z]),
            other => other,
        })
    })
}

/// Stamps of robot and images in other units. `None` unless the two streams then have similar durations and the robot's sampling rate is plausible.
fn with_times(recording: &Recording, [robot, images]: [f64; 2]) -> Option<Recording> {
    let scaled = |stamp_ns: i64, factor: f64| (stamp_ns as f64 * factor).round() as i64;
    let mut mended = with_image_stamps(recording, |stamp_ns| scaled(stamp_ns, images));
    mended.robot.iter_mut().for_each(|sample| sample.stamp_ns = scaled(sample.stamp_ns, robot));
    // Stamps since 1970 in another unit leave the valid range of stamps.
    let stamps = mended.robot.iter().map(|s| s.stamp_ns).chain(mended.features.iter().map(|f| f.stamp_ns));
    let can_be = stamps.into_iter().all(stamp::is_in_range);
    if !can_be {
        return None;
    }
    let lasts_s = |first: i64, last: i64| (last - first) as f64 * 1e-9;
    let robot_s = lasts_s(mended.robot.first()?.stamp_ns, mended.robot.last()?.stamp_ns);
    let images_s = lasts_s(mended.features.first()?.stamp_ns, mended.features.last()?.stamp_ns);
    let period_s = robot_s / mended.robot.len() as f64;
    let is_followed = (LEAST_PERIOD_S..MOST_PERIOD_S).contains(&period_s);
    (is_followed && images_s > 0.3 * robot_s && images_s < 3.0 * robot_s).then_some(mended)
}

/// Least sampling period of a controller, s …
const LEAST_PERIOD_S: f64 = 5e-5;
/// … and the largest at which the path is known, s.
const MOST_PERIOD_S: f64 = 0.5;

fn with_starts_aligned(recording: &Recording) -> Option<Recording> {
    let shift_ns = recording.robot.first()?.stamp_ns - recording.features.first()?.stamp_ns;
    let apart_s = (shift_ns as f64 * 1e-9).abs();
    let mended = with_image_stamps(recording, |stamp_ns| stamp_ns + shift_ns);
    // Within the searched range no correction is needed.
    (apart_s > 1.0).then_some(mended)
}
