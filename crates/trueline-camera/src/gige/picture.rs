//! A picture out of what came.

use super::packed;
use super::settings::PixelFormat;
use super::stamps::Packets;
use crate::frame_source::FrameStatus;
use crate::range::{RangeProfile, RangeScale};
use telegenic::{Frame, FrameStatus as Driver, PayloadKind};
use trueline_dataset::{GrayImage, Pixels};

/// Size and format that every picture of a session has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Session {
    /// Columns and rows, px.
    pub size: [u32; 2],
    /// Format.
    pub format: PixelFormat,
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
    gray_image(data, session.size, session.format, usize::from(frame.x_padding))
}

/// The bytes of a stream as a picture of columns and rows; lines may be filled up with `padding` bytes, and other data may follow.
/// `None` if there are fewer bytes than pixels.
#[must_use]
pub fn gray_image(data: &[u8], size: [u32; 2], format: PixelFormat, padding: usize) -> Option<GrayImage> {
    let [width, height] = size.map(|px| px as usize);
    if padding == 0 && PixelFormat::PACKED.contains(&format) {
        // Bits go on from one line to the next where a line ends within a byte.
        let levels = packed::levels(data, width.checked_mul(height)?, format)?;
        return Some(GrayImage { width, height, pixels: Pixels::Sixteen(levels) });
    }
    let row = format.bytes_of(width)?;
    let stride = row.checked_add(padding)?;
    if data.len() < stride.checked_mul(height)?.saturating_sub(padding) || stride == 0 {
        return None;
    }
    let rows = data.chunks(stride).take(height).map(|line| &line[..row]);
    let pixels = match format {
        PixelFormat::Mono8 if padding == 0 => Pixels::Eight(data[..row * height].to_vec()),
        PixelFormat::Mono8 => Pixels::Eight(rows.flatten().copied().collect()),
        format if PixelFormat::PACKED.contains(&format) => {
            let lines = rows.map(|line| packed::levels(line, width, format));
            Pixels::Sixteen(lines.collect::<Option<Vec<_>>>()?.concat())
        }
        // Moved up so that white is the same in every picture of 16 bits.
        format => {
            let up = 16 - format.bits();
            let pairs = rows.flat_map(|line| line.chunks_exact(2));
            Pixels::Sixteen(pairs.map(|pair| u16::from_le_bytes([pair[0], pair[1]]) << up).collect())
        }
    };
    // With both coordinates of range data a column is two numbers.
    let numbers = if format == PixelFormat::Coord3dAc16 { 2 * width } else { width };
    Some(GrayImage { width: numbers, height, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_are_filled_up_are_cut() {
        let pixels = |data: &[u8], padding| gray_image(data, [3, 2], PixelFormat::Mono8, padding);
        let image = pixels(&[1, 2, 3, 99, 4, 5, 6], 1).unwrap();
        assert_eq!(image.pixels, Pixels::Eight(vec![1, 2, 3, 4, 5, 6]));
        assert_eq!(pixels(&[1, 2, 3, 4, 5], 0), None, "one pixel too few");
        assert_eq!(
            gray_image(&[0; 99], [u32::MAX; 2], PixelFormat::Mono16, 0),
            None,
            "more than can be counted"
        );
    }

    #[test]
    fn white_is_white_in_every_format_of_two_bytes() {
        for format in [PixelFormat::Mono10, PixelFormat::Mono12, PixelFormat::Mono16] {
            let white = ((1_u32 << format.bits()) - 1) as u16;
            let data: Vec<u8> = [white, 1].iter().flat_map(|v| v.to_le_bytes()).collect();
            let Pixels::Sixteen(levels) = gray_image(&data, [2, 1], format, 0).unwrap().pixels else {
                panic!("16 bits were asked for")
            };
            let step = 1 << (16 - format.bits());
            assert_eq!(levels, [u16::MAX - (step - 1), step]);
        }
    }
}
