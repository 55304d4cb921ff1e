//! Pictures and their index: what is read, and what is refused with which words.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use proptest::prelude::*;
use std::fs;
use std::path::Path;
use trueline_dataset::{Feature, GrayImage, Measured, Pixels, folder, gray_png, images};

fn dataset(index: &str) -> tempfile::TempDir {
    let dataset = tempfile::tempdir().unwrap();
    fs::create_dir(dataset.path().join("images")).unwrap();
    fs::write(images::index_of(dataset.path()), index).unwrap();
    dataset
}

fn refusal(index: &str) -> String {
    images::read_index(dataset(index).path()).unwrap_err().to_string()
}

fn eight() -> GrayImage {
    GrayImage { width: 7, height: 3, pixels: Pixels::Eight((0..21).map(|k| k * 12).collect()) }
}

fn sixteen() -> GrayImage {
    GrayImage { width: 7, height: 3, pixels: Pixels::Sixteen((0..21).map(|k| k * 3000 + 1).collect()) }
}

#[test]
fn pictures_come_back_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.png");
    let mut spare = vec![1; 1000];
    for image in [eight(), sixteen()] {
        gray_png::write(&file, &image).unwrap();
        assert_eq!(gray_png::read(&file, &mut spare).unwrap(), image);
    }
}

#[test]
fn an_index_may_have_no_counter_and_its_columns_in_any_order() {
    let dataset = dataset("file,time_ms\na.png,10\nimages/b.png,20\n");
    let frames = images::read_index(dataset.path()).unwrap();
    assert_eq!(
        frames.iter().map(|f| (f.stamp_ns, f.frame)).collect::<Vec<_>>(),
        [(10_000_000, 0), (20_000_000, 1)]
    );
    assert_eq!(frames[1].path, dataset.path().join("images").join("b.png"));
}

#[test]
fn an_index_comes_back_as_it_was_written() {
    let frame = |frame: u64, device_ns: Option<i64>| images::FrameFile {
        stamp_ns: 1_763_689_200_000_000_001 + 33_333_333 * frame as i64,
        frame,
        device_ns,
        path: format!("{frame}.png").into(),
    };
    let back = |frames: &[images::FrameFile]| {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("images")).unwrap();
        images::write_index(folder.path(), frames).unwrap();
        let mut back = images::read_index(folder.path()).unwrap();
        for frame in &mut back {
            frame.path = frame.path.file_name().unwrap().into();
        }
        back
    };
    let stamped = [frame(3, Some(-5)), frame(4, Some(1_000_000_007))];
    assert_eq!(back(&stamped), stamped);
    // A column is there for all or for none.
    let partly = [frame(3, None), frame(4, Some(1))];
    assert_eq!(back(&partly), [frame(3, None), frame(4, None)]);
}

#[test]
fn an_index_that_cannot_be_used_says_where() {
    assert!(refusal("time_s,file\n").contains("no data rows"));
    assert!(refusal("time_s\n1\n").contains("column `file` is missing"));
    assert!(
        refusal("time_s,file\n2,a.png\n1,b.png\n").contains("line 3, column `time_s`: time runs backwards")
    );
    for name in ["../a.png", "/etc/passwd", "images/../../a.png", ""] {
        let said = refusal(&format!("time_s,file\n1,{name}\n"));
        assert!(said.contains("line 2, column `file`: expected the name of a file"), "{name}: {said}");
    }
}

#[test]
fn pictures_that_cannot_be_used_say_why() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.png");
    let said = || gray_png::read(&file, &mut Vec::new()).unwrap_err().to_string();
    assert!(said().contains("the file is missing"));
    fs::write(&file, b"no picture").unwrap();
    assert!(said().contains("cannot be read"), "{}", said());
    gray_png::write_rgb(&file, [2, 1], &[0; 6]).unwrap();
    assert!(said().contains("expected a gray picture of 8 or 16 bits, found 8 bits, Rgb"), "{}", said());
}

/// Whatever is left of a picture that was cut off is no picture.
#[test]
fn a_picture_that_is_cut_off_is_refused_wherever_it_ends() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.png");
    gray_png::write(&file, &sixteen()).unwrap();
    let whole = fs::read(&file).unwrap();
    // The last chunk, twelve bytes, only says that it was the last; all that was seen is there before it.
    for length in 0..whole.len() - 12 {
        fs::write(&file, &whole[..length]).unwrap();
        let read = gray_png::read(&file, &mut Vec::new());
        assert!(read.is_err() || read.unwrap() == sixteen(), "{length} of {} bytes", whole.len());
    }
}

#[test]
fn features_that_are_there_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("features.csv");
    let feature = Feature {
        stamp_ns: 1,
        line: 0,
        frame: None,
        device_ns: None,
        measured: Measured::Pixel([1.0, 2.0]),
        sigma: None,
    };
    let replace = |features: &[Feature]| folder::replace_features(folder.path(), features).unwrap();
    assert_eq!(replace(&[]), None);
    assert!(!file.exists());
    fs::write(&file, "first").unwrap();
    let kept = |number: u32| folder.path().join(format!("features.previous-{number}.csv"));
    assert_eq!(replace(&[feature]), Some(kept(1)));
    let second = fs::read_to_string(&file).unwrap();
    assert!(second.ends_with(",1,2\n"), "{second}");
    // Without features the old ones do not stay: they would be taken for those of the pictures.
    assert_eq!(replace(&[]), Some(kept(2)));
    assert!(!file.exists());
    assert_eq!(fs::read_to_string(kept(1)).unwrap(), "first");
    assert_eq!(fs::read_to_string(kept(2)).unwrap(), second);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "nothing else is left");
}

fn read_bytes(bytes: &[u8]) -> bool {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.png");
    fs::write(&file, bytes).unwrap();
    gray_png::read(Path::new(&file), &mut Vec::new()).is_ok()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn no_bytes_make_the_reader_of_pictures_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(!read_bytes(&bytes));
    }

    /// Bytes changed in the middle of a good picture: an error, or a picture, never a panic.
    #[test]
    fn no_change_makes_the_reader_of_pictures_panic(at in 8_usize..120, value in any::<u8>()) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.png");
        gray_png::write(&file, &eight()).unwrap();
        let mut bytes = fs::read(&file).unwrap();
        let place = at % bytes.len();
        bytes[place] = value;
        read_bytes(&bytes);
    }

    #[test]
    fn no_text_makes_the_reader_of_the_index_panic(text in "[a-z_,./0-9\\n\\-]{0,200}") {
        let _ = images::read_index(dataset(&text).path());
        let _ = images::read_index(dataset(&format!("time_s,file,frame\n{text}")).path());
    }
}
