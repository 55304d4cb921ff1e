//! A recording given again.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;
use std::time::Duration;
use trueline_camera::{CameraError, FrameSource, FrameStatus, Pace, Replay};
use trueline_dataset::{GrayImage, Pixels, gray_png};
use trueline_live::HostClock;

const LONG: Duration = Duration::from_secs(5);

fn picture(width: usize, level: u8) -> GrayImage {
    GrayImage { width, height: 3, pixels: Pixels::Eight(vec![level; width * 3]) }
}

fn recording(folder: &Path, widths: &[usize]) {
    let images = folder.join("images");
    fs::create_dir_all(&images).unwrap();
    let mut index = "time_s,file,frame,device_time_s\n".to_owned();
    for (number, width) in widths.iter().enumerate() {
        gray_png::write(&images.join(format!("{number}.png")), &picture(*width, number as u8)).unwrap();
        let time_s = 100.0 + 0.04 * number as f64;
        index +=
            &format!("{time_s:.3},{number}.png,{},{:.4}\n", 7 + 2 * number, 5.0 + 0.0401 * number as f64);
    }
    fs::write(images.join("index.csv"), index).unwrap();
}

#[test]
fn pictures_are_given_at_their_time_and_never_before() {
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), &[4; 6]);
    for (pace, times) in [(Pace::Times(1.0), 1.0), (Pace::Times(4.0), 4.0)] {
        let clock = HostClock::start();
        let mut replay = Replay::open(folder.path(), pace, clock).unwrap();
        assert_eq!((replay.about().width, replay.about().height), (4, 3));
        let mut first_ns = None;
        for number in 0..6_u32 {
            let frame = replay.next(LONG).unwrap().unwrap();
            let now_ns = clock.read().steady_ns;
            let first_ns = *first_ns.get_or_insert(frame.complete_ns);
            let due_ns = first_ns + (f64::from(number) * 0.04e9 / times) as i64;
            assert!((frame.complete_ns - due_ns).abs() <= 1, "{number}");
            assert!(now_ns >= frame.complete_ns, "{number} came early");
            assert_eq!(frame.image, Some(picture(4, number as u8)));
            assert_eq!(frame.frame, u64::from(7 + 2 * number));
            assert_eq!(frame.device_ns, Some(5_000_000_000 + i64::from(number) * 40_100_000));
            assert_eq!((frame.first_packet_ns, frame.status), (None, FrameStatus::Complete));
        }
        assert!(replay.has_ended());
        assert_eq!(replay.next(LONG).unwrap(), None);
    }
}

#[test]
fn a_wait_that_is_too_short_gives_nothing_and_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), &[4; 3]);
    let mut replay = Replay::open(folder.path(), Pace::Times(0.2), HostClock::start()).unwrap();
    assert!(replay.next(LONG).unwrap().is_some());
    assert_eq!(replay.next(Duration::from_millis(1)).unwrap(), None);
    assert!(!replay.has_ended());
    assert_eq!(replay.next(LONG).unwrap().unwrap().frame, 9);
    assert_eq!(replay.next(LONG).unwrap().unwrap().frame, 11);
}

#[test]
fn what_cannot_be_used_is_marked_and_what_cannot_be_read_is_told_once() {
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), &[4, 5, 4, 4]);
    fs::remove_file(folder.path().join("images").join("2.png")).unwrap();
    let mut replay = Replay::open(folder.path(), Pace::Unpaced, HostClock::start()).unwrap();
    assert!(replay.next(LONG).unwrap().unwrap().image.is_some());
    let other = replay.next(LONG).unwrap().unwrap();
    assert_eq!((other.status, other.image), (FrameStatus::WrongSize { width: 5, height: 3 }, None));
    let error = replay.next(LONG).err().unwrap();
    assert!(matches!(error, CameraError::Recording(_)) && !error.hint().is_empty());
    assert_eq!(replay.next(LONG).unwrap().unwrap().frame, 13);
    assert!(replay.has_ended());
}
