//! `trueline cloud`: every point of a recording in base, as a file.

use crate::common;

use common::{code, trueline, words};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const TIME_OFFSET_S: f64 = 0.020;
const SPEED_MM_S: f64 = 100.0;
/// The plate rises by so much along the scan.
const SLOPE: f64 = 0.5;
const COLUMNS: usize = 60;
const PROFILES: usize = 380;
/// Time between profiles, s.
const FRAME_S: f64 = 0.01;
/// Length of a pass, s.
const PASS_S: f64 = 2.0;

/// The tool's place along the scan, mm: forth, and back.
fn along_mm(time_s: f64) -> f64 {
    SPEED_MM_S * if time_s < PASS_S { time_s } else { 2.0 * PASS_S - time_s }
}

/// A robot that looks down onto a sloping plate, z = x/2, keeps its height and has its stripe across the way; frames that are stamped
/// late. No noise, no seam.
fn write_scan(folder: &Path) {
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("sensor.toml"), "kind = \"profiler\"\n").unwrap();
    fs::write(
        folder.join("truth.toml"),
        format!(
            "time_offset_s = {TIME_OFFSET_S}\n[tool_from_camera]\ntranslation_mm = [0, 0, 0]\nrotation_wxyz = [0.7071067811865476, 0, 0, 0.7071067811865476]\n"
        ),
    )
    .unwrap();
    let mut robot = String::from("time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n");
    for k in 0..=1000 {
        let time_s = 0.004 * f64::from(k);
        writeln!(robot, "{time_s:.6},{:.6},0,500,0,1,0,0", along_mm(time_s)).unwrap();
    }
    fs::write(folder.join("robot.csv"), robot).unwrap();
    let mut profiles = String::from("time_s,frame,x_mm,z_mm,intensity\n");
    for k in 0..PROFILES {
        let exposed_s = 0.1 + FRAME_S * k as f64;
        let range_mm = 500.0 - SLOPE * along_mm(exposed_s);
        for column in 0..COLUMNS {
            let x_mm = 0.2 * column as f64;
            let stamp_s = exposed_s + TIME_OFFSET_S;
            let intensity = 100 + column;
            writeln!(profiles, "{stamp_s:.6},{k},{x_mm:.6},{range_mm:.6},{intensity}").unwrap();
        }
    }
    fs::write(folder.join("profiles.csv"), profiles).unwrap();
}

/// The header of a PLY file, and its rows of bytes.
fn ply(file: &Path) -> (String, Vec<Vec<u8>>) {
    let bytes = fs::read(file).unwrap();
    let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8(bytes[..end].to_vec()).unwrap();
    let count: usize =
        header.lines().find_map(|line| line.strip_prefix("element vertex ")).unwrap().trim().parse().unwrap();
    let width = (bytes.len() - end) / count;
    assert_eq!((bytes.len() - end) % count, 0);
    (header, bytes[end..].chunks(width).map(<[u8]>::to_vec).collect())
}

fn double(row: &[u8], index: usize) -> f64 {
    f64::from_le_bytes(row[8 * index..8 * index + 8].try_into().unwrap())
}

/// Every point of both passes is on the plate, to robot.csv's six decimals. Without the time offset the passes are 2 v t_d
/// sin θ apart: 2 · 100 mm/s · 20 ms · 0.447 = 1.789 mm. With equally many points in both, the cloud is half as thick.
#[test]
fn a_plate_scanned_forth_and_back_is_one_plate() {
    let dir = tempfile::tempdir().unwrap();
    write_scan(&dir.path().join("scan"));
    let cloud = "cloud scan --calibration scan/truth.toml --out cloud.ply --frame --thickness";
    let output = trueline(dir.path(), &cloud.split(' ').collect::<Vec<_>>());
    assert_eq!(code(&output), 0, "{}", words(&output));
    let said = words(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains("22800 points of 380 frames in base"), "{said}");
    assert!(said.contains("with the time offset: 0.000 mm thick, passes 0.000 mm apart"), "{said}");
    let (_, without) = said.split_once("without it: ").unwrap();
    let (thick_mm, apart) = without.split_once(" mm thick, ").unwrap();
    assert!(apart.starts_with("passes 1.789 mm apart"), "{said}");
    // With a share p of a patch's points in one pass d √(p (1 − p)): between 0.43 d (a quarter) and half of d.
    assert!((0.43 * 1.789..0.5 * 1.790).contains(&thick_mm.parse::<f64>().unwrap()), "{said}");
    let (header, rows) = ply(&dir.path().join("cloud.ply"));
    assert!(header.contains("property float intensity\nproperty uint frame\n"), "{header}");
    assert_eq!(rows.len(), PROFILES * COLUMNS);
    for (k, row) in rows.iter().enumerate() {
        let [x_m, y_m, z_m, time_s] = [0, 1, 2, 3].map(|index| double(row, index));
        let across_m = 0.2e-3 * (k % COLUMNS) as f64;
        assert!((z_m - SLOPE * x_m).abs() < 2e-9 && (y_m + across_m).abs() < 1e-9, "{x_m} {y_m} {z_m}");
        assert!((time_s - (0.1 + FRAME_S * (k / COLUMNS) as f64)).abs() < 1e-9);
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2, "nothing is left beside the cloud");
}

/// All forms hold as many points; a point has the size of its columns.
#[test]
fn each_form_is_written() {
    let dir = tempfile::tempdir().unwrap();
    write_scan(&dir.path().join("scan"));
    for form in ["pcd", "las", "e57", "parquet"] {
        let file = format!("cloud.{form}");
        let output = trueline(dir.path(), &["cloud", "scan", "-c", "scan/truth.toml", "-o", &file, "-q"]);
        assert_eq!((code(&output), words(&output)), (0, String::new()), "{form}");
        let written = fs::read(dir.path().join(&file)).unwrap();
        // Parquet packs what repeats: columns of an even plate are a few kB.
        let is_whole = if form == "parquet" { written.ends_with(b"PAR1") } else { written.len() > 22_800 };
        assert!(is_whole, "{form}: {} bytes", written.len());
    }
    let pcd = fs::read(dir.path().join("cloud.pcd")).unwrap();
    let end = pcd.windows(12).position(|window| window == b"DATA binary\n").unwrap() + 12;
    assert_eq!(pcd.len() - end, 22_800 * 24);
    assert!(String::from_utf8_lossy(&pcd[..end]).contains("\nPOINTS 22800\n"));
}

/// A message for each frame, at its exposure, and the same points as in the other forms; and the report has both thicknesses.
#[test]
fn viewers_of_recordings_read_it_frame_by_frame_and_the_report_shows_a_patch() {
    let dir = tempfile::tempdir().unwrap();
    write_scan(&dir.path().join("scan"));
    let line = "cloud scan -c scan/truth.toml -o cloud.mcap --frame --report cloud.html -q";
    let output = trueline(dir.path(), &line.split(' ').collect::<Vec<_>>());
    assert_eq!((code(&output), words(&output)), (0, String::new()));
    let cloud = fs::read(dir.path().join("cloud.mcap")).unwrap();
    let (magic, name) = (b"\x89MCAP0\r\n", b"foxglove.PointCloud");
    assert!(cloud.starts_with(magic) && cloud.ends_with(magic));
    assert!(cloud.windows(name.len()).any(|window| window == name));
    // Five doubles a point: x, y, z, intensity, frame.
    let least = PROFILES * COLUMNS * 5 * 8;
    assert!((least..least + 400 * PROFILES).contains(&cloud.len()), "{}", cloud.len());
    let report = fs::read_to_string(dir.path().join("cloud.html")).unwrap();
    for wanted in
        ["0.000 mm apart with the time offset, and 1.789 mm without it", "patch-with", "patch-without"]
    {
        assert!(report.contains(wanted), "{wanted}");
    }
}

#[test]
fn seam_points_are_where_apply_puts_them() {
    let dir = tempfile::tempdir().unwrap();
    let run = |line: &str| {
        let output = trueline(dir.path(), &line.split(' ').collect::<Vec<_>>());
        assert_eq!(code(&output), 0, "{line}: {}", words(&output));
    };
    run("simulate --preset quick --out scan --quiet");
    run("apply scan --calibration scan/truth.toml --out seam.csv --quiet");
    run("cloud scan --calibration scan/truth.toml --out cloud.ply --quiet");
    let (_, rows) = ply(&dir.path().join("cloud.ply"));
    let text = fs::read_to_string(dir.path().join("seam.csv")).unwrap();
    assert_eq!(text.lines().count() - 1, rows.len());
    for (line, row) in text.lines().skip(1).zip(&rows) {
        for (cell, index) in line.split(',').skip(3).zip(0..) {
            // Six decimals of a millimetre.
            assert!((cell.parse::<f64>().unwrap() * 1e-3 - double(row, index)).abs() < 1e-9, "{line}");
        }
    }
}

#[test]
fn what_cannot_be_written_is_refused_before_anything_is_there() {
    let dir = tempfile::tempdir().unwrap();
    write_scan(&dir.path().join("scan"));
    for (line, told) in [
        ("cloud scan -c scan/truth.toml -o cloud.xyz", "expected a file that ends in one of .ply"),
        ("cloud scan -c scan/truth.toml -o cloud.ply --sigma", "states no covariance"),
        ("cloud scan -c scan/truth.toml -o cloud.las --frame", "has no place for it"),
        ("cloud scan -c scan/truth.toml -o nowhere/cloud.ply", "there is no folder `nowhere`"),
        ("cloud nothing -c scan/truth.toml -o cloud.ply", "there is no file or folder `nothing`"),
    ] {
        let output = trueline(dir.path(), &line.split(' ').collect::<Vec<_>>());
        assert_eq!(code(&output), 2, "{line}");
        assert!(words(&output).contains(told), "{line}: {}", words(&output));
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}
