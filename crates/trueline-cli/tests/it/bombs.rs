//! Files of strangers that would fill the memory or never end: the program refuses each with a sentence, in little time, within a limit
//! that the operating system sets on its memory.
#![cfg(target_os = "linux")]

use crate::common;

use common::trueline;
use std::fs;
use std::io::Write;
use std::os::unix::fs::symlink;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Memory that the program may write to, kB: a chunk of MCAP may be 64 MB and is there packed and unpacked; stacks of threads count.
const LIMIT_KB: u32 = 300_000;
/// All of these take less than a second; a machine that does much else besides is slower.
const PATIENCE: Duration = Duration::from_secs(60);

fn limited(folder: &Path, limit_kb: u32, line: &str) -> Output {
    let mut child = Command::new("sh")
        .args(["-c", &format!("ulimit -d {limit_kb} && exec \"$@\""), "sh", env!("CARGO_BIN_EXE_trueline")])
        .args(line.split(' '))
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begin.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("`{line}` did not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

/// The program's refusals.
fn refused(folder: &Path, line: &str) -> String {
    let output = limited(folder, LIMIT_KB, line);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "`{line}`, signal {:?}: {said}", output.status.signal());
    assert!(said.contains("error: ") && said.contains("hint: "), "`{line}`: {said}");
    assert!(!said.contains("out of memory"), "`{line}`: {said}");
    said
}

/// A folder with a scan, a result, a planned path and limits.
fn place() -> tempfile::TempDir {
    let place = tempfile::tempdir().unwrap();
    for line in [
        "simulate --preset quick --out scan --quiet",
        "calibrate scan --json result.json --quiet",
        "plan --example --out plan --tries 20 --quiet",
        "scan plan --write-limits limits.toml",
    ] {
        assert_eq!(
            trueline(place.path(), &line.split(' ').collect::<Vec<_>>()).status.code(),
            Some(0),
            "{line}"
        );
    }
    place
}

#[test]
fn the_limit_holds_and_suffices_for_good_files() {
    let place = place();
    assert_eq!(limited(place.path(), LIMIT_KB, "calibrate scan --quiet").status.code(), Some(0));
    // With less than it needs the program ends otherwise: the limit is one.
    assert_ne!(limited(place.path(), 2000, "calibrate scan --quiet").status.code(), Some(0));
}

#[test]
fn pipes_and_endless_devices_are_refused_whatever_they_are_named_for() {
    let place = place();
    let folder = place.path();
    symlink("/dev/zero", folder.join("zero")).unwrap();
    assert!(Command::new("mkfifo").arg(folder.join("pipe")).status().unwrap().success());
    for endless in ["zero", "pipe"] {
        for line in [
            "calibrate scan --initial ENDLESS",
            "evaluate scan --calibration ENDLESS",
            "evaluate scan --calibration result.json --reference ENDLESS",
            "diff ENDLESS result.json",
            "export ENDLESS --as kuka",
            "export result.json --as kalibr --sensor ENDLESS",
            "apply scan --calibration ENDLESS --out points.csv",
            "plan ENDLESS --out better",
            "plan plan/cell.toml --calibration ENDLESS --out better",
            "scan plan --limits ENDLESS",
            "scan ENDLESS --limits limits.toml",
            "robot-program abb ENDLESS --pc 127.0.0.1:6510 --out program",
            "robot-program kuka ENDLESS --pc 127.0.0.1:6510 --out programs",
            "robot-sim --pc 127.0.0.1:6510 --path ENDLESS --for-s 1",
            "record --replay scan --sensor ENDLESS --bind 127.0.0.1:6510 --out recorded --for-s 1",
            "watch --state cell.sqlite --calibration ENDLESS scan",
            "watch --state ENDLESS --calibration result.json scan",
            "history --state ENDLESS",
            "import mcap ENDLESS --out imported",
            "import rosbag2 ENDLESS --sensor scan/sensor.toml --out imported",
            "import tum ENDLESS --features scan/features.csv --sensor scan/sensor.toml --out imported",
            "sensor intrinsics ENDLESS --board chessboard:9x6:25",
        ] {
            let said = refused(folder, &line.replace("ENDLESS", endless));
            assert!(
                said.contains("is a pipe, a socket or a device") || said.contains("not a regular file"),
                "{line}: {said}"
            );
        }
        // In a folder that is named.
        for name in ["sensor.toml", "robot.csv", "features.csv", "initial.toml", "truth.toml"] {
            let dataset = folder.join(format!("with-{endless}-{name}"));
            fs::create_dir(&dataset).unwrap();
            for file in fs::read_dir(folder.join("scan")).unwrap().map(|entry| entry.unwrap().path()) {
                fs::copy(&file, dataset.join(file.file_name().unwrap())).unwrap();
            }
            let _ = fs::remove_file(dataset.join(name));
            fs::rename(folder.join(endless), dataset.join(name)).unwrap();
            let dataset_name = dataset.file_name().unwrap().to_str().unwrap();
            let said = refused(folder, &format!("calibrate {dataset_name}"));
            assert!(said.contains("is a pipe, a socket or a device"), "{name}: {said}");
            fs::rename(dataset.join(name), folder.join(endless)).unwrap();
        }
    }
}

#[test]
fn a_bag_whose_list_of_files_is_a_pipe_is_read_by_its_files() {
    let place = tempfile::tempdir().unwrap();
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../trueline-mcap/tests/fixtures/pose_mono8");
    let bag = place.path().join("bag");
    fs::create_dir(&bag).unwrap();
    for file in fs::read_dir(fixture).unwrap().map(|entry| entry.unwrap().path()) {
        let name = file.file_name().unwrap();
        if name != "metadata.yaml" {
            fs::copy(&file, bag.join(name)).unwrap();
        }
    }
    assert!(Command::new("mkfifo").arg(bag.join("metadata.yaml")).status().unwrap().success());
    // It has no sensor: that is as far as it gets.
    assert!(refused(place.path(), "import rosbag2 bag --out imported").contains("sensor"));
}

/// One of a hundred thousand levels in another, in every way that a file can say so.
#[test]
fn deep_nesting_is_refused_by_every_reader() {
    const DEEP: usize = 100_000;
    let place = place();
    let folder = place.path();
    let write = |name: &str, text: String| fs::write(folder.join(name), text).unwrap();
    let dotted = vec!["a"; DEEP].join(".");
    for toml in [
        format!("x = {}{}", "[".repeat(DEEP), "]".repeat(DEEP)),
        format!("x = {}", "{ a = ".repeat(DEEP)),
        format!("{dotted} = 1"),
        format!("[{dotted}]"),
        format!("[[{dotted}]]"),
    ] {
        write("deep.toml", toml);
        for line in [
            "calibrate scan --initial deep.toml",
            "scan plan --limits deep.toml",
            "plan deep.toml --out better",
            "export result.json --as kalibr --sensor deep.toml",
        ] {
            refused(folder, line);
        }
    }
    for json in ["[".repeat(DEEP), "{\"a\":".repeat(DEEP), format!("{{\"x\": {}", "[".repeat(DEEP))] {
        write("deep.json", json);
        for line in [
            "export deep.json --as kuka",
            "diff deep.json result.json",
            "apply scan -c deep.json --out p.csv",
        ] {
            refused(folder, line);
        }
    }
    let (open, close) = ("<link name=\"a\">".repeat(DEEP), "</link>".repeat(DEEP));
    write("deep.urdf", format!("<robot name=\"a\">{open}{close}</robot>"));
    let bag = Path::new(env!("CARGO_MANIFEST_DIR")).join("../trueline-mcap/tests/fixtures/joint_states");
    let options = "--urdf deep.urdf --tool tool0 --sensor scan/sensor.toml --out imported";
    refused(folder, &format!("import rosbag2 {} {options}", bag.display()));
}

/// A record of MCAP.
fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

/// A chunk that says it has so many bytes unpacked.
fn chunk(packed: &[u8], claimed: u64) -> Vec<u8> {
    let mut body =
        [[0; 16].as_slice(), &claimed.to_le_bytes(), &[0; 4], &4_u32.to_le_bytes(), b"zstd"].concat();
    body.extend((packed.len() as u64).to_le_bytes());
    body.extend(packed);
    record(0x06, &body)
}

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

fn mcap_of(records: &[Vec<u8>]) -> Vec<u8> {
    [MAGIC, &record(0x01, &[0; 8]), &records.concat(), &record(0x0f, &[0; 4]), &record(0x02, &[0; 20]), MAGIC]
        .concat()
}

#[test]
fn recordings_that_ask_for_more_than_they_have_are_refused() {
    let place = place();
    let folder = place.path();
    let channel = [&[0; 4][..], &1_u32.to_le_bytes(), b"a", &[0; 8]].concat();
    let unpacked_messages = [record(0x04, &channel), record(0x05, &[0; 22]).repeat(2_000_000)].concat();
    let messages = zstd::encode_all(unpacked_messages.as_slice(), 1).unwrap();
    let zeros = zstd::encode_all(vec![0; 200 << 20].as_slice(), 1).unwrap();
    let few = zstd::encode_all([0; 100].as_slice(), 1).unwrap();
    let four_gb = 0xffff_fff0_u32.to_le_bytes();
    for (what, records, most_bytes) in [
        ("a chunk that claims 4 GB", vec![chunk(&few, 0xffff_fff0)], 1200),
        ("a chunk that claims 16 EB", vec![chunk(&few, u64::MAX)], 1200),
        ("a topic of 4 GB", vec![record(0x04, &[&[0; 4][..], &four_gb].concat())], 1200),
        ("a schema of 4 GB", vec![record(0x03, &[&[1, 0][..], &four_gb].concat())], 1200),
        ("two million messages", vec![chunk(&messages, unpacked_messages.len() as u64)], 326_000),
        ("200 MB of nothing", vec![chunk(&zeros, 200 << 20)], 100_000),
        ("200 MB of nothing, said to be little", vec![chunk(&zeros, 1000)], 100_000),
    ] {
        let bytes = mcap_of(&records);
        assert!(bytes.len() < most_bytes, "{what}: {} bytes", bytes.len());
        fs::write(folder.join("bomb.mcap"), bytes).unwrap();
        for line in ["import mcap bomb.mcap --sensor scan/sensor.toml --out imported", "calibrate bomb.mcap"]
        {
            refused(folder, line);
        }
    }
    // A file of rosbag2 that is packed as a whole.
    let mut packed = zstd::Encoder::new(Vec::new(), 1).unwrap();
    packed.write_all(b"SQLite format 3\0").unwrap();
    for _ in 0..512 {
        packed.write_all(&[0; 1 << 20]).unwrap();
    }
    fs::write(folder.join("bomb.db3.zstd"), packed.finish().unwrap()).unwrap();
    refused(folder, "import rosbag2 bomb.db3.zstd --sensor scan/sensor.toml --out imported");
    assert!(!folder.join("imported").exists());
}

/// A gray PNG of so many pixels with the pixel data of a stranger.
fn png_with(side: u32, deflated: &[u8]) -> Vec<u8> {
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, side, side);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header().unwrap();
    writer.write_chunk(png::chunk::IDAT, deflated).unwrap();
    drop(writer);
    png
}

#[test]
fn pictures_and_tables_that_grow_are_refused() {
    let place = place();
    let folder = place.path();
    let mut deflate = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    for _ in 0..400 {
        deflate.write_all(&[0; 1 << 20]).unwrap();
    }
    let zeros = deflate.finish().unwrap();
    let header = [0x78, 0x9c, 0x03, 0, 0, 0, 0, 1];
    let bmp_header =
        [&b"BM\x46\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\xff\xff\0\0\xff\xff\0\0\x01\0\x18\0"[..], &[0; 24]]
            .concat();
    fs::create_dir(folder.join("pictures")).unwrap();
    for (name, bytes) in [
        ("header.png", png_with(60_000, &header)),
        ("zeros.png", png_with(20_000, &zeros)),
        ("small.png", png_with(8, &zeros)),
        ("header.bmp", bmp_header),
    ] {
        let file = folder.join("pictures").join(name);
        fs::write(&file, bytes).unwrap();
        refused(folder, "sensor intrinsics pictures --board chessboard:9x6:25");
        fs::remove_file(file).unwrap();
    }
    // One endless line, and a table that unpacks to 100 MB.
    fs::create_dir(folder.join("logs")).unwrap();
    let line = format!("time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,{}", "1".repeat(30 << 20));
    fs::write(folder.join("logs/robot.csv"), line).unwrap();
    fs::copy(folder.join("scan/features.csv"), folder.join("logs/features.csv")).unwrap();
    let import = "import csv logs --robot abb --sensor scan/sensor.toml --out imported";
    assert!(refused(folder, import).contains("a line of more than a megabyte"));
    let mut book = zip::ZipWriter::new(fs::File::create(folder.join("logs/robot.xlsx")).unwrap());
    for name in ["[Content_Types].xml", "xl/workbook.xml", "xl/worksheets/sheet1.xml"] {
        book.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        for _ in 0..100 {
            book.write_all(&[b' '; 1 << 20]).unwrap();
        }
    }
    book.finish().unwrap();
    refused(folder, &format!("{import} --robot-file robot.xlsx"));
    assert!(!folder.join("imported").exists());
}
