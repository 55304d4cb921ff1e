//! Mistakes in the sensor's numbers. Most of them are small enough for a scan to fit. They are searched if the scan contradicts the sensor's own
//! calibration.

use crate::diagnose::mistake::{Mistake, with_features, with_pixels};
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_model::BrownConrady;

/// Mistakes in the sensor's numbers.
pub(crate) const SENSOR_MISTAKES: &[Mistake] = &[
    Mistake {
        name: "pixels already undistorted",
        says: "the pixels belong to undistorted images and are undistorted again: give distortion = [0, 0, \
            0, 0, 0]",
        mend: |r| with_distortion(r, |_| BrownConrady::default()),
    },
    Mistake {
        name: "distortion of the wrong sign",
        says: "the distortion has the wrong sign: its coefficients belong to the inverse model; they must \
               map ideal to distorted pixels",
        mend: |r| {
            with_distortion(r, |BrownConrady { k1, k2, p1, p2, k3 }| BrownConrady {
                k1: -k1,
                k2: -k2,
                p1: -p1,
                p2: -p2,
                k3: -k3,
            })
        },
    },
    Mistake {
        name: "focal length half as large",
        says: "the focal length in sensor.toml is half the true one: does it belong to another resolution or \
            lens?",
        mend: |r| with_focal_length_scaled(r, 2.0),
    },
    Mistake {
        name: "focal length twice as large",
        says: "the focal length in sensor.toml is twice the true one: does it belong to another resolution \
            or lens?",
        mend: |r| with_focal_length_scaled(r, 0.5),
    },
    Mistake {
        name: "pixels counted from 1",
        says: "the pixels are counted from 1, as MATLAB and HALCON's users do: (0, 0) must be the centre of the first pixel",
        mend: |r| with_pixels(r, |uv, _| uv.map(|x| x - 1.0)),
    },
    Mistake {
        name: "profiler x 10 times too small",
        says: "the profiler's x is 10 times too small: check its unit",
        mend: |r| with_profile_scaled(r, [10.0, 1.0]),
    },
    Mistake {
        name: "profiler x 10 times too large",
        says: "the profiler's x is 10 times too large: check its unit",
        mend: |r| with_profile_scaled(r, [0.1, 1.0]),
    },
    Mistake {
        name: "profiler x half as large",
        says: "the profiler's x is half the true size: its step belongs to every second point",
        mend: |r| with_profile_scaled(r, [2.0, 1.0]),
    },
    Mistake {
        name: "profiler x twice as large",
        says: "the profiler's x is twice the true size: its step belongs to every second point",
        mend: |r| with_profile_scaled(r, [0.5, 1.0]),
    },
    Mistake {
        name: "profiler z 10 times too small",
        says: "the profiler's z is 10 times too small: check its unit",
        mend: |r| with_profile_scaled(r, [1.0, 10.0]),
    },
    Mistake {
        name: "profiler z 10 times too large",
        says: "the profiler's z is 10 times too large: check its unit",
        mend: |r| with_profile_scaled(r, [1.0, 0.1]),
    },
    Mistake {
        name: "profiler z half as large",
        says: "the profiler's z is half the true size: check its scale",
        mend: |r| with_profile_scaled(r, [1.0, 2.0]),
    },
    Mistake {
        name: "profiler z twice as large",
        says: "the profiler's z is twice the true size: check its scale",
        mend: |r| with_profile_scaled(r, [1.0, 0.5]),
    },
];

/// `None` without a camera, or without distortion.
fn with_distortion(
    recording: &Recording,
    change: impl Fn(BrownConrady) -> BrownConrady,
) -> Option<Recording> {
    let mut mended = recording.clone();
    let Sensor::CameraLaser { camera, .. } = &mut mended.sensor else { return None };
    if camera.distortion == BrownConrady::default() {
        return None;
    }
    camera.distortion = change(camera.distortion);
    Some(mended)
}

fn with_focal_length_scaled(recording: &Recording, factor: f64) -> Option<Recording> {
    let mut mended = recording.clone();
    let Sensor::CameraLaser { camera, .. } = &mut mended.sensor else { return None };
    camera.focal = camera.focal.map(|f| f * factor);
    Some(mended)
}

fn with_profile_scaled(recording: &Recording, [by_x, by_z]: [f64; 2]) -> Option<Recording> {
    matches!(recording.sensor, Sensor::Profiler).then(|| {
        with_features(recording, |measured| match measured {
            Measured::Profile([x, z]) => Measured::Profile([x * by_x, z * by_z]),
            other => other,
        })
    })
}
