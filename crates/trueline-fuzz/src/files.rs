//! Files that a user names.

use std::path::Path;
use trueline_dataset::import::foreign_csv::{self, Renaming, TableForm};
use trueline_dataset::import::profiles::{self, ProfileFormat, ply};
use trueline_dataset::import::robot_layout::RobotLayout;
use trueline_dataset::import::tables_of_programs;
use trueline_dataset::result_file::ResultFile;
use trueline_dataset::{
    Error, Sensor, cad_file, dialect, features_csv, gray_picture, known_toml, profiles_csv, profiles_parquet,
    robot_csv, sensor_toml, stripes_csv,
};
use trueline_live::motion::{CheckedPath, limits_file};
use trueline_plan::cell_toml;

/// File name in errors.
const FILE: &str = "file";

/// The author of the file must be able to act on a refusal.
fn said<T>(read: Result<T, Error>) -> Option<T> {
    read.inspect_err(|error| assert!(!error.to_string().is_empty() && !error.hint().is_empty())).ok()
}

pub(crate) fn robot_csv(bytes: &[u8]) {
    for sample in said(robot_csv::read(Path::new(FILE), bytes)).unwrap_or_default() {
        let pose = sample.base_from_tool;
        assert!(pose.translation.vector.iter().all(|x| x.is_finite()), "a pose that is no pose");
        assert!((pose.rotation.norm() - 1.0).abs() < 1e-9, "a rotation that is none");
    }
}

pub(crate) fn features_csv(bytes: &[u8]) {
    for sensor in [Sensor::Profiler, Sensor::Points { laser_plane_in_camera: None }] {
        said(features_csv::read(Path::new(FILE), bytes, &sensor));
    }
}

pub(crate) fn profiles_csv(bytes: &[u8]) {
    said(profiles_csv::read(Path::new(FILE), bytes));
}

pub(crate) fn stripes_csv(bytes: &[u8]) {
    said(stripes_csv::read(Path::new(FILE), bytes, &Sensor::Profiler));
}

pub(crate) fn foreign_table(bytes: &[u8]) {
    if let Some((plain, _)) = said(dialect::plain_csv(Path::new(FILE), bytes.to_vec(), None)) {
        said(robot_csv::read(Path::new(FILE), plain.as_slice()));
    }
    // As the log of a KUKA robot: clock, names and poses in cells are recognised.
    let layout = RobotLayout::named("kuka");
    let renaming = Renaming { map: &[], layout: layout.as_ref(), is_ours: &|name| name.ends_with("_s") };
    let table = said(foreign_csv::read(Path::new(FILE), bytes.to_vec(), &TableForm::default(), &renaming));
    if let Some(table) = table {
        said(robot_csv::read(Path::new(FILE), table.csv.as_slice()));
    }
}

pub(crate) fn dxf(bytes: &[u8]) {
    if let Some(curve) = said(cad_file::parse_dxf(Path::new(FILE), bytes)) {
        assert!(
            curve.points().iter().all(|point| point.iter().all(|x| x.is_finite())),
            "a point that is none"
        );
    }
}

/// Workbooks and files of MATLAB become text, bounded by their content.
pub(crate) fn table_of_program(bytes: &[u8]) {
    let mut notes = Vec::new();
    let text = said(tables_of_programs::as_text(Path::new(FILE), bytes.to_vec(), &|_| 1, &mut notes));
    assert!(text.is_none_or(|text| text.bytes.len() <= (64 << 20) + 1000 * bytes.len()), "text without end");
}

pub(crate) fn profiles_parquet(bytes: &[u8]) {
    said(profiles_parquet::read(Path::new(FILE), bytes.to_vec()));
}

/// The first byte chooses a maker's format.
pub(crate) fn foreign_profiles(bytes: &[u8]) {
    let Some((&choice, text)) = bytes.split_first() else { return };
    let formats = ProfileFormat::ALL;
    let (_, format) = formats[usize::from(choice) % formats.len()];
    said(profiles::read(Path::new(FILE), text.to_vec(), format, None));
}

/// The limits of a motion and a path, parted by a byte of zero.
pub(crate) fn plan(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let (limits, path) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    let Ok(limits) = limits_file::parse(Path::new(FILE), &String::from_utf8_lossy(limits)) else { return };
    let Some(samples) = said(robot_csv::read(Path::new(FILE), path)) else { return };
    if let Ok(checked) = CheckedPath::new(&samples, 1.0, &limits) {
        for k in 0..=20 {
            let pose = checked.at(checked.duration_s() * f64::from(k) / 20.0).base_from_tool;
            // The path was checked between its samples as well; only rounding may exceed the limits.
            assert!(limits.in_box(&pose.translation.vector, 1e-9), "a path outside its box");
        }
    }
}

pub(crate) fn sensor_toml(bytes: &[u8]) {
    said(sensor_toml::parse_file(Path::new(FILE), &String::from_utf8_lossy(bytes)));
}

pub(crate) fn guess_toml(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    said(known_toml::parse_guess(Path::new(FILE), &text));
    said(known_toml::parse_truth(Path::new(FILE), &text));
}

pub(crate) fn limits_toml(bytes: &[u8]) {
    let read = limits_file::parse(Path::new(FILE), &String::from_utf8_lossy(bytes));
    assert!(read.is_ok_or_says());
}

pub(crate) fn cell_toml(bytes: &[u8]) {
    let read = cell_toml::parse(Path::new(FILE), &String::from_utf8_lossy(bytes), Sensor::Profiler);
    assert!(read.is_ok_or_says());
}

pub(crate) fn result_json(bytes: &[u8]) {
    if let Some(result) = said(ResultFile::parse(Path::new(FILE), &String::from_utf8_lossy(bytes))) {
        assert!(result.to_json().is_ok(), "what was read can be written");
    }
}

pub(crate) fn picture(bytes: &[u8]) {
    if let Some(picture) = said(gray_picture::decode(Path::new(FILE), bytes)) {
        assert_eq!(picture.levels_f32().len(), picture.width * picture.height);
    }
}

pub(crate) fn point_cloud(bytes: &[u8]) {
    said(ply::read(Path::new(FILE), bytes));
}

/// A value, or an error with a message.
trait Said {
    fn is_ok_or_says(&self) -> bool;
}

impl<T, E: std::fmt::Display> Said for Result<T, E> {
    fn is_ok_or_says(&self) -> bool {
        self.as_ref().err().is_none_or(|error| !error.to_string().is_empty())
    }
}
