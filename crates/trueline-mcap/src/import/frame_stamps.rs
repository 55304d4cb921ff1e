//! Pictures and their stamps, brought together.

use crate::import::in_order::{repetitions, sort};
use crate::import::stored_picture::{RecordedFrame, StoredPicture};
use crate::message::content::FrameStamps;
use crate::wire::frame_names::low_bits;
use std::collections::{HashMap, VecDeque};

const WHAT: &str = "pictures";

/// The frames in their order, and remarks. `stamps` are those of a recording of trueline.
pub(super) fn recorded_frames(
    mut pictures: Vec<StoredPicture>,
    stamps: Option<Vec<FrameStamps>>,
) -> (Vec<RecordedFrame>, Vec<String>) {
    let mut notes = Vec::new();
    notes.extend(sort(&mut pictures, |picture| picture.stamp_ns, WHAT));
    notes.extend(repetitions(&pictures, |picture| picture.stamp_ns, WHAT));
    let frames = match stamps {
        Some(stamps) => with_stamps(pictures, stamps, &mut notes),
        None => {
            let numbered = pictures.into_iter().zip(0..);
            numbered.map(|(picture, frame)| file(picture, frame, None)).collect()
        }
    };
    (frames, notes)
}

fn file(picture: StoredPicture, frame: u64, device_ns: Option<i64>) -> RecordedFrame {
    let StoredPicture { stamp_ns, place, message_type, .. } = picture;
    RecordedFrame { stamp_ns, frame, device_ns, place, message_type }
}

fn with_stamps(
    pictures: Vec<StoredPicture>,
    stamps: Vec<FrameStamps>,
    notes: &mut Vec<String>,
) -> Vec<RecordedFrame> {
    let empty = stamps.iter().filter(|frame| frame.picture_bytes == 0).count();
    let mut by_picture: HashMap<(u32, i64), VecDeque<FrameStamps>> = HashMap::new();
    for frame in stamps.into_iter().filter(|frame| frame.picture_bytes > 0) {
        by_picture.entry((low_bits(frame.frame), frame.stamp_ns)).or_default().push_back(frame);
    }
    let mut bare = 0;
    let mut frames = Vec::new();
    for picture in pictures {
        let stamps = by_picture.get_mut(&(picture.sequence, picture.stamp_ns)).and_then(VecDeque::pop_front);
        bare += usize::from(stamps.is_none());
        let (frame, device_ns) =
            stamps.map_or((u64::from(picture.sequence), None), |frame| (frame.frame, frame.device_ns));
        frames.push(file(picture, frame, device_ns));
    }
    let lost: usize = by_picture.values().map(VecDeque::len).sum();
    let without_device = frames.iter().filter(|frame| frame.device_ns.is_none()).count();
    let partly = if without_device < frames.len() { without_device } else { 0 };
    let told = [
        (empty, "frames did not come whole and have no picture"),
        (lost, "frames have lost their picture: the recording is damaged or was cut off there"),
        (
            bare,
            "pictures have lost their record: frame numbers above 32 bits and the camera's own stamps are missing there",
        ),
        (partly, "frames have no stamp of the camera's own clock, so those of the others are left out too"),
    ];
    notes.extend(told.iter().filter(|(n, _)| *n > 0).map(|(n, words)| format!("{n} {words}")));
    frames
}
