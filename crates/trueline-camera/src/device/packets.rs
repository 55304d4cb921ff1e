//! From a picture of the whole sensor to the requested packets.

use super::registers::Wanted;
use super::settings::Chunks;
use crate::pixel_format::{Mosaic, PixelFormat, Samples};
use std::net::Ipv4Addr;
use std::ops::Range;
use telegenic::emulator::{DeviceConfig, GigeDevice};
use telegenic::gige::proto::bootstrap::STREAM_CHANNEL_PACKET_SIZE;
use trueline_dataset::{FrameSignals, GrayImage, Pixels};

/// Format, columns, rows, first column and first row in a leader.
const LEADER_FIELDS: Range<usize> = 20..40;

/// Payload type in a leader.
const PAYLOAD_TYPE: Range<usize> = 10..12;
/// A picture with chunk data behind it.
const IMAGE_WITH_CHUNKS: u16 = 0x4001;

/// A picture that is to be sent.
pub(super) struct Shot<'a> {
    /// Its number in the stream.
    pub block_id: u16,
    /// The stamp of its leader, ns.
    pub device_ns: i64,
    /// The whole sensor's picture.
    pub image: &'a GrayImage,
    /// Data sent behind the pixels.
    pub chunks: Option<Chunks>,
    /// State of the inputs.
    pub signals: FrameSignals,
}

/// Makes packets. Registers of its own spare the thread that answers commands from waiting for it.
pub(super) struct Packer {
    encoder: GigeDevice,
}

impl Packer {
    pub(super) fn new() -> Self {
        Self { encoder: GigeDevice::new(Ipv4Addr::UNSPECIFIED, &DeviceConfig::default()) }
    }

    /// The packets of a picture in the requested form.
    pub(super) fn packets(&mut self, wanted: &Wanted, shot: &Shot<'_>) -> Vec<Vec<u8>> {
        let Shot { block_id, device_ns, image, chunks, .. } = *shot;
        // An unknown code goes out as from a camera that knows it: one byte a pixel will do.
        let format = wanted.format.unwrap_or(PixelFormat::MONO_8);
        self.encoder.write_reg(STREAM_CHANNEL_PACKET_SIZE, wanted.packet_bytes);
        self.encoder.set_leader_timestamp_ns(device_ns.cast_unsigned());
        let mut payload = bytes(image, wanted, format);
        if let Some(chunks) = chunks {
            add_chunks(&mut payload, shot, wanted.exposure_s, chunks);
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

/// The identifiers are in the description. Inputs without a wire read zero.
fn add_chunks(payload: &mut Vec<u8>, shot: &Shot<'_>, exposure_s: f64, chunks: Chunks) {
    let FrameSignals { encoder, lines, counter, camera_frame } = shot.signals;
    let pixels = payload.len();
    let mut end = |data: &[u8], id: u32, length: usize| {
        payload.extend(data);
        payload.extend(id.to_be_bytes());
        payload.extend((length as u32).to_be_bytes());
    };
    end(&[], 0xA500_0001, pixels);
    end(&shot.device_ns.to_be_bytes(), 0xA500_0002, 8);
    end(&(encoder.unwrap_or_default() as i32).to_be_bytes(), 0xA500_0004, 4);
    end(&(lines.unwrap_or_default() as u32).to_be_bytes(), 0xA500_0005, 4);
    end(&(counter.unwrap_or_default() as u32).to_be_bytes(), 0xA500_0006, 4);
    end(&camera_frame.unwrap_or_default().to_be_bytes(), 0xA500_0007, 8);
    // Cameras expose in steps of their own, and report them.
    let exposure_us = (exposure_s * 1e6 + 0.125).to_be_bytes();
    end(&exposure_us, 0xA500_0003, if chunks == Chunks::Lying { usize::MAX } else { 8 });
}

/// The pixels of a picture in the requested form. Pixels beyond the sensor are black.
fn bytes(image: &GrayImage, wanted: &Wanted, format: PixelFormat) -> Vec<u8> {
    let (width, left) = (wanted.size[0] as usize, wanted.offset[0] as usize);
    let levels = region(image, wanted);
    match format {
        PixelFormat::Mono(samples) => encoded(levels.into_iter(), samples),
        PixelFormat::Bayer(mosaic, samples) => {
            let of = |(place, level): (usize, u16)| {
                let [column, row] = [place % width.max(1), place / width.max(1)].map(|at| at % 2);
                lit(level, colour_at(mosaic, [column, row]))
            };
            encoded(levels.into_iter().enumerate().map(of), samples)
        }
        PixelFormat::Rgb8 => encoded(colours(levels, [0, 1, 2]), Samples::Eight),
        PixelFormat::Bgr8 => encoded(colours(levels, [2, 1, 0]), Samples::Eight),
        PixelFormat::Coord3dC16 => encoded(levels.into_iter(), Samples::Sixteen),
        PixelFormat::Coord3dAc16 => {
            let along = |place: usize| (left + place % width.max(1)) as u16;
            let both = levels.into_iter().enumerate().flat_map(|(place, level)| [along(place), level]);
            encoded(both, Samples::Sixteen)
        }
    }
}

/// Sensitivity of red, green and blue pixels to a red laser, as parts of its light.
pub(super) const SEEN_OF_LASER: [f64; 3] = [1.0, 0.12, 0.03];

fn lit(level: u16, colour: usize) -> u16 {
    (f64::from(level) * SEEN_OF_LASER[colour]).round() as u16
}

/// The colour of a pixel of a mosaic at a place modulo two: red, green or blue.
fn colour_at(mosaic: Mosaic, [column, row]: [usize; 2]) -> usize {
    let [red_column, red_row] = mosaic.red();
    usize::from(column != red_column) + usize::from(row != red_row)
}

fn colours(levels: Vec<u16>, order: [usize; 3]) -> impl Iterator<Item = u16> {
    levels.into_iter().flat_map(move |level| order.map(|colour| lit(level, colour)))
}

/// Levels of 16 bits of the region that is wanted.
fn region(image: &GrayImage, wanted: &Wanted) -> Vec<u16> {
    let [width, height] = wanted.size.map(|px| px as usize);
    let [left, top] = wanted.offset.map(|px| px as usize);
    let mut levels = vec![0; width * height];
    let columns = left.min(image.width)..(left + width).min(image.width);
    let rows = top..(top + height).min(image.height);
    for (line, row) in levels.chunks_exact_mut(width.max(1)).zip(rows) {
        let pixels = row * image.width + columns.start..row * image.width + columns.end;
        match &image.pixels {
            Pixels::Eight(all) => {
                line.iter_mut().zip(&all[pixels]).for_each(|(to, level)| *to = u16::from(*level) * 257);
            }
            Pixels::Sixteen(all) => line[..columns.len()].copy_from_slice(&all[pixels]),
        }
    }
    levels
}

/// Levels of 16 bits one after the other as samples are sent.
fn encoded(levels: impl Iterator<Item = u16>, samples: Samples) -> Vec<u8> {
    let down = 16 - samples.bits();
    let levels = levels.map(|level| level >> down);
    match samples {
        Samples::Eight => levels.map(|level| level as u8).collect(),
        Samples::Ten | Samples::Twelve | Samples::Sixteen => levels.flat_map(u16::to_le_bytes).collect(),
        Samples::TenPacked | Samples::TwelvePacked => by_pairs(levels, samples.bits() - 8),
        Samples::TenP | Samples::TwelveP => one_after_the_other(levels, samples.bits()),
    }
}

/// Two samples in three bytes, their `low` lowest bits in the middle one.
fn by_pairs(levels: impl Iterator<Item = u16>, low: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let levels: Vec<u16> = levels.collect();
    for pair in levels.chunks(2) {
        let [first, second] = [pair[0], pair.get(1).copied().unwrap_or_default()];
        let lowest = |level: u16| level & ((1 << low) - 1);
        bytes.push((first >> low) as u8);
        bytes.push((lowest(first) | lowest(second) << 4) as u8);
        if pair.len() == 2 {
            bytes.push((second >> low) as u8);
        }
    }
    bytes
}

/// The lowest bits first.
fn one_after_the_other(levels: impl Iterator<Item = u16>, bits: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
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
            trigger: None,
            packet_bytes: 100,
            to,
        }
    }

    #[test]
    fn a_region_is_cut_and_black_lies_around_the_sensor() {
        let image = GrayImage { width: 3, height: 2, pixels: Pixels::Eight(vec![1, 2, 3, 4, 5, 6]) };
        let cut = |size, offset| bytes(&image, &wanted(size, offset), PixelFormat::MONO_8);
        assert_eq!(cut([2, 1], [1, 1]), [5, 6]);
        assert_eq!(cut([4, 3], [1, 0]), [2, 3, 0, 0, 5, 6, 0, 0, 0, 0, 0, 0]);
        assert_eq!(cut([2, 1], [9, 9]), [0, 0]);
    }

    #[test]
    fn white_stays_white() {
        let image = GrayImage { width: 2, height: 1, pixels: Pixels::Eight(vec![255, 0]) };
        assert_eq!(bytes(&image, &wanted([2, 1], [0, 0]), PixelFormat::MONO_12), [0xff, 0x0f, 0, 0]);
        let image = GrayImage { width: 1, height: 1, pixels: Pixels::Sixteen(vec![0xffff]) };
        assert_eq!(bytes(&image, &wanted([1, 1], [0, 0]), PixelFormat::MONO_8), [255]);
    }
}
