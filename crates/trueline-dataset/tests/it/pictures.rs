//! Pictures and their index: readable forms, and refusals with their words.

use proptest::prelude::*;
use std::fs;
use std::path::Path;
use trueline_dataset::picture_names::{self, PictureStamps};
use trueline_dataset::{
    Channel, Feature, GrayImage, Measured, PictureFolder, PictureSource, Pixels, folder, gray_png, images,
};

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

/// Bytes of a picture that look like a camera's noise, and hardly shrink.
fn noisy(width: usize, height: usize) -> GrayImage {
    let mut state = 1_u32;
    let levels = (0..width * height).map(|_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    });
    GrayImage { width, height, pixels: Pixels::Eight(levels.collect()) }
}

#[test]
fn in_a_recording_pixels_are_stored_as_they_are_and_in_a_file_they_are_packed() {
    let folder = tempfile::tempdir().unwrap();
    let (dark, file) = (GrayImage { pixels: Pixels::Eight(vec![3; 400 * 300]), ..noisy(400, 300) }, "a.png");
    let file = folder.path().join(file);
    for (image, shrinks) in [(dark, true), (noisy(400, 300), false)] {
        let stored = gray_png::encode_gray(&image).unwrap();
        // Deflate's stored blocks have 5 bytes for up to 65,535; each row has one for its filter; heads and sums are below 200.
        let most = image.bytes() + image.height + 200;
        assert!(gray_png::is_stored(&stored) && (image.bytes()..most).contains(&stored.len()));
        let read = gray_png::decode(&file, std::io::Cursor::new(&stored), &mut Vec::new());
        assert_eq!(read.unwrap(), image);
        gray_png::write(&file, &image).unwrap();
        let packed = fs::read(&file).unwrap();
        assert_eq!(packed.len() < image.bytes() / 20, shrinks, "{}", packed.len());
        assert_eq!(gray_png::is_stored(&packed), !shrinks);
        assert_eq!(gray_png::read(&file, &mut Vec::new()).unwrap(), image);
    }
    let small = gray_png::encode_gray(&noisy(100, 100)).unwrap();
    assert!(!gray_png::is_stored(&small), "not worth packing");
    assert!(!gray_png::is_stored(&vec![0; 100_000]), "no picture");
}

#[test]
fn a_picture_too_large_for_a_block_of_a_recording_is_packed() {
    // 4096 x 4096 px of 16 bits are the 32 MiB that are stored at most.
    let dark =
        |rows: usize| GrayImage { width: 4096, height: rows, pixels: Pixels::Sixteen(vec![7; 4096 * rows]) };
    assert!(gray_png::is_stored(&gray_png::encode_gray(&dark(4096)).unwrap()));
    let packed = gray_png::encode_gray(&dark(4098)).unwrap();
    assert!(packed.len() < 1 << 20, "{}", packed.len());
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

/// The rest of a truncated picture is not a picture.
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
        correlation: 0.0,
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

/// A stripe in red on blueish ground, row 3 of 8; the ground is brighter in blue than the stripe is in gray.
fn colour() -> Vec<u8> {
    (0..8 * 64).flat_map(|k| if k / 64 == 3 { [220, 30, 60] } else { [10, 20, 90] }).collect()
}

fn folder_of(name: &str, bytes: &[u8]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("images")).unwrap();
    fs::write(folder.path().join("images").join(name), bytes).unwrap();
    fs::write(folder.path().join("images/index.csv"), format!("time_s,file\n1,{name}\n")).unwrap();
    folder
}

fn bmp(rgb: &[u8], [width, height]: [u32; 2]) -> Vec<u8> {
    let size = 3 * width * height;
    let mut bytes = b"BM".to_vec();
    for number in [54 + size, 0, 54, 40, width, height] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend([1, 0, 24, 0]);
    for number in [0, size, 2835, 2835, 0, 0] {
        bytes.extend(u32::to_le_bytes(number));
    }
    // Blue, green, red; the last row first.
    for row in rgb.chunks_exact(3 * width as usize).rev() {
        bytes.extend(row.chunks_exact(3).flat_map(|p| [p[2], p[1], p[0]]));
    }
    bytes
}

#[test]
fn of_colour_pictures_of_any_form_the_laser_s_channel_is_read() {
    let mut tiff_bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut tiff_bytes).unwrap();
    encoder.write_image::<tiff::encoder::colortype::RGB8>(64, 8, &colour()).unwrap();
    let png = gray_png::encode_rgb([64, 8], &colour()).unwrap();
    let forms = [("a.png", png), ("a.tiff", tiff_bytes.into_inner()), ("a.bmp", bmp(&colour(), [64, 8]))];
    for (name, bytes) in forms {
        let folder = folder_of(name, &bytes);
        let pictures = PictureFolder::open(folder.path()).unwrap();
        assert_eq!(pictures.channel(), None);
        let image = pictures.read(0, &mut Vec::new()).unwrap();
        assert_eq!(pictures.channel(), Some(Channel::Red), "{name}");
        let red = (0..8 * 64).map(|k| if k / 64 == 3 { 220 } else { 10 }).collect();
        assert_eq!(image, GrayImage { width: 64, height: 8, pixels: Pixels::Eight(red) }, "{name}");
        // Cut off anywhere, it is refused in words.
        for end in (0..bytes.len()).step_by(37) {
            let folder = folder_of(name, &bytes[..end]);
            let read = PictureFolder::open(folder.path()).unwrap().read(0, &mut Vec::new());
            // Data after the last pixel may be missing.
            assert!(read.is_err() || read.unwrap() == image, "{name} cut off at {end}");
        }
    }
}

/// A red laser on white paper: red is saturated all over the paper, green only in the stripe.
#[test]
fn where_a_surface_glows_another_channel_is_looked_at() {
    let stripe = |k: usize| if k / 64 == 3 { [255, 230, 200] } else { [255, 60, 70] };
    let picture: Vec<u8> = (0..8 * 64).flat_map(stripe).collect();
    let folder = folder_of("a.bmp", &bmp(&picture, [64, 8]));
    let pictures = PictureFolder::open(folder.path()).unwrap();
    pictures.read(0, &mut Vec::new()).unwrap();
    assert_eq!(pictures.channel(), Some(Channel::Green));
}

#[test]
fn a_picture_is_what_its_bytes_say_and_not_its_name() {
    let folder = folder_of("a.png", &bmp(&colour(), [64, 8]));
    let pictures = PictureFolder::open(folder.path()).unwrap();
    assert_eq!(pictures.read(0, &mut Vec::new()).unwrap().width, 64);
    assert_eq!(pictures.channel(), Some(Channel::Red));
    // A file that is not a picture is reported by its name.
    let folder = folder_of("a.png", b"no picture");
    let refusal =
        PictureFolder::open(folder.path()).unwrap().read(0, &mut Vec::new()).unwrap_err().to_string();
    assert!(refusal.contains("PNG"), "{refusal}");
}

#[test]
fn gray_tiff_of_sixteen_bits_is_read_as_it_is() {
    let levels: Vec<u16> = (0..8 * 64).map(|k| k * 100).collect();
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut bytes).unwrap();
    encoder.write_image::<tiff::encoder::colortype::Gray16>(64, 8, &levels).unwrap();
    let folder = folder_of("a.tif", &bytes.into_inner());
    let pictures = PictureFolder::open(folder.path()).unwrap();
    let image = pictures.read(0, &mut Vec::new()).unwrap();
    assert_eq!(image, GrayImage { width: 64, height: 8, pixels: Pixels::Sixteen(levels) });
    assert_eq!(pictures.channel(), None);
}

#[test]
fn frames_follow_from_the_numbers_in_names() {
    let folder = tempfile::tempdir().unwrap();
    let images = folder.path().join("images");
    fs::create_dir(&images).unwrap();
    let frames = |stamps| picture_names::frames(folder.path(), stamps);
    assert!(frames(PictureStamps::Names { unit_ns: 1 }).unwrap_err().to_string().contains("no data rows"));
    for name in ["cam2_9.png", "cam2_10.png", "cam2_13.jpg", "notes.txt"] {
        fs::write(images.join(name), "").unwrap();
    }
    // By number and not by name; a missing number is a lost picture.
    let rate = PictureStamps::Rate { fps: 40.0, first_ns: 7 };
    let found: Vec<_> =
        frames(rate).unwrap().frames.iter().map(|frame| (frame.stamp_ns, frame.frame)).collect();
    assert_eq!(found, [(7, 0), (25_000_007, 1), (100_000_007, 4)]);
    let stamps = PictureStamps::Names { unit_ns: 1_000_000 };
    let found: Vec<_> =
        frames(stamps).unwrap().frames.iter().map(|frame| (frame.stamp_ns, frame.frame)).collect();
    assert_eq!(found, [(9_000_000, 0), (10_000_000, 1), (13_000_000, 2)]);
    fs::write(images.join("other_10.png"), "").unwrap();
    assert!(frames(rate).unwrap_err().to_string().contains("another picture also has the number 10"));
    fs::remove_file(images.join("other_10.png")).unwrap();
    fs::write(images.join("last.png"), "").unwrap();
    assert!(frames(rate).unwrap_err().to_string().contains("the name has no number"));
}

/// In daylight red paper, white metal and a red laser are bright in red. Only light of the laser's colour stands above green
/// and blue, and only in the stripe does it exceed its neighbours.
#[test]
fn a_colour_is_how_far_a_channel_stands_above_both_others() {
    let pixel = |k: usize| match (k / 64, k % 64) {
        (3, _) => [220, 150, 160],
        (_, 0..32) => [200, 200, 200],
        _ => [90, 120, 60],
    };
    let rgb: Vec<u8> = (0..16 * 64).flat_map(pixel).collect();
    for (swap, name) in [([0, 1, 2], "red"), ([1, 0, 2], "green"), ([1, 2, 0], "blue")] {
        let swapped: Vec<u8> = rgb.chunks_exact(3).flat_map(|p| swap.map(|k| p[k])).collect();
        let folder = folder_of("a.bmp", &bmp(&swapped, [64, 16]));
        let pictures = PictureFolder::open(folder.path()).unwrap();
        assert_eq!(pictures.colour(0).unwrap(), None, "not read yet");
        pictures.read(0, &mut Vec::new()).unwrap();
        // The green ground is above its others by 30 evenly, the stripe by 60 in one row.
        let colour: Vec<u8> = (0..16 * 64).map(|k| if k / 64 == 3 { 60 } else { 0 }).collect();
        let found = pictures.colour(0).unwrap().unwrap();
        assert_eq!(found, GrayImage { width: 64, height: 16, pixels: Pixels::Eight(colour) }, "{name}");
    }
    // Gray pictures have none.
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("images")).unwrap();
    gray_png::write(&folder.path().join("images/a.png"), &eight()).unwrap();
    fs::write(folder.path().join("images/index.csv"), "time_s,file\n1,a.png\n").unwrap();
    let pictures = PictureFolder::open(folder.path()).unwrap();
    pictures.read(0, &mut Vec::new()).unwrap();
    assert_eq!(pictures.colour(0).unwrap(), None);
}
