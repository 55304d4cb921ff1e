//! Workbooks and MATLAB files that other programs wrote (`fixtures/make_fixtures.py`), as a user imports them.
#![cfg(feature = "foreign-tables")]

use std::fs;
use std::path::{Path, PathBuf};
use trueline_dataset::import::csv_folder::{CsvFolder, Imported};
use trueline_dataset::import::foreign_csv::ColumnMapping;
use trueline_dataset::import::robot_layout::RobotLayout;
use trueline_dataset::{Error, Measured};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

fn map(names: &[(&str, &str)]) -> Vec<ColumnMapping> {
    let mapping = |(ours, theirs): &(&str, &str)| ColumnMapping {
        ours: (*ours).to_owned(),
        theirs: (*theirs).to_owned(),
    };
    names.iter().map(mapping).collect()
}

fn read(robot: PathBuf, features: PathBuf, layout: Option<&str>) -> Result<Imported, Error> {
    let folder = tempfile::tempdir().unwrap();
    let sensor = folder.path().join("sensor.toml");
    fs::write(&sensor, "kind = \"profiler\"\n").unwrap();
    CsvFolder {
        robot,
        features,
        profiles: None,
        sensor,
        robot_map: Vec::new(),
        features_map: map(&[("time_s", "seam_1"), ("x_mm", "seam_2"), ("z_mm", "seam_3")]),
        layout: layout.map(|name| RobotLayout::named(name).unwrap()),
        ..CsvFolder::default()
    }
    .read()
}

/// The formulas of the fixtures; decimal text and doubles lose nothing at these numbers but the last digit.
fn check(imported: &Imported) {
    assert_eq!((imported.recording.robot.len(), imported.recording.features.len()), (12, 10));
    for (k, sample) in imported.recording.robot.iter().enumerate() {
        let n = k as f64;
        assert_eq!(sample.stamp_ns, 1_000_000_000 + 10_000_000 * k as i64);
        let p = sample.base_from_tool.translation.vector;
        let off = [p.x - (0.5 + n * 1e-3), p.y - (-0.02 - n * 0.25e-3), p.z - 0.3];
        assert!(off.iter().all(|off| off.abs() < 1e-12) && sample.base_from_tool.rotation.angle() < 1e-12);
    }
    for (k, feature) in imported.recording.features.iter().enumerate() {
        let Measured::Profile([x, z]) = feature.measured else { panic!("a profiler") };
        assert!((x - k as f64 * 1e-3).abs() < 1e-12 && (z - 0.2 - k as f64 * 0.5e-3).abs() < 1e-12);
    }
}

#[test]
fn a_workbook_of_excel_is_a_table_and_its_sheet_is_named() {
    let imported = read(fixture("robot.xlsx"), fixture("log_v7.mat"), Some("kuka")).unwrap();
    check(&imported);
    let said = imported.notes.join("\n");
    for words in ["sheet `Messung`, the first of 2", "not used: Bemerkung", "KUKA"] {
        assert!(said.contains(words), "{words}: {said}");
    }
}

#[test]
fn vectors_of_matlab_are_columns_and_its_matrices_are_mapped() {
    for name in ["log_v5.mat", "log_v7.mat"] {
        let imported = read(fixture(name), fixture(name), None).unwrap();
        check(&imported);
        assert!(
            imported.notes.iter().any(|note| note.contains("10 rows of seam_1, seam_2, seam_3")),
            "{name}"
        );
    }
}

#[test]
fn what_cannot_be_read_is_told_with_a_way_out() {
    // A date is no number of seconds since anything.
    let error = read(fixture("dated.xlsx"), fixture("log_v7.mat"), None).unwrap_err();
    assert!(
        error.to_string().contains("line 2, column `time_s`: expected a number, found `a date`"),
        "{error}"
    );
    let folder = tempfile::tempdir().unwrap();
    let newer = folder.path().join("new.mat");
    fs::write(&newer, "MATLAB 7.3 MAT-file, Platform: GLNXA64").unwrap();
    let error = read(newer, fixture("log_v7.mat"), None).unwrap_err();
    assert!(
        error.to_string().contains("MATLAB file of version 7.3") && error.hint().contains("-v7"),
        "{error}"
    );
    let broken = folder.path().join("broken.xlsx");
    fs::write(&broken, &fs::read(fixture("robot.xlsx")).unwrap()[..400]).unwrap();
    assert!(read(broken, fixture("log_v7.mat"), None).unwrap_err().to_string().contains("workbook"));
}
