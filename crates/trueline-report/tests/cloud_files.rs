//! Clouds are read back by others' readers.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::RowAccessor;
use std::fs::File;
use std::io;
use std::path::PathBuf;
use trueline_report::export::cloud::{CloudColumns, CloudForm, CloudPoint, write};

const ALL: CloudColumns = CloudColumns { intensity: true, sigma: true, frame: true };

fn points() -> Vec<CloudPoint> {
    let point = |k: u32| CloudPoint {
        in_base_m: [0.8 + 1e-4 * f64::from(k), -0.1, 0.25 - 2e-5 * f64::from(k)],
        exposed_ns: 1_700_000_000_000_000_000 + 1_000_000 * i64::from(k),
        intensity: Some(f64::from(k % 200)),
        sigma_m: Some(5e-5),
        frame: u64::from(k / 100),
    };
    (0..5000).map(point).collect()
}

fn written(form: CloudForm, ending: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("cloud.{ending}"));
    let file = File::options().read(true).write(true).create_new(true).open(&path).unwrap();
    let points = points();
    // In parts of odd lengths.
    write(&file, form, ALL, &mut |sink| {
        points.chunks(333).try_for_each(|part| sink.take(part)) as io::Result<()>
    })
    .unwrap();
    (folder, path)
}

#[test]
fn las_is_read_by_las() {
    let (_folder, path) = written(CloudForm::Las, "las");
    let mut reader = las::Reader::from_path(path).unwrap();
    let all = reader.read_all().unwrap();
    let read: Vec<las::Point> = all.points().map(|point| point.unwrap()).collect();
    assert_eq!(read.len(), 5000);
    for (read, point) in read.iter().zip(points()) {
        let at = [read.x, read.y, read.z];
        // Half a step of 1 µm.
        assert!(at.iter().zip(point.in_base_m).all(|(a, b)| (a - b).abs() < 0.6e-6));
        assert_eq!(f64::from(read.intensity), point.intensity.unwrap());
        assert!((read.gps_time.unwrap() - point.exposed_ns as f64 * 1e-9).abs() < 1e-6);
    }
}

#[test]
fn e57_is_read_by_e57() {
    let (_folder, path) = written(CloudForm::E57, "e57");
    let mut reader = e57::E57Reader::from_file(path).unwrap();
    let cloud = reader.pointclouds().remove(0);
    assert_eq!(cloud.records, 5000);
    let read = reader.pointcloud_simple(&cloud).unwrap().map(|point| point.unwrap());
    let mut count = 0;
    for (read, point) in read.zip(points()) {
        let e57::CartesianCoordinate::Valid { x, y, z } = read.cartesian else { panic!("a valid point") };
        assert_eq!([x, y, z], point.in_base_m);
        count += 1;
    }
    assert_eq!(count, 5000);
}

#[test]
fn parquet_is_read_by_parquet() {
    let (_folder, path) = written(CloudForm::Parquet, "parquet");
    let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
    let mut count = 0;
    for (row, point) in reader.get_row_iter(None).unwrap().zip(points()) {
        let row = row.unwrap();
        assert_eq!(row.get_long(0).unwrap(), point.exposed_ns);
        assert_eq!(row.get_long(1).unwrap(), point.frame as i64);
        assert!((row.get_double(2).unwrap() - point.in_base_m[0] * 1e3).abs() < 1e-9);
        assert!((row.get_double(6).unwrap() - 0.05).abs() < 1e-12);
        count += 1;
    }
    assert_eq!(count, 5000);
}

#[test]
fn ply_and_pcd_state_their_points() {
    for (form, ending, end, width) in
        [(CloudForm::Ply, "ply", "end_header\n", 44), (CloudForm::Pcd, "pcd", "DATA binary\n", 32)]
    {
        let (_folder, path) = written(form, ending);
        let bytes = std::fs::read(path).unwrap();
        let at = bytes.windows(end.len()).position(|window| window == end.as_bytes()).unwrap() + end.len();
        assert_eq!(bytes.len() - at, 5000 * width);
        let header = String::from_utf8(bytes[..at].to_vec()).unwrap();
        assert!(header.lines().any(|line| line.ends_with(" 5000")), "{header}");
    }
}
