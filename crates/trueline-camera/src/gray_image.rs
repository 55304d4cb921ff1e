//! The bytes of a camera as a picture of gray levels.

use crate::mosaic;
use crate::packed;
use crate::pixel_format::{PixelFormat, Samples};
use trueline_dataset::decoded_picture::DecodedPicture;
use trueline_dataset::{Channel, GrayImage, Pixels};

/// The bytes of a stream as a picture of columns and rows; lines may be filled up with `padding` bytes, and other data may follow. Of colours
/// the channel is taken. `None` if there are fewer bytes than pixels.
#[must_use]
pub fn gray_image(
    data: &[u8],
    size: [u32; 2],
    format: PixelFormat,
    padding: usize,
    channel: Channel,
) -> Option<GrayImage> {
    let [width, height] = size.map(|px| px as usize);
    if width == 0 || height == 0 {
        return None;
    }
    // With both coordinates of range data a column is two numbers.
    let (samples, numbers) = match format {
        PixelFormat::Mono(samples) | PixelFormat::Bayer(_, samples) => (samples, 1),
        PixelFormat::Rgb8 | PixelFormat::Bgr8 => (Samples::Eight, 3),
        PixelFormat::Coord3dC16 => (Samples::Sixteen, 1),
        PixelFormat::Coord3dAc16 => (Samples::Sixteen, 2),
    };
    let row = Row { bytes: format.bytes_of(width)?, numbers: width.checked_mul(numbers)?, padding };
    let levels = levels(data, height, &row, samples)?;
    Some(match format {
        PixelFormat::Bayer(mosaic, _) => {
            let pixels = match levels {
                Pixels::Eight(levels) => {
                    Pixels::Eight(mosaic::plane(&levels, [width, height], mosaic, channel))
                }
                Pixels::Sixteen(levels) => {
                    Pixels::Sixteen(mosaic::plane(&levels, [width, height], mosaic, channel))
                }
            };
            GrayImage { width, height, pixels }
        }
        PixelFormat::Rgb8 => channel.image(DecodedPicture { width, height, channels: 3, levels }),
        PixelFormat::Bgr8 => {
            let channel = match channel {
                Channel::Red => Channel::Blue,
                Channel::Blue => Channel::Red,
                other => other,
            };
            let levels = if channel == Channel::Gray { reversed(levels) } else { levels };
            channel.image(DecodedPicture { width, height, channels: 3, levels })
        }
        PixelFormat::Mono(_) | PixelFormat::Coord3dC16 | PixelFormat::Coord3dAc16 => {
            GrayImage { width: row.numbers, height, pixels: levels }
        }
    })
}

/// A line of a picture.
struct Row {
    bytes: usize,
    numbers: usize,
    padding: usize,
}

/// All levels of a picture. Levels of more than 8 bits are shifted up, so that white is the same in every picture of 16
/// bits.
fn levels(data: &[u8], height: usize, row: &Row, samples: Samples) -> Option<Pixels> {
    if row.padding == 0 && samples.is_packed() {
        // Bits go on from one line to the next where a line ends within a byte.
        return packed::levels(data, row.numbers.checked_mul(height)?, samples).map(Pixels::Sixteen);
    }
    let stride = row.bytes.checked_add(row.padding)?;
    if data.len() < stride.checked_mul(height)?.saturating_sub(row.padding) || stride == 0 {
        return None;
    }
    let rows = data.chunks(stride).take(height).map(|line| &line[..row.bytes]);
    Some(match samples {
        Samples::Eight if row.padding == 0 => Pixels::Eight(data[..row.bytes * height].to_vec()),
        Samples::Eight => Pixels::Eight(rows.flatten().copied().collect()),
        samples if samples.is_packed() => {
            let lines = rows.map(|line| packed::levels(line, row.numbers, samples));
            Pixels::Sixteen(lines.collect::<Option<Vec<_>>>()?.concat())
        }
        samples => {
            let up = 16 - samples.bits();
            let pairs = rows.flat_map(|line| line.chunks_exact(2));
            Pixels::Sixteen(pairs.map(|pair| u16::from_le_bytes([pair[0], pair[1]]) << up).collect())
        }
    })
}

/// Blue, green, red as red, green, blue.
fn reversed(levels: Pixels) -> Pixels {
    match levels {
        Pixels::Eight(mut levels) => {
            levels.chunks_exact_mut(3).for_each(<[u8]>::reverse);
            Pixels::Eight(levels)
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel_format::Mosaic;

    fn gray(data: &[u8], size: [u32; 2], format: PixelFormat, padding: usize) -> Option<GrayImage> {
        gray_image(data, size, format, padding, Channel::Gray)
    }

    #[test]
    fn lines_that_are_filled_up_are_cut() {
        let pixels = |data: &[u8], padding| gray(data, [3, 2], PixelFormat::MONO_8, padding);
        let image = pixels(&[1, 2, 3, 99, 4, 5, 6], 1).unwrap();
        assert_eq!(image.pixels, Pixels::Eight(vec![1, 2, 3, 4, 5, 6]));
        assert_eq!(pixels(&[1, 2, 3, 4, 5], 0), None, "one pixel too few");
        assert_eq!(gray(&[0; 99], [u32::MAX; 2], PixelFormat::MONO_16, 0), None, "more than can be counted");
    }

    #[test]
    fn white_is_white_in_every_format_of_two_bytes() {
        for format in [PixelFormat::MONO_10, PixelFormat::MONO_12, PixelFormat::MONO_16] {
            let white = ((1_u32 << format.bits()) - 1) as u16;
            let data: Vec<u8> = [white, 1].iter().flat_map(|v| v.to_le_bytes()).collect();
            let Pixels::Sixteen(levels) = gray(&data, [2, 1], format, 0).unwrap().pixels else {
                panic!("16 bits were asked for")
            };
            let step = 1 << (16 - format.bits());
            assert_eq!(levels, [u16::MAX - (step - 1), step]);
        }
    }

    #[test]
    fn packed_lines_go_on_within_a_byte_unless_they_are_filled_up() {
        // Three levels of 12 bits: 0xabc, 0x123, 0xfff; the fourth half byte belongs to the next line.
        let line = [0xbc, 0x3a, 0x12, 0xff, 0x1f, 0x00];
        let format = PixelFormat::Mono(Samples::TwelveP);
        let read = |data: &[u8], size, padding| match gray(data, size, format, padding).unwrap().pixels {
            Pixels::Sixteen(levels) => levels,
            Pixels::Eight(_) => panic!("{format} has more than 8 bits"),
        };
        let expected = [0xabc0, 0x1230, 0xfff0, 0x0010];
        assert_eq!(read(&line, [4, 1], 0), expected);
        assert_eq!(read(&line, [2, 2], 0), expected);
        let twice: Vec<u8> = [&line[..], &[0xee; 2], &line].concat();
        assert_eq!(read(&twice, [4, 2], 2), [expected, expected].concat());
        assert_eq!(gray(&line, [u32::MAX; 2], format, 0), None);
    }

    #[test]
    fn the_channel_of_a_colour_picture_is_taken() {
        let colours = [[200, 100, 50], [10, 20, 30]].concat();
        for (channel, rgb, bgr) in [
            (Channel::Red, [200, 10], [50, 30]),
            (Channel::Green, [100, 20], [100, 20]),
            (Channel::Blue, [50, 30], [200, 10]),
            // 0.299 red, 0.587 green and 0.114 blue.
            (Channel::Gray, [124, 18], [96, 22]),
        ] {
            for (format, expected) in [(PixelFormat::Rgb8, rgb), (PixelFormat::Bgr8, bgr)] {
                let found = gray_image(&colours, [2, 1], format, 0, channel).unwrap();
                assert_eq!(
                    (found.width, found.pixels),
                    (2, Pixels::Eight(expected.to_vec())),
                    "{format} {channel:?}"
                );
            }
        }
        let mosaic = PixelFormat::Bayer(Mosaic::Rg, Samples::Eight);
        let found = gray_image(&[9, 0, 0, 0], [2, 2], mosaic, 0, Channel::Red).unwrap();
        assert_eq!(found.pixels, Pixels::Eight(vec![9; 4]));
        // 12 bits one after the other: 0xabc is red.
        let mosaic = PixelFormat::Bayer(Mosaic::Rg, Samples::TwelveP);
        let found = gray_image(&[0xbc, 0x0a, 0, 0, 0, 0], [2, 2], mosaic, 0, Channel::Red).unwrap();
        assert_eq!(found.pixels, Pixels::Sixteen(vec![0xabc0; 4]));
    }
}
