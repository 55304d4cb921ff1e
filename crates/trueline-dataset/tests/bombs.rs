//! Small or endless files that would fill the memory.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use peak_alloc::PeakAlloc;
use std::fs;
use std::io::{Cursor, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use trueline_dataset::import::tables_of_programs;
use trueline_dataset::{folder, gray_picture, gray_png};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The allocator counts for all threads: one test at a time.
static ALONE: Mutex<()> = Mutex::new(());

const MB: usize = 1 << 20;

/// The message, and the largest memory used, bytes.
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

#[cfg(feature = "parquet")]
mod as_parquet {
    use super::{ALONE, MB, Path, PoisonError, refused};
    use parquet::basic::{Compression, Repetition, Type, ZstdLevel};
    use parquet::data_type::DoubleType;
    use parquet::file::properties::WriterProperties;
    use parquet::file::writer::SerializedFileWriter;
    use std::sync::Arc;
    use trueline_dataset::profiles_parquet;

    /// A file of so many rows, all alike; each number for itself, or once in a dictionary with how often it comes.
    fn alike(rows: usize, once: bool) -> Vec<u8> {
        let field = |name| {
            let builder = parquet::schema::types::Type::primitive_type_builder(name, Type::DOUBLE);
            Arc::new(builder.with_repetition(Repetition::REQUIRED).build().unwrap())
        };
        let schema = parquet::schema::types::Type::group_type_builder("table")
            .with_fields(["time_s", "x_mm", "z_mm"].map(field).to_vec())
            .build()
            .unwrap();
        let settings = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_dictionary_enabled(once)
            .build();
        let mut out = Vec::new();
        let mut writer = SerializedFileWriter::new(&mut out, Arc::new(schema), Arc::new(settings)).unwrap();
        let mut group = writer.next_row_group().unwrap();
        let numbers = vec![1.0; rows];
        while let Some(mut column) = group.next_column().unwrap() {
            column.typed::<DoubleType>().write_batch(&numbers, None, None).unwrap();
            column.close().unwrap();
        }
        group.close().unwrap();
        writer.close().unwrap();
        out
    }

    #[test]
    fn a_parquet_file_that_unpacks_to_a_thousand_times_its_size_is_refused_before_that() {
        let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        for once in [true, false] {
            let bytes = alike(2_000_000, once);
            assert!(bytes.len() < 48_000_000 / 1000, "{}", bytes.len());
            let (said, peak) = refused(|| profiles_parquet::read(Path::new("profiles.parquet"), bytes));
            assert!(said.contains("claims 2000000 rows"), "{said}");
            assert!(peak < MB, "{peak} bytes");
        }
        // Profiles that are alike are read up to what little is always allowed.
        let few = profiles_parquet::read(Path::new("profiles.parquet"), alike(200_000, true)).unwrap();
        assert_eq!((few.len(), few[0].points.len()), (1, 200_000));
    }

    #[test]
    fn a_parquet_file_whose_counts_lie_fills_no_memory() {
        let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let whole = alike(1000, true);
        for at in 0..whole.len() {
            for byte in [0x7f, 0xfc, 0xff] {
                let mut altered = whole.clone();
                altered[at] = byte;
                peak_alloc_of(altered, at, byte);
            }
        }
    }

    fn peak_alloc_of(bytes: Vec<u8>, at: usize, byte: u8) {
        super::MEMORY.reset_peak_usage();
        let before = super::MEMORY.current_usage();
        let _ = profiles_parquet::read(Path::new("profiles.parquet"), bytes);
        let peak = super::MEMORY.peak_usage() - before;
        assert!(peak < 64 * MB, "byte {at} as {byte:#x}: {peak} bytes");
    }
}

/// A workbook of another program with one of its entries replaced.
fn workbook_with(entry: &str, content: &[u8]) -> Vec<u8> {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/robot.xlsx");
    let mut from = zip::ZipArchive::new(fs::File::open(fixture).unwrap()).unwrap();
    let mut to = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let mut replaced = false;
    for k in 0..from.len() {
        let mut old = from.by_index(k).unwrap();
        let name = old.name().unwrap().into_owned();
        to.start_file(&name, zip::write::SimpleFileOptions::default()).unwrap();
        if name == entry {
            to.write_all(content).unwrap();
            replaced = true;
        } else {
            std::io::copy(&mut old, &mut to).unwrap();
        }
    }
    assert!(replaced, "{entry}");
    to.finish().unwrap().into_inner()
}

fn refused_table(bytes: &[u8]) -> (String, usize) {
    let bytes = bytes.to_vec();
    refused(|| tables_of_programs::as_text(Path::new("robot"), bytes, &|_| 1, &mut Vec::new()))
}

/// Two cells in opposite corners are a rectangle of 1.7e10, which at 24 bytes each would be 400 GB.
#[test]
fn workbooks_with_cells_far_apart_are_refused_before_the_rectangle_is_built() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let sheet = br#"<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>
        <row r="1"><c r="A1"><v>1</v></c></row><row r="1048576"><c r="XFD1048576"><v>1</v></c></row>
        </sheetData></worksheet>"#;
    let (said, peak) = refused_table(&workbook_with("xl/worksheets/sheet1.xml", sheet));
    assert!(said.contains("2 of them in 1048576 rows and 16384 columns"), "{said}");
    assert!(peak < 4 * MB, "{peak} bytes");

    // LibreOffice says how often a row and a cell are repeated.
    let content =
        br#"<office:document-content><table:table><table:table-row table:number-rows-repeated="1000000">
        <table:table-cell office:value-type="float" office:value="1" table:number-columns-repeated="16000"/>
        </table:table-row></table:table></office:document-content>"#;
    let mut ods = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in
        [("mimetype", &b"application/vnd.oasis.opendocument.spreadsheet"[..]), ("content.xml", content)]
    {
        ods.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        ods.write_all(text).unwrap();
    }
    let (said, peak) = refused_table(&ods.finish().unwrap().into_inner());
    assert!(said.contains("1 of them in 1000000 rows and 16000 columns"), "{said}");
    assert!(peak < 4 * MB, "{peak} bytes");

    let (said, peak) = refused_table(&[0xd0, 0xcf, 0x11, 0xe0, 0xa1, 0xb1, 0x1a, 0xe1]);
    assert!(said.contains("save it as .xlsx") && peak < MB, "{said}");
}

/// 100 MB of blanks out of 100 kB.
#[test]
fn tables_that_grow_too_much_when_decompressed_are_refused() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let blanks = vec![b' '; 100 * MB];
    for entry in ["xl/worksheets/sheet1.xml", "xl/workbook.xml"] {
        let bomb = workbook_with(entry, &blanks);
        assert!(bomb.len() < MB);
        let (said, peak) = refused_table(&bomb);
        assert!(said.contains("grows too much"), "{entry}: {said}");
        assert!(peak < 4 * MB, "{entry}: {peak} bytes");
    }

    let mut matlab = b"MATLAB 5.0 MAT-file".to_vec();
    matlab.resize(124, b' ');
    matlab.extend([0, 1, b'I', b'M']);
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(&blanks).unwrap();
    let compressed = encoder.finish().unwrap();
    matlab.extend(15_u32.to_le_bytes());
    matlab.extend((compressed.len() as u32).to_le_bytes());
    matlab.extend(compressed);
    drop(blanks);
    let (said, peak) = refused_table(&matlab);
    assert!(said.contains("grow too much"), "{said}");
    // 64 MB are free; while a buffer grows from this to the double, both exist for a moment.
    assert!(peak < 3 * 64 * MB + 4 * MB, "{peak} bytes");
}
