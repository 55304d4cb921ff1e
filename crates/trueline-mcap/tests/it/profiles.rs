//! Whole profiles: recorded as standard point clouds, read back to the last bit, and other programs' recordings in
//! this form.

use crate::common;

use common::{T0, about, robot};
use foxglove::messages::{PackedElementField, PointCloud, packed_element_field::NumericType};
use prost::Message;
use std::ops::ControlFlow;
use std::path::Path;
use trueline_dataset::{Sensor, folder_profiles};
use trueline_mcap::message::decode;
use trueline_mcap::{
    Choice, Content, ContentError, DatasetFolder, Entry, FrameEntry, ImportError, ProfileEntry, Recorder,
    StampClock, import, import_without_profiles,
};

fn profile(k: u64) -> ProfileEntry {
    let column = |i: u64| {
        // Numbers that decimal digits do not have.
        ((i + k) % 4 != 1).then(|| [i as f64 / 3000.0 - 0.01, 0.25 + (i * k) as f64 / 7e4])
    };
    // Number 5 was lost.
    let number = (1 << 33) + k + u64::from(k >= 5);
    ProfileEntry {
        profile: number,
        stamp_ns: T0 + 7_000_003 * k as i64,
        columns: (0..40).map(column).collect(),
    }
}

fn frame(k: u64, status: &str) -> FrameEntry {
    let png = Vec::new();
    FrameEntry { frame: k, stamp_ns: profile(k).stamp_ns, status: status.to_owned(), png, ..common::frame(0) }
}

fn recorded(path: &Path, count: u64) {
    let recorder = Recorder::create(path, &about()).unwrap();
    for k in 0..count {
        let status = if k == 3 { "2 packets missing" } else { "complete" };
        assert!(recorder.handle().offer(Entry::Robot(robot(k as u32))));
        assert!(recorder.handle().offer(Entry::Frame(frame(k, status))));
        if k != 3 {
            assert!(recorder.handle().offer(Entry::Profile(profile(k))));
        }
    }
    recorder.finish().unwrap();
}

#[test]
fn what_was_recorded_comes_back_without_the_columns_that_saw_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("recording.mcap");
    recorded(&file, 20);
    let imported = import(&file, &Choice::default()).unwrap();
    assert_eq!((imported.recording.sensor.clone(), imported.profiles.len()), (Sensor::Profiler, 19));
    for (found, k) in imported.profiles.iter().zip((0..20).filter(|k| *k != 3)) {
        let put_in = profile(k);
        assert_eq!((found.stamp_ns, found.frame), (put_in.stamp_ns, Some(put_in.profile & 0xffff_ffff)));
        let points: Vec<[f64; 2]> = found.points.iter().map(|point| [point.x_m, point.z_m]).collect();
        assert_eq!(points, put_in.columns.into_iter().flatten().collect::<Vec<_>>());
    }
    // Every fourth of 19 times 40.
    let told = "190 of 760 columns of the profiles have no return and were left out";
    assert!(imported.notes.iter().any(|note| note == told), "{:?}", imported.notes);
    let told = "1 frames did not come whole and have no picture";
    assert!(imported.notes.iter().any(|note| note == told), "{:?}", imported.notes);
    let out = dir.path().join("dataset");
    DatasetFolder::begin(&out, false).unwrap().write(&imported).unwrap();
    assert_eq!(folder_profiles::read(&out).unwrap().unwrap().len(), 19);
    // Profiles have no time of a common clock: stamps of two clocks would be mixed.
    let ptp = Choice { clock: StampClock::Ptp, ..Choice::default() };
    assert!(matches!(import(&file, &ptp), Err(ImportError::NoPtp { .. })));
}

/// Zeros for no return are refused on input, as in a dataset; values named by the user are left out.
#[test]
fn a_range_that_stands_for_no_return_is_refused_unless_the_user_names_it() {
    let dir = tempfile::tempdir().unwrap();
    let recorded = |name: &str, no_return: [f64; 2]| {
        let file = dir.path().join(name);
        let recorder = Recorder::create(&file, &about()).unwrap();
        for k in 0..20 {
            let entry = profile(k);
            let columns = entry.columns.iter().map(|column| Some(column.unwrap_or(no_return))).collect();
            assert!(recorder.handle().offer(Entry::Robot(robot(k as u32))));
            assert!(recorder.handle().offer(Entry::Profile(ProfileEntry { columns, ..entry })));
        }
        recorder.finish().unwrap();
        file
    };
    // Points in the origin are none beyond doubt.
    let imported = import(&recorded("origin.mcap", [0.0, 0.0]), &Choice::default()).unwrap();
    assert_eq!(imported.profiles.iter().map(|profile| profile.points.len()).sum::<usize>(), 600);
    let told = "profiles: 200 of 800 points are exactly (0, 0), far from all others: no return, left out";
    assert!(imported.notes.iter().any(|note| note == told), "{:?}", imported.notes);
    let file = recorded("zeros.mcap", [0.001, 0.0]);
    let refused = import(&file, &Choice::default()).unwrap_err();
    assert!(refused.to_string().contains("200 of 800 points have a range of exactly 0 mm"), "{refused}");
    assert!(refused.hint().contains("--no-return-mm 0"), "{}", refused.hint());
    let named = Choice { no_return_m: Some(0.0), ..Choice::default() };
    let imported = import(&file, &named).unwrap();
    let left: usize = imported.profiles.iter().map(|profile| profile.points.len()).sum();
    assert_eq!(left, 600);
}

fn cloud(fields: &[(&str, u32, NumericType)], stride: u32, data: Vec<u8>) -> Vec<u8> {
    let field = |(name, offset, kind): &(&str, u32, NumericType)| PackedElementField {
        name: (*name).to_owned(),
        offset: *offset,
        r#type: (*kind).into(),
    };
    let fields = fields.iter().map(field).collect();
    let timestamp = Some(foxglove::messages::Timestamp::new(3, 5));
    PointCloud { timestamp, point_stride: stride, fields, data: data.into(), ..PointCloud::default() }
        .encode_to_vec()
}

fn read(bytes: &[u8]) -> Result<Content, ContentError> {
    decode("foxglove.PointCloud", "protobuf", bytes)
}

#[test]
fn clouds_of_others_are_profiles_if_they_lie_in_the_plane_and_lengths_that_lie_are_refused() {
    use NumericType::{Float32, Uint16};
    let xyz = [("z", 8, Float32), ("x", 0, Float32), ("y", 4, Float32)];
    let points =
        |points: &[[f32; 3]]| points.iter().flatten().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let flat = points(&[[0.25, 0.0, 0.5], [f32::NAN, 0.0, 0.5], [-0.25, 0.0, 0.75]]);
    let Content::Profile(profile) = read(&cloud(&xyz, 12, flat.clone())).unwrap() else {
        panic!("a profile")
    };
    assert_eq!((profile.points, profile.no_return), (vec![[0.25, 0.5], [-0.25, 0.75]], 1));
    assert_eq!(profile.stamp_ns, 3_000_000_005);
    let deep = cloud(&xyz, 12, points(&[[0.0, 0.1, 0.5]]));
    assert!(matches!(read(&deep), Err(ContentError::NoProfile { .. })));
    for (fields, stride) in [
        (vec![("x", 0, Float32), ("z", u32::MAX, Float32)], 12),
        (vec![("x", 0, Float32), ("z", 9, Float32)], 12),
        (vec![("x", 0, Float32), ("z", 0, Float32)], 0),
    ] {
        assert!(matches!(read(&cloud(&fields, stride, flat.clone())), Err(ContentError::CutOff { .. })));
    }
    let integers = cloud(&[("x", 0, Uint16), ("z", 2, Uint16)], 4, flat);
    assert!(matches!(read(&integers), Err(ContentError::Missing { .. })));
}

/// The profiles that stay in the recording are those that an import has, and the rest of the recording is the same.
#[test]
fn profiles_one_by_one_are_those_of_the_import() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("recording.mcap");
    recorded(&file, 20);
    let imported = import(&file, &Choice::default()).unwrap();
    let (rest, profiles) = import_without_profiles(&file, &Choice::default()).unwrap();
    assert!(rest.profiles.is_empty());
    assert_eq!(
        (rest.recording.robot, rest.recording.inputs),
        (imported.recording.robot, imported.recording.inputs)
    );
    let mut one_by_one = Vec::new();
    let profiles = profiles.unwrap();
    let mut keep = |profile| {
        one_by_one.push(profile);
        ControlFlow::Continue(())
    };
    let read = profiles.each(true, &mut keep).unwrap();
    assert_eq!(one_by_one, imported.profiles);
    assert!(imported.notes.iter().any(|note| *note == read.notes[0]), "{:?}", read.notes);
    let mut first = 0;
    let stop = |_| {
        first += 1;
        ControlFlow::Break(())
    };
    profiles.each(true, &mut { stop }).unwrap();
    assert_eq!(first, 1);
}
