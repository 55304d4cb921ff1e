//! `poses.csv`: readings that name their stop in the place of a stamp.

use std::fs;
use std::path::Path;
use trueline_dataset::{Measured, Recording, folder, images};

const POSES: &str = "stop,x_mm,y_mm,z_mm,qw,qx,qy,qz\n\
                     a,1,0,0,1,0,0,0\n\
                     b,2,0,0,1,0,0,0\n\
                     c,3,0,0,1,0,0,0\n";

fn dataset(tables: &[(&str, &str)]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("sensor.toml"), "kind = \"profiler\"\n").unwrap();
    for (name, text) in tables {
        let file = dir.path().join(name);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(file, text).unwrap();
    }
    dir
}

fn x_of_tool_mm(recording: &Recording, stamp_ns: i64) -> f64 {
    let sample = recording.robot.iter().find(|sample| sample.stamp_ns == stamp_ns).unwrap();
    sample.base_from_tool.translation.x * 1e3
}

#[test]
fn readings_in_any_order_have_the_pose_of_their_stop() {
    let features = "stop,x_mm,z_mm,line\nc,30,1,0\na,10,1,0\nb,20,1,0\na,11,1,1\nb,21,1,1\nc,31,1,1\n";
    let dir = dataset(&[("poses.csv", POSES), ("features.csv", features)]);
    let recording = folder::read(dir.path()).unwrap();
    assert!(recording.at_stops && recording.inputs.contains_key("poses.csv"));
    assert_eq!(recording.features.len(), 6);
    assert!(recording.features.is_sorted_by_key(|feature| feature.stamp_ns));
    for feature in &recording.features {
        let Measured::Profile([x_m, _]) = feature.measured else { panic!() };
        // Readings at stop k have 10 k + line.
        let stop = x_of_tool_mm(&recording, feature.stamp_ns);
        assert!((x_m * 1e3 - 10.0 * stop - f64::from(feature.line)).abs() < 1e-9);
    }
    // A stripe and a profile name it in the same way.
    let stripes = "stop,plate,x1_mm,z1_mm,x2_mm,z2_mm,sigma_mm\nb,0,0,0,9,0,0.1\na,0,0,0,9,0,0.1\n\
                   a,1,0,0,9,1,0.1\nc,0,0,0,9,0,0.1\n";
    let dir = dataset(&[("poses.csv", POSES), ("features.csv", features), ("stripes.csv", stripes)]);
    assert_eq!(folder::read(dir.path()).unwrap().stripes.len(), 4);
    let profiles = "stop,x_mm,z_mm\nb,0,1\nb,1,1\na,0,1\nc,0,1\n";
    let dir = dataset(&[("poses.csv", POSES), ("profiles.csv", profiles)]);
    let content = folder::read_content(dir.path()).unwrap();
    assert!(content.recording.at_stops);
    assert_eq!(content.profiles.iter().map(|profile| profile.points.len()).collect::<Vec<_>>(), [1, 2, 1]);
}

#[test]
fn stops_that_do_not_pair_are_refused_with_their_place() {
    let good = "stop,x_mm,z_mm\na,0,1\nb,0,1\nc,0,1\n";
    let twice = POSES.replace("c,3", "a,3");
    for (poses, features, file, line, said) in [
        (
            POSES,
            "stop,x_mm,z_mm\na,0,1\nb,0,1\nd,0,1\n",
            "features.csv",
            Some(4),
            "a stop of poses.csv, found d",
        ),
        (POSES, "stop,x_mm,z_mm\na,0,1\nb,0,1\n", "poses.csv", Some(4), "a stop that has a reading, found c"),
        (twice.as_str(), good, "poses.csv", Some(4), "each of them once, found a"),
        (POSES, "time_s,x_mm,z_mm\n1,0,1\n", "features.csv", Some(1), "names the stop of each row"),
        (&POSES.replace(",qz", ""), good, "poses.csv", Some(1), "q"),
    ] {
        let dir = dataset(&[("poses.csv", poses), ("features.csv", features)]);
        let error = folder::read(dir.path()).unwrap_err();
        assert_eq!(error.file, dir.path().join(file), "{error}");
        assert_eq!(error.line, line, "{error}");
        assert!(error.to_string().contains(said) && !error.hint().is_empty(), "{error}");
    }
    // Stops without poses.
    let robot = "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n1,1,0,0,1,0,0,0\n";
    let dir = dataset(&[("robot.csv", robot), ("features.csv", good)]);
    let error = folder::read(dir.path()).unwrap_err();
    assert!(error.to_string().contains("poses.csv"), "{error}");
}

#[test]
fn pictures_of_stops_lie_beside_their_poses_or_in_images() {
    let poses = POSES.replace("stop", "picture").replace("a,1", "a.png,1");
    let poses = poses.replace("b,2", "images/b.png,2").replace("c,3", "c.png,3");
    let files = [("poses.csv", poses.as_str()), ("a.png", ""), ("images/b.png", ""), ("images/c.png", "")];
    let dir = dataset(&files);
    assert!(images::are_named_in(dir.path()).unwrap());
    let frames = images::read_index(dir.path()).unwrap();
    let names: Vec<&Path> = frames.iter().map(|frame| frame.path.strip_prefix(dir.path()).unwrap()).collect();
    assert_eq!(names, [Path::new("a.png"), Path::new("images/b.png"), Path::new("images/c.png")]);
    let dir = dataset(&files[..3]);
    let error = images::read_index(dir.path()).unwrap_err();
    assert!(error.line == Some(4) && error.to_string().contains("c.png"), "{error}");
}

#[test]
fn features_that_are_found_at_stops_are_written_with_their_names() {
    let features = "stop,x_mm,z_mm\na,10,1\nb,20,1\nc,30,1\n";
    let dir = dataset(&[("poses.csv", POSES), ("features.csv", features)]);
    let recording = folder::read(dir.path()).unwrap();
    folder::replace_features(dir.path(), &recording.features).unwrap();
    assert_eq!(fs::read_to_string(dir.path().join("features.csv")).unwrap(), features);
    assert_eq!(folder::read(dir.path()).unwrap().features, recording.features);
}
