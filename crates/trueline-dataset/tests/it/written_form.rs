//! A recording in its written form is what a folder gives back.

use nalgebra::{UnitQuaternion, Vector3};
use trueline_dataset::{Feature, Measured, Recording, RobotSample, Sensor, folder, written_form};
use trueline_geometry::se3;

/// Numbers with all their digits, some of which millimetres cannot keep.
fn recording(device: bool, sigma: bool) -> Recording {
    let x = |k: i32| f64::from(k).sin() / 3.0 + 0.1;
    let sample = |k: i32| RobotSample {
        stamp_ns: 1_000_000_007 * i64::from(k),
        device_ns: (device || k != 3).then_some(i64::from(k)),
        base_from_tool: se3::from_parts(
            UnitQuaternion::from_euler_angles(x(k), x(k + 7), x(k + 13)),
            Vector3::new(x(k), x(k + 1), -x(k + 2)),
        ),
    };
    let feature = |k: i32| Feature {
        stamp_ns: 1_000_000_009 * i64::from(k),
        line: 0,
        frame: (device || k != 5).then_some(k as u64),
        device_ns: (device || k != 4).then_some(i64::from(k)),
        measured: Measured::Profile([x(k + 3), x(k + 4)]),
        sigma: (sigma || k != 6).then_some([x(k).abs() + 1e-5, 1e-4 / 3.0]),
        correlation: if sigma { 0.9 * (f64::from(k)).sin() } else { 0.0 },
    };
    Recording::new(
        Sensor::Profiler,
        Default::default(),
        (0..200).map(sample).collect(),
        (0..200).map(feature).collect(),
    )
}

#[test]
fn the_written_form_is_what_a_folder_gives_back() {
    for (device, sigma) in [(true, true), (false, true), (true, false)] {
        let recording = recording(device, sigma);
        let place = tempfile::tempdir().unwrap();
        let out = place.path().join("scan");
        folder::write(&out, &recording).unwrap();
        let read = folder::read(&out).unwrap();
        let form = written_form::of(recording.clone(), false).unwrap();
        assert_eq!((read.sensor, read.setup), (form.sensor, form.setup));
        assert!(read.robot == form.robot);
        assert!(read.features == form.features);
        // Were nothing lost on the way, this would test nothing.
        assert!(form.robot != recording.robot);
    }
}
