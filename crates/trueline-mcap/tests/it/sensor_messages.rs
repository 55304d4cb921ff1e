//! Drivers' messages besides gray pictures and plain poses, against the formulas of `fixtures/make_sensor_fixtures.py`.

use std::path::{Path, PathBuf};
use trueline_dataset::{PictureSource, Pixels, Sensor, folder_profiles};
use trueline_mcap::{Choice, ContentError, DatasetFolder, ImportError, Imported, import};

const T0: i64 = 1_700_000_000_000_000_000;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

fn imported(name: &str, choice: &Choice) -> Imported {
    let imported = import(&fixture(name), choice).unwrap();
    assert_eq!(imported.recording.robot.len(), 20);
    for (k, sample) in imported.recording.robot.iter().enumerate() {
        assert_eq!(sample.stamp_ns, T0 + 10_000_000 * k as i64);
        let p = sample.base_from_tool.translation.vector;
        // Doubles are written as they are.
        assert!((p.x - 0.5 - k as f64 / 1000.0).abs() < 1e-15 && p.y == -0.2 && p.z == 0.4);
    }
    imported
}

#[test]
fn a_point_cloud_of_one_row_is_a_profile_and_odometry_is_a_pose() {
    let imported = imported("cloud_odometry", &Choice::default());
    assert_eq!((imported.recording.sensor, imported.profiles.len()), (Sensor::Profiler, 20));
    let profile = &imported.profiles[7];
    assert_eq!((profile.stamp_ns, profile.frame, profile.points.len()), (T0 + 70_000_000, Some(7), 20));
    for (point, i) in profile.points.iter().zip((0..21).filter(|i| *i != 5).map(f64::from)) {
        // Single precision: numbers at 0.3 are 3e-8 apart, and rounded to half of that.
        let expected = [(i - 10.0) / 1000.0, 0.3 + i * 7.0 / 1e5];
        assert!((point.x_m - expected[0]).abs() < 1.6e-8 && (point.z_m - expected[1]).abs() < 1.6e-8);
    }
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("scan");
    DatasetFolder::begin(&out, false)
        .unwrap()
        .write(&import(&fixture("cloud_odometry"), &Choice::default()).unwrap())
        .unwrap();
    assert_eq!(folder_profiles::read(&out).unwrap().unwrap().len(), 20);
}

#[test]
fn a_laser_scan_is_a_profile_with_its_range_ahead() {
    let imported = imported("scan_pose", &Choice::default());
    let profile = &imported.profiles[10];
    assert_eq!(profile.points.len(), 20);
    for (point, i) in profile.points.iter().zip((0..21).filter(|i| *i != 3).map(f64::from)) {
        let angle = -0.1 + 0.01 * i;
        // Angles and ranges in single precision: 1e-8 rad and 2e-8 m, and the steps of the angle add up twenty times.
        assert!(
            (point.x_m - 0.31 * angle.sin()).abs() < 1e-7 && (point.z_m - 0.31 * angle.cos()).abs() < 1e-7
        );
    }
}

#[test]
fn colours_become_luma_and_a_mosaic_its_mean_and_both_are_said() {
    let choice = Choice { sensor: Some(Sensor::Profiler.into()), ..Choice::default() };
    // (299 · 200 + 587 · 20 + 114 · 10) / 1000 = 72.68; (200 + 2 · 100 + 40) / 4 = 110 everywhere.
    for (name, level, said) in [("colours", 73, "in colour"), ("mosaic", 110, "mosaic")] {
        let imported = imported(name, &choice);
        let picture = imported.pictures.as_ref().unwrap().read(3, &mut Vec::new()).unwrap();
        assert_eq!(picture.pixels, Pixels::Eight(vec![level; picture.width * picture.height]), "{name}");
        assert!(imported.notes.iter().any(|note| note.starts_with("20 ") && note.contains(said)), "{name}");
    }
}

#[test]
fn jpeg_is_refused_unless_it_is_allowed() {
    let choice = Choice { sensor: Some(Sensor::Profiler.into()), ..Choice::default() };
    let Err(ImportError::Message { problem, .. }) = import(&fixture("jpeg"), &choice) else {
        panic!("taken")
    };
    assert!(problem == ContentError::Jpeg && problem.hint().contains("--allow-jpeg"));
    let imported = imported("jpeg", &Choice { allow_jpeg: true, ..choice });
    let picture = imported.pictures.as_ref().unwrap().read(0, &mut Vec::new()).unwrap();
    assert_eq!((picture.width, picture.height), (16, 16));
    let Pixels::Eight(levels) = picture.pixels else { panic!("8 bits") };
    // An even picture survives but for the rounding of its mean.
    assert!(levels.iter().all(|level| level.abs_diff(120) <= 1));
    assert!(imported.notes.iter().any(|note| note.contains("JPEG")));
}
