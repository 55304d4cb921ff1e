//! `encoder.csv`: readings that name the count of an encoder in the place of a stamp.

use std::fs;
use std::ops::ControlFlow;
use trueline_dataset::folder_profiles::FolderProfiles;
use trueline_dataset::import::csv_folder::CsvFolder;
use trueline_dataset::{Recording, folder, pose_folder};

const ROBOT: &str = "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n\
                     10,0,0,0,1,0,0,0\n\
                     11,1,0,0,1,0,0,0\n\
                     12,2,0,0,1,0,0,0\n";
/// It stands for half a second, goes down by 100 in the next, and by 300 in the one after.
const LOG: &str = "time_s,encoder\n10,500\n10.5,500\n11,450\n12,150\n";
const FEATURES: &str = "encoder,x_mm,z_mm\n475,1,2\n450,2,2\n300,3,2\n";
/// Their stamps, ns.
const STAMPS_NS: [i64; 3] = [10_750_000_000, 11_000_000_000, 11_500_000_000];

fn dataset(tables: &[(&str, &str)]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("sensor.toml"), "kind = \"profiler\"\n").unwrap();
    fs::write(dir.path().join("robot.csv"), ROBOT).unwrap();
    for (name, text) in tables {
        fs::write(dir.path().join(name), text).unwrap();
    }
    dir
}

fn stamps_ns(recording: &Recording) -> Vec<i64> {
    recording.features.iter().map(|feature| feature.stamp_ns).collect()
}

#[test]
fn counts_have_the_stamps_at_which_they_were_reached() {
    let stripes = "encoder,plate,x1_mm,z1_mm,x2_mm,z2_mm,sigma_mm\n475,0,0,0,9,0,0.1\n475,1,0,0,9,1,0.1\n";
    let dir = dataset(&[("encoder.csv", LOG), ("features.csv", FEATURES), ("stripes.csv", stripes)]);
    let recording = folder::read(dir.path()).unwrap();
    assert_eq!(stamps_ns(&recording), STAMPS_NS);
    assert_eq!(recording.stripes[1].stamp_ns, STAMPS_NS[0]);
    assert!(recording.inputs.contains_key("encoder.csv") && !recording.at_stops);
    for profiles in [
        "encoder,x_mm,z_mm\n475,0,1\n475,1,1\n300,0,1\n",
        "encoder,x0_mm,dx_mm,z0_mm\n475,0,1,1\n300,0,1,1\n",
    ] {
        let dir = dataset(&[("encoder.csv", LOG), ("profiles.csv", profiles)]);
        let content = folder::read_content(dir.path()).unwrap();
        let stamps: Vec<i64> = content.profiles.iter().map(|profile| profile.stamp_ns).collect();
        assert_eq!(stamps, [STAMPS_NS[0], STAMPS_NS[2]]);
    }
}

#[test]
fn an_imported_folder_has_stamps_in_the_place_of_counts() {
    let dir = dataset(&[("encoder.csv", LOG), ("features.csv", FEATURES)]);
    let file = |name: &str| dir.path().join(name);
    let import = CsvFolder {
        robot: file("robot.csv"),
        features: file("features.csv"),
        sensor: file("sensor.toml"),
        ..CsvFolder::default()
    };
    assert_eq!(stamps_ns(&import.read().unwrap().recording), STAMPS_NS);
}

#[test]
fn counts_without_a_time_are_refused_with_file_and_line() {
    let poses = "stop,x_mm,y_mm,z_mm,qw,qx,qy,qz\na,1,0,0,1,0,0,0\n";
    let back = LOG.replace("11,450", "11,550");
    for (tables, file, line, said) in [
        (&[("features.csv", FEATURES)][..], "features.csv", 1, "encoder.csv beside robot.csv"),
        (
            &[("encoder.csv", LOG), ("poses.csv", poses), ("features.csv", FEATURES)],
            "features.csv",
            1,
            "no poses.csv",
        ),
        (
            &[("encoder.csv", LOG), ("features.csv", "encoder,x_mm,z_mm\n475,1,2\n149,1,2\n")],
            "features.csv",
            3,
            "from 500 to 150",
        ),
        (
            &[("encoder.csv", LOG), ("features.csv", "encoder,x_mm,z_mm\n300,1,2\n475,1,2\n")],
            "features.csv",
            3,
            "in the order in which encoder.csv has them",
        ),
        (&[("encoder.csv", &back), ("features.csv", FEATURES)], "encoder.csv", 4, "one direction"),
        (
            &[("encoder.csv", "time_s,encoder\n10,5\n12,5\n"), ("features.csv", FEATURES)],
            "encoder.csv",
            0,
            "an encoder that moves",
        ),
        (
            &[("encoder.csv", "time_s,counts\n10,5\n12,6\n"), ("features.csv", FEATURES)],
            "encoder.csv",
            1,
            "counts",
        ),
    ] {
        let dir = dataset(tables);
        let error = folder::read(dir.path()).unwrap_err();
        let text = format!("{error} {}", error.hint());
        assert!(error.file.ends_with(file) && error.line.unwrap_or(0) == line, "{said}: {error:?}");
        assert!(text.contains(said), "{said}: {text}");
    }
}

#[test]
fn a_log_that_no_reading_needs_is_reported_as_ignored() {
    let stamped = "time_s,x_mm,z_mm\n10.5,1,2\n11,2,2\n";
    let profiles = "time_s,x_mm,z_mm\n10.5,0,1\n10.5,1,1\n";
    // A log that is not read cannot be wrong.
    for log in [LOG, "no table"] {
        for (name, table) in [("features.csv", stamped), ("profiles.csv", profiles)] {
            let dir = dataset(&[("encoder.csv", log), (name, table)]);
            let content = folder::read_content(dir.path()).unwrap();
            let ignored = |notes: &[String]| notes.iter().any(|note| note.contains("encoder.csv is ignored"));
            assert!(ignored(&content.notes), "{:?}", content.notes);
            assert!(!content.recording.inputs.contains_key("encoder.csv"));
            if name == "profiles.csv" {
                let file = FolderProfiles::of(dir.path()).unwrap().unwrap();
                let read = file.each(true, &mut |_| ControlFlow::Continue(())).unwrap();
                assert!(ignored(&read.notes), "{:?}", read.notes);
                assert_eq!(folder::read_without_profiles(dir.path()).unwrap().notes.len(), 0);
            }
        }
    }
    let dir = dataset(&[("encoder.csv", LOG), ("features.csv", FEATURES)]);
    assert_eq!(folder::read_content(dir.path()).unwrap().notes.len(), 0);
}

#[test]
fn sightings_may_have_counts() {
    let rows = "encoder,x_mm,y_mm,z_mm,qw,qx,qy,qz\n475,0,0,300,1,0,0,0\n300,0,0,310,1,0,0,0\n";
    let stamped =
        rows.replace("encoder", "time_s").replace("475", "10.5").replace("300,0,0,310", "11,0,0,310");
    for (rows, notes) in [(rows, 0), (&stamped, 1)] {
        let dir = dataset(&[("encoder.csv", LOG), ("sightings.csv", rows)]);
        fs::write(dir.path().join("sensor.toml"), "kind = \"poses\"\n").unwrap();
        let read = pose_folder::read(dir.path()).unwrap();
        let expected = if notes == 0 { STAMPS_NS[0] } else { 10_500_000_000 };
        assert_eq!((read.sightings[0].stamp_ns, read.notes.len()), (expected, notes), "{:?}", read.notes);
    }
}

#[test]
fn a_counter_of_16_bit_may_wrap() {
    let log = "time_s,encoder\n10,65000\n10.5,65300\n11,64\n11.5,364\n12,664\n";
    // 65 450 is half of the way from 65 300 to 65 600, which is shown as 64.
    let features = "encoder,x_mm,z_mm\n65300,1,2\n65450,2,2\n64,3,2\n214,3,2\n";
    let dir = dataset(&[("encoder.csv", log), ("features.csv", features)]);
    let expected = [10_500_000_000, 10_750_000_000, 11_000_000_000, 11_250_000_000];
    assert_eq!(stamps_ns(&folder::read(dir.path()).unwrap()), expected);
    // 30 000 counts a second come back within three seconds.
    let log: String = (0..7).map(|k| format!("{},{}\n", 10 + k, 30_000 * k % 65_536)).collect();
    let log = format!("time_s,encoder\n{log}");
    let dir = dataset(&[("encoder.csv", &log), ("features.csv", "encoder,x_mm,z_mm\n15000,1,2\n")]);
    let error = folder::read(dir.path()).unwrap_err();
    assert!(error.line == Some(2) && error.to_string().contains("3 times"), "{error}");
}
