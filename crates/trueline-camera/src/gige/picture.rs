//! A picture out of what came.

use super::stamps::Packets;
use crate::frame_source::FrameStatus;
use crate::gray_image::gray_image;
use crate::pixel_format::PixelFormat;
use crate::range::{RangeProfile, RangeScale};
use telegenic::{Frame, FrameStatus as Driver, PayloadKind};
use trueline_dataset::{Channel, GrayImage, Pixels};

/// Size and format that every picture of a session has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Session {
    /// Columns and rows, px.
    pub size: [u32; 2],
    /// Format.
    pub format: PixelFormat,
    /// What of a colour picture is looked at.
    pub channel: Channel,
    /// What the numbers of a profiler mean; `None` for a camera.
    pub range: Option<RangeScale>,
}

/// What came of a frame: a picture of a camera, or the profiles of a profiler.
#[derive(Debug, Default)]
pub(super) struct Seen {
    /// The picture.
    pub image: Option<GrayImage>,
    /// The profiles.
    pub profiles: Vec<RangeProfile>,
}

/// How a frame is, and what is in it if it can be used.
pub(super) fn of(frame: &Frame, packets: Option<&Packets>, session: Session) -> (FrameStatus, Seen) {
    let status = status(frame, packets, session);
    if status != FrameStatus::Complete {
        return (status, Seen::default());
    }
    match image(frame.data(), frame, session) {
        Some(image) => (status, seen(image, session)),
        // The leader says more than the packets brought.
        None => (FrameStatus::Incomplete { missing: 1 }, Seen::default()),
    }
}

fn seen(image: GrayImage, session: Session) -> Seen {
    match (session.range, &image.pixels) {
        (Some(scale), Pixels::Sixteen(counts)) => {
            Seen { image: None, profiles: scale.profiles(counts, session.size[0] as usize) }
        }
        _ => Seen { image: Some(image), profiles: Vec::new() },
    }
}

fn status(frame: &Frame, packets: Option<&Packets>, session: Session) -> FrameStatus {
    let size = [frame.width, frame.height];
    // Without its leader a picture says nothing of itself, but then it is not complete either.
    let has_leader = size != [0, 0];
    if has_leader && frame.pixel_format.0 != session.format.code() {
        return FrameStatus::WrongFormat { found: frame.pixel_format.to_string() };
    }
    if has_leader && size != session.size {
        let [width, height] = size;
        return FrameStatus::WrongSize { width, height };
    }
    if frame.status == Driver::Complete && has_leader && matches!(frame.payload, PayloadKind::Image { .. }) {
        return FrameStatus::Complete;
    }
    let [width, height] = session.size.map(|px| px as usize);
    let bytes_of_all = session.format.bytes_of(width.saturating_mul(height)).unwrap_or(usize::MAX);
    let missing_bytes = bytes_of_all.saturating_sub(frame.received_size);
    let bytes = packets.map_or(0, |packets| packets.most_bytes).max(1);
    // At least one: the leader or the end of the picture may be all that is missing.
    let missing = u32::try_from(missing_bytes.div_ceil(bytes)).unwrap_or(u32::MAX).max(1);
    FrameStatus::Incomplete { missing }
}

fn image(data: &[u8], frame: &Frame, session: Session) -> Option<GrayImage> {
    gray_image(data, session.size, session.format, usize::from(frame.x_padding), session.channel)
}
