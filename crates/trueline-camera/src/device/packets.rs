//! From a picture of the whole sensor to the packets of what was asked for.

use super::registers::Wanted;
use super::settings::Chunks;
use crate::gige::PixelFormat;
use std::net::Ipv4Addr;
use std::ops::Range;
use telegenic::emulator::{DeviceConfig, GigeDevice};
use telegenic::gige::proto::bootstrap::STREAM_CHANNEL_PACKET_SIZE;
use trueline_dataset::{GrayImage, Pixels};

/// Format, columns, rows, first column and first row in a leader.
const LEADER_FIELDS: Range<usize> = 20..40;

/// Payload type in a leader.
const PAYLOAD_TYPE: Range<usize> = 10..12;
/// A picture with chunk data behind it.
const IMAGE_WITH_CHUNKS: u16 = 0x4001;

/// Makes packets. Registers of its own spare the thread that answers commands from waiting for it.
pub(super) struct Packer {
    encoder: GigeDevice,
}

impl Packer {
    pub(super) fn new() -> Self {
        Self { encoder: GigeDevice::new(Ipv4Addr::UNSPECIFIED, &DeviceConfig::default()) }
    }

    /// The packets of a picture as it is wanted, with its number and the stamp of its leader.
    pub(super) fn packets(
        &mut self,
        wanted: &Wanted,
        block_id: u16,
        device_ns: i64,
        (image, chunks): (&GrayImage, Option<Chunks>),
    ) -> Vec<Vec<u8>> {
        // A code that is not known goes out as it would from a camera that knows it: one byte a pixel will do.
        let format = wanted.format.unwrap_or(PixelFormat::Mono8);
        self.encoder.write_reg(STREAM_CHANNEL_PACKET_SIZE, wanted.packet_bytes);
        self.encoder.set_leader_timestamp_ns(device_ns.cast_unsigned());
        let mut payload = bytes(image, wanted, format);
        if let Some(chunks) = chunks {
            add_chunks(&mut payload, device_ns, wanted.exposure_s, chunks);
        }
        if chunks == Some(Chunks::Good) {
            // Some cameras leave the leader's empty then.
            self.encoder.set_leader_timestamp_ns(0);
        }
        let mut packets = self.encoder.frame_packets(u64::from(block_id), &payload);
        if let (Some(leader), Some(_)) =
            (packets.first_mut().and_then(|leader| leader.get_mut(PAYLOAD_TYPE)), chunks)
        {
            leader.copy_from_slice(&IMAGE_WITH_CHUNKS.to_be_bytes());
        }
        let fields = [format.code(), wanted.size[0], wanted.size[1], wanted.offset[0], wanted.offset[1]];
        if let Some(leader) = packets.first_mut().and_then(|leader| leader.get_mut(LEADER_FIELDS)) {
            leader.copy_from_slice(&fields.map(u32::to_be_bytes).concat());
        }
        packets
    }
}

/// The identifiers are those of the description.
fn add_chunks(payload: &mut Vec<u8>, device_ns: i64, exposure_s: f64, chunks: Chunks) {
    let tail = |id: u32, length: usize| [id.to_be_bytes(), (length as u32).to_be_bytes()].concat();
    let pixels = payload.len();
    payload.extend(tail(0xA500_0001, pixels));
    payload.extend(device_ns.to_be_bytes());
    payload.extend(tail(0xA500_0002, 8));
    // Cameras expose in steps of their own, and tell which.
    payload.extend((exposure_s * 1e6 + 0.125).to_be_bytes());
    payload.extend(tail(0xA500_0003, if chunks == Chunks::Lying { usize::MAX } else { 8 }));
}

/// What lies beyond the sensor is black.
fn bytes(image: &GrayImage, wanted: &Wanted, format: PixelFormat) -> Vec<u8> {
    if PixelFormat::PACKED.contains(&format) {
        let whole = bytes(image, wanted, PixelFormat::Mono16);
        return packed(whole.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])), format);
    }
    let [width, height] = wanted.size.map(|px| px as usize);
    let [left, top] = wanted.offset.map(|px| px as usize);
    let row_bytes = format.bytes_of(width).unwrap_or_default();
    let mut bytes = vec![0; row_bytes * height];
    if row_bytes == 0 {
        return bytes;
    }
    for (row, line) in bytes.chunks_exact_mut(row_bytes).enumerate() {
        let row = top + row;
        if row >= image.height {
            break;
        }
        let columns = left.min(image.width)..(left + width).min(image.width);
        let pixels = row * image.width + columns.start..row * image.width + columns.end;
        match (&image.pixels, format) {
            (Pixels::Eight(levels), PixelFormat::Mono8) => {
                line[..columns.len()].copy_from_slice(&levels[pixels]);
            }
            (Pixels::Sixteen(levels), PixelFormat::Mono8) => {
                for (byte, level) in line.iter_mut().zip(&levels[pixels]) {
                    *byte = (level >> 8) as u8;
                }
            }
            (Pixels::Sixteen(levels), PixelFormat::Coord3dAc16) => {
                let counts =
                    (left..).zip(&levels[pixels]).flat_map(|(column, level)| [column as u16, *level]);
                fill(line, counts, format);
            }
            (Pixels::Eight(levels), _) => {
                let levels = levels[pixels].iter().map(|level| u16::from(*level) * 257);
                fill(line, levels, format);
            }
            (Pixels::Sixteen(levels), _) => fill(line, levels[pixels].iter().copied(), format),
        }
    }
    bytes
}

/// Levels of 16 bits one after the other in a format whose bits share bytes.
fn packed(levels: impl Iterator<Item = u16>, format: PixelFormat) -> Vec<u8> {
    let bits = format.bits();
    let levels: Vec<u16> = levels.map(|level| level >> (16 - bits)).collect();
    let mut bytes = Vec::new();
    if matches!(format, PixelFormat::Mono10Packed | PixelFormat::Mono12Packed) {
        let low = bits - 8;
        for pair in levels.chunks(2) {
            let [first, second] = [pair[0], pair.get(1).copied().unwrap_or_default()];
            let lowest = |level: u16| level & ((1 << low) - 1);
            bytes.push((first >> low) as u8);
            bytes.push((lowest(first) | lowest(second) << 4) as u8);
            if pair.len() == 2 {
                bytes.push((second >> low) as u8);
            }
        }
        return bytes;
    }
    let (mut waiting, mut count) = (0_u32, 0);
    for level in levels {
        waiting |= u32::from(level) << count;
        count += bits;
        while count >= 8 {
            bytes.push(waiting as u8);
            (waiting, count) = (waiting >> 8, count - 8);
        }
    }
    if count > 0 {
        bytes.push(waiting as u8);
    }
    bytes
}

fn fill(line: &mut [u8], levels: impl Iterator<Item = u16>, format: PixelFormat) {
    let down = 16 - format.bits();
    for (pair, level) in line.chunks_exact_mut(2).zip(levels) {
        pair.copy_from_slice(&(level >> down).to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wanted(size: [u32; 2], offset: [u32; 2]) -> Wanted {
        let to = "127.0.0.1:1".parse().unwrap();
        let format = None;
        Wanted {
            size,
            offset,
            format,
            exposure_s: 0.0,
            period_s: 1.0,
            line_period_s: 0.0,
            single: false,
            packet_bytes: 100,
            to,
        }
    }

    #[test]
    fn a_region_is_cut_and_black_lies_around_the_sensor() {
        let image = GrayImage { width: 3, height: 2, pixels: Pixels::Eight(vec![1, 2, 3, 4, 5, 6]) };
        let cut = |size, offset| bytes(&image, &wanted(size, offset), PixelFormat::Mono8);
        assert_eq!(cut([2, 1], [1, 1]), [5, 6]);
        assert_eq!(cut([4, 3], [1, 0]), [2, 3, 0, 0, 5, 6, 0, 0, 0, 0, 0, 0]);
        assert_eq!(cut([2, 1], [9, 9]), [0, 0]);
    }

    #[test]
    fn white_stays_white() {
        let image = GrayImage { width: 2, height: 1, pixels: Pixels::Eight(vec![255, 0]) };
        assert_eq!(bytes(&image, &wanted([2, 1], [0, 0]), PixelFormat::Mono12), [0xff, 0x0f, 0, 0]);
        let image = GrayImage { width: 1, height: 1, pixels: Pixels::Sixteen(vec![0xffff]) };
        assert_eq!(bytes(&image, &wanted([1, 1], [0, 0]), PixelFormat::Mono8), [255]);
    }
}
