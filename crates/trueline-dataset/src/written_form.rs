//! A recording in the form that its written folder gives back.
//!
//! A dataset folder holds millimetres, and columns that are filled for all rows or for none. A recording that never becomes a
//! folder goes through the same form, so that both give the same result to the last digit.

use crate::error::Error;
use crate::recording::{Feature, Measured, PlateStripe, Recording, RobotSample, Sensor};
use crate::sensor_toml::{self, SensorFile};
use crate::unit::MM_PER_M;
use nalgebra::{UnitQuaternion, Vector3};
use std::path::Path;
use trueline_geometry::se3;

/// The numbers that reading gives after [`crate::folder::write`]. The sensor stays unchanged if `keeps_sensor`: its file
/// is then written in its own words.
///
/// # Errors
/// A sensor that cannot be written.
pub fn of(mut recording: Recording, keeps_sensor: bool) -> Result<Recording, Error> {
    if !keeps_sensor {
        let file = SensorFile { sensor: recording.sensor, setup: recording.setup };
        let text = sensor_toml::format_file(&file);
        let SensorFile { sensor, setup } = sensor_toml::parse_file(Path::new("sensor.toml"), &text)?;
        (recording.sensor, recording.setup) = (sensor, setup);
    }
    robot(&mut recording.robot);
    features(&mut recording.features, &recording.sensor);
    stripes(&mut recording.stripes);
    Ok(recording)
}

/// Written in mm and read again, m.
fn through_mm(metres: f64) -> f64 {
    (metres * MM_PER_M) * 1e-3
}

fn robot(samples: &mut [RobotSample]) {
    let device = samples.iter().all(|sample| sample.device_ns.is_some());
    for sample in samples {
        let pose = &sample.base_from_tool;
        let position: Vector3<f64> = pose.translation.vector.map(through_mm);
        let rotation = UnitQuaternion::new_normalize(*pose.rotation.quaternion());
        sample.base_from_tool = se3::from_parts(rotation, position);
        sample.device_ns = sample.device_ns.filter(|_| device);
    }
}

fn stripes(stripes: &mut [PlateStripe]) {
    let frames = stripes.iter().all(|stripe| stripe.frame.is_some());
    for stripe in stripes {
        stripe.frame = stripe.frame.filter(|_| frames);
        for point in &mut stripe.points {
            match point {
                Measured::Pixel(_) => continue,
                Measured::Point(numbers) => *numbers = numbers.map(through_mm),
                Measured::Profile(numbers) => *numbers = numbers.map(through_mm),
            }
        }
        if !matches!(stripe.points[0], Measured::Pixel(_)) {
            stripe.sigma = through_mm(stripe.sigma);
        }
    }
}

fn features(features: &mut [Feature], sensor: &Sensor) {
    let frames = features.iter().all(|feature| feature.frame.is_some());
    let device = features.iter().all(|feature| feature.device_ns.is_some());
    let sigmas =
        features.iter().all(|feature| feature.sigma.is_some()) && !matches!(sensor, Sensor::Points { .. });
    for feature in features {
        feature.frame = feature.frame.filter(|_| frames);
        feature.device_ns = feature.device_ns.filter(|_| device);
        feature.sigma = feature.sigma.filter(|_| sigmas);
        feature.correlation = if sigmas { feature.correlation } else { 0.0 };
        match &mut feature.measured {
            Measured::Pixel(_) => continue,
            Measured::Point(numbers) => *numbers = numbers.map(through_mm),
            Measured::Profile(numbers) => *numbers = numbers.map(through_mm),
        }
        feature.sigma = feature.sigma.map(|sigma| sigma.map(through_mm));
    }
}
