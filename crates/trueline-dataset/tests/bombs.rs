//! Small or endless files that would fill the memory.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use peak_alloc::PeakAlloc;
use std::fs;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use trueline_dataset::{folder, gray_picture, gray_png};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The allocator counts for all threads: one test at a time.
static ALONE: Mutex<()> = Mutex::new(());

const MB: usize = 1 << 20;

/// What was said, and the memory that it took at most, bytes.
fn refused<T>(read: impl FnOnce() -> Result<T, trueline_dataset::Error>) -> (String, usize) {
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    let said = read().err().expect("it is refused").to_string();
    (said, MEMORY.peak_usage() - before)
}

/// A gray PNG that claims to be of that size and has next to no pixels.
fn lying_png(side: u32) -> Vec<u8> {
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, side, side);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let mut writer = encoder.write_header().unwrap();
    writer.write_chunk(png::chunk::IDAT, &[0x78, 0x9c, 0x03, 0, 0, 0, 0, 1]).unwrap();
    drop(writer);
    png
}

#[test]
fn a_picture_that_is_larger_than_its_file_can_hold_is_refused_before_it_is_decoded() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.png");
    let bytes = lying_png(16_384);
    fs::write(&file, &bytes).unwrap();
    assert!(bytes.len() < 200);
    for (said, peak) in
        [refused(|| gray_png::read(&file, &mut Vec::new())), refused(|| gray_picture::decode(&file, &bytes))]
    {
        assert!(said.contains("16384 x 16384 pixels do not come out of"), "{said}");
        assert!(peak < MB, "{peak} bytes");
    }
}

fn dataset() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("sensor.toml"), "kind = \"profiler\"\n").unwrap();
    fs::write(folder.path().join("features.csv"), "time_s,x_mm,z_mm\n0,0,100\n").unwrap();
    fs::write(folder.path().join("robot.csv"), "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n")
        .unwrap();
    folder
}

#[test]
fn a_table_that_is_one_endless_line_is_refused_before_it_is_copied() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = dataset();
    let long = format!("time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,{}", "1".repeat(30 * MB));
    fs::write(folder.path().join("robot.csv"), &long).unwrap();
    let (said, peak) = refused(|| folder::read(folder.path()));
    assert!(said.contains("robot.csv, line 2: is a line of more than a megabyte"), "{said}");
    assert!(peak < long.len() * 2 + 2 * MB, "{peak} bytes");
}

#[test]
fn long_tables_of_short_lines_are_read() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = dataset();
    let rows = (0..60_000).map(|k| format!("{k},1,2,3,1,0,0,0\n"));
    let text: String =
        std::iter::once("time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n".to_owned()).chain(rows).collect();
    assert!(text.len() > MB);
    fs::write(folder.path().join("robot.csv"), text).unwrap();
    assert_eq!(folder::read(folder.path()).unwrap().robot.len(), 60_000);
}

#[cfg(unix)]
#[test]
fn devices_and_pipes_are_no_files() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    for name in ["robot.csv", "sensor.toml", "features.csv"] {
        let folder = dataset();
        let file = folder.path().join(name);
        fs::remove_file(&file).unwrap();
        std::os::unix::fs::symlink("/dev/zero", &file).unwrap();
        let (said, peak) = refused(|| folder::read(folder.path()));
        assert!(said.contains("is a pipe, a socket or a device"), "{name}: {said}");
        assert!(peak < MB, "{name}: {peak} bytes");
    }
    let (said, _) = refused(|| gray_png::read(Path::new("/dev/zero"), &mut Vec::new()));
    assert!(said.contains("is a pipe, a socket or a device"), "{said}");
    let (said, _) = refused(|| gray_png::read(&std::env::temp_dir(), &mut Vec::new()));
    assert!(said.contains("is a folder"), "{said}");
}
