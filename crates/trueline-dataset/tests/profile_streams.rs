//! Profiles read one by one: those of the whole file, in memory that does not grow with it.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use peak_alloc::PeakAlloc;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use trueline_dataset::folder_profiles::{self, FolderProfiles};
use trueline_dataset::{Profile, ProfileForm, ProfilePoint, folder};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The allocator counts for all threads: one test at a time.
static ALONE: Mutex<()> = Mutex::new(());

const POINTS: usize = 500;

fn profiles(count: usize) -> Vec<Profile> {
    let point = |k: usize, column: usize| ProfilePoint {
        x_m: 1e-5 * column as f64,
        z_m: 0.2 + 1e-6 * ((k * 31 + column * 7) % 1000) as f64,
        intensity: Some((column % 200) as f64),
    };
    let profile = |k: usize| Profile {
        stamp_ns: 10_000_000 * k as i64,
        frame: Some(k as u64),
        points: (0..POINTS).map(|column| point(k, column)).collect(),
    };
    (0..count).map(profile).collect()
}

fn write(folder: &Path, profiles: &[Profile], form: ProfileForm) {
    fs::write(folder.join("sensor.toml"), "kind = \"profiler\"\n").unwrap();
    fs::write(folder.join("robot.csv"), "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n").unwrap();
    folder::write_profiles(folder, profiles, form).unwrap();
}

fn forms() -> Vec<ProfileForm> {
    let mut forms = vec![ProfileForm::Csv];
    if cfg!(feature = "parquet") {
        forms.push(ProfileForm::Parquet);
    }
    forms
}

#[test]
fn memory_is_that_of_a_piece_however_long_the_file() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    for form in forms() {
        let peaks = [300, 1500].map(|count| {
            let dir = tempfile::tempdir().unwrap();
            write(dir.path(), &profiles(count), form);
            let (before, mut seen) = (MEMORY.current_usage(), 0);
            MEMORY.reset_peak_usage();
            let read = FolderProfiles::of(dir.path()).unwrap().unwrap().each(true, &mut |profile| {
                seen += profile.points.len();
                ControlFlow::Continue(())
            });
            assert!(read.unwrap().notes.is_empty() && seen == count * POINTS);
            MEMORY.peak_usage() - before
        });
        // The smaller file has more rows than a piece of either form; the larger one's other points alone take 19 MB.
        assert!(peaks[1] < peaks[0] + (2 << 20), "{form:?}: {peaks:?}");
    }
}

#[test]
fn they_are_those_of_the_whole_file_and_a_hash_is_that_of_its_bytes() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    for form in forms() {
        let dir = tempfile::tempdir().unwrap();
        let mut all = profiles(200);
        // Points at (0, 0), which mean no return, as some sensors write it.
        for profile in &mut all {
            profile.points[3] = ProfilePoint { x_m: 0.0, z_m: 0.0, intensity: Some(0.0) };
        }
        write(dir.path(), &all, form);
        let whole = folder_profiles::read(dir.path()).unwrap().unwrap();
        let mut one_by_one = Vec::new();
        let profiles = FolderProfiles::of(dir.path()).unwrap().unwrap();
        let mut keep = |profile| {
            one_by_one.push(profile);
            ControlFlow::Continue(())
        };
        let read = profiles.each(true, &mut keep).unwrap();
        assert!(!read.origins_are_measured && read.notes.len() == 1, "{read:?}");
        assert!(one_by_one == whole && whole[0].points.len() == POINTS - 1);
        // Read again, with all points.
        let mut points = 0;
        profiles
            .each(false, &mut |profile| {
                points += profile.points.len();
                ControlFlow::Continue(())
            })
            .unwrap();
        assert_eq!(points, 200 * POINTS);
        let with = folder::read_content(dir.path()).unwrap();
        let without = folder::read_without_profiles(dir.path()).unwrap();
        assert!(without.profiles.is_empty() && with.profiles == whole);
        assert_eq!(with.recording.inputs, without.recording.inputs);
    }
}

/// A sensor whose ranges are about zero: two points in the origin among others near it are measured ones.
#[test]
fn points_in_the_origin_that_are_measured_are_asked_for_again() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let dir = tempfile::tempdir().unwrap();
    let mut all = profiles(20);
    all.iter_mut().flat_map(|profile| &mut profile.points).for_each(|point| point.z_m -= 0.2);
    write(dir.path(), &all, ProfileForm::Csv);
    let profiles = FolderProfiles::of(dir.path()).unwrap().unwrap();
    let count = |takes_out: bool| {
        let mut points = 0;
        let read = profiles.each(takes_out, &mut |profile| {
            points += profile.points.len();
            ControlFlow::Continue(())
        });
        (points, read.unwrap().origins_are_measured)
    };
    let (points, again) = count(true);
    assert!(points < 20 * POINTS && again);
    assert_eq!(count(false), (20 * POINTS, false));
}
