//! Contents of a path, and the messages on the way.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::sync::Mutex;
use trueline::open::{How, OpenError, OpenObserver, Told, open, open_all};
use trueline_dataset::{Recording, folder};
use trueline_sim::{Plates, Preset, scan_plates, simulate};

#[derive(Default)]
struct Heard(Mutex<Vec<String>>);

impl OpenObserver for Heard {
    fn told(&self, told: &Told<'_>) {
        self.0.lock().unwrap().push(told.to_string());
    }
}

#[test]
fn mistyped_names_and_files_of_a_dataset_are_refused_by_name() {
    let place = tempfile::tempdir().unwrap();
    let missing = place.path().join("scna");
    let error = open(&missing, &How::default(), &()).unwrap_err();
    assert!(matches!(&error, OpenError::NoPlace(path) if *path == missing), "{error}");

    let file = place.path().join("robot.csv");
    std::fs::write(&file, "time_s\n").unwrap();
    let error = open(&file, &How::default(), &()).unwrap_err();
    assert!(matches!(&error, OpenError::PartOfDataset(path) if *path == file), "{error}");
    assert!(error.hint().contains(&place.path().display().to_string()), "{}", error.hint());
}

#[test]
fn a_dataset_comes_back_as_it_was_written() {
    let place = tempfile::tempdir().unwrap();
    let written = simulate(&Preset::Quick.scenario(), 3).unwrap();
    folder::write(place.path(), &written).unwrap();
    let opened = open(place.path(), &How::default(), &()).unwrap();
    assert_eq!(opened.recording.features, written.features);
    let stamps = |recording: &Recording| recording.robot.iter().map(|pose| pose.stamp_ns).collect::<Vec<_>>();
    assert_eq!(stamps(&opened.recording), stamps(&written));
    assert!(opened.pictures.is_none());
}

#[test]
fn stripes_without_seam_points_cross_in_one_and_that_is_told() {
    let place = tempfile::tempdir().unwrap();
    let mut written = scan_plates(&Preset::Quick.scenario(), &Plates::default(), 3).unwrap();
    written.features.clear();
    folder::write(place.path(), &written).unwrap();
    let heard = Heard::default();
    let opened = open(place.path(), &How::default(), &heard).unwrap();
    assert!(!opened.recording.features.is_empty());
    assert!(heard.0.lock().unwrap().iter().any(|told| told.contains("where two stripes cross")));
}

#[test]
fn scans_of_one_sensor_are_taken_together_and_of_two_refused() {
    let place = tempfile::tempdir().unwrap();
    let (one, other, third) = (place.path().join("a"), place.path().join("b"), place.path().join("c"));
    folder::write(&one, &simulate(&Preset::Quick.scenario(), 1).unwrap()).unwrap();
    folder::write(&other, &simulate(&Preset::Quick.scenario(), 2).unwrap()).unwrap();
    folder::write(&third, &simulate(&Preset::Profiler.scenario(), 3).unwrap()).unwrap();
    let heard = Heard::default();
    let both = open_all(&[one.clone(), other.clone()], &How::default(), &heard).unwrap().recording;
    let alone = |path| open(path, &How::default(), &()).unwrap().recording.features.len();
    assert_eq!(both.features.len(), alone(&one) + alone(&other));
    let heard = heard.0.lock().unwrap();
    assert!(heard.iter().any(|told| told.starts_with("2 scans together")), "{heard:?}");
    // Both begin at the same time.
    assert!(heard.iter().any(|told| told.contains("shifted alike")), "{heard:?}");
    let error = open_all(&[one, third], &How::default(), &()).unwrap_err();
    assert!(matches!(error, OpenError::Join(_)), "{error}");
}
