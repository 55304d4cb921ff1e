//! How the bytes of a Video4Linux buffer are a picture.

use crate::gray_image::gray_image;
use crate::pixel_format::{Mosaic, PixelFormat, Samples};
use trueline_dataset::decoded_picture::{self, DecodedPicture};
use trueline_dataset::{Channel, GrayImage, Pixels};

/// How the bytes of a buffer are a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// Samples as cameras of machine vision send them.
    Samples(PixelFormat),
    /// A gray level and a colour difference by turns; the gray level is the first or the second byte of two.
    Luma {
        /// One of the two.
        byte: usize,
    },
    /// A JPEG picture.
    Jpeg,
}

/// The codes of four characters that are understood \[Linux, videodev2.h\].
const KNOWN: [(&[u8; 4], Layout); 23] = {
    use Layout::{Jpeg, Luma};
    use Mosaic::{Bg, Gb, Gr, Rg};
    use PixelFormat::{Bgr8, Rgb8};
    use Samples::{Eight, Sixteen, Ten, Twelve};
    const fn mono(samples: Samples) -> Layout {
        Layout::Samples(PixelFormat::Mono(samples))
    }
    const fn bayer(mosaic: Mosaic, samples: Samples) -> Layout {
        Layout::Samples(PixelFormat::Bayer(mosaic, samples))
    }
    [
        (b"GREY", mono(Eight)),
        (b"Y10 ", mono(Ten)),
        (b"Y12 ", mono(Twelve)),
        (b"Y16 ", mono(Sixteen)),
        (b"RGB3", Layout::Samples(Rgb8)),
        (b"BGR3", Layout::Samples(Bgr8)),
        (b"BA81", bayer(Bg, Eight)),
        (b"GBRG", bayer(Gb, Eight)),
        (b"GRBG", bayer(Gr, Eight)),
        (b"RGGB", bayer(Rg, Eight)),
        (b"BG10", bayer(Bg, Ten)),
        (b"GB10", bayer(Gb, Ten)),
        (b"BA10", bayer(Gr, Ten)),
        (b"RG10", bayer(Rg, Ten)),
        (b"BG12", bayer(Bg, Twelve)),
        (b"GB12", bayer(Gb, Twelve)),
        (b"BA12", bayer(Gr, Twelve)),
        (b"RG12", bayer(Rg, Twelve)),
        (b"RG16", bayer(Rg, Sixteen)),
        (b"YUYV", Luma { byte: 0 }),
        (b"UYVY", Luma { byte: 1 }),
        (b"MJPG", Jpeg),
        (b"JPEG", Jpeg),
    ]
};

impl Layout {
    /// The layout of a code of four characters.
    pub(super) fn of_code(code: [u8; 4]) -> Option<Self> {
        KNOWN.into_iter().find(|(known, _)| **known == code).map(|(_, layout)| layout)
    }

    /// The code of a pixel format.
    pub(super) fn code_of(format: PixelFormat) -> Option<[u8; 4]> {
        KNOWN.into_iter().find(|(_, layout)| *layout == Self::Samples(format)).map(|(code, _)| *code)
    }

    /// Whether a channel other than gray is there to be taken.
    pub(super) fn has_colours(self) -> bool {
        match self {
            Self::Samples(format) => format.has_colours(),
            Self::Luma { .. } => false,
            Self::Jpeg => true,
        }
    }

    /// Whether the user must state the channel: only some formats have gray as a channel of its own.
    pub(super) fn needs_channel(self) -> bool {
        matches!(self, Self::Samples(format) if format.has_colours())
    }

    /// The picture of columns and rows in a buffer with a given distance of lines in bytes; `None` if the buffer is
    /// too short.
    pub(super) fn picture(
        self,
        data: &[u8],
        size: [u32; 2],
        stride: usize,
        channel: Channel,
    ) -> Option<GrayImage> {
        let [width, height] = size.map(|px| px as usize);
        match self {
            Self::Samples(format) => {
                let padding = stride.saturating_sub(format.bytes_of(width)?);
                gray_image(data, size, format, padding, channel)
            }
            Self::Luma { byte } => {
                let stride = stride.max(width.checked_mul(2)?);
                let rows = data.chunks(stride).take(height);
                let levels: Vec<u8> = rows
                    .flat_map(|row| row.chunks_exact(2).take(width).filter_map(|pair| pair.get(byte)))
                    .copied()
                    .collect();
                let is_whole = levels.len() == width.checked_mul(height)? && !levels.is_empty();
                is_whole.then_some(GrayImage { width, height, pixels: Pixels::Eight(levels) })
            }
            Self::Jpeg => {
                let decoded: DecodedPicture = decoded_picture::decode(data).ok()?;
                (decoded.width == width && decoded.height == height).then(|| channel.image(decoded))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_those_of_the_kernel_and_each_has_its_own() {
        for (at, (code, layout)) in KNOWN.into_iter().enumerate() {
            assert_eq!(Layout::of_code(*code), Some(layout));
            assert!(KNOWN[..at].iter().all(|(other, _)| *other != code));
            if let Layout::Samples(format) = layout {
                assert_eq!(Layout::code_of(format), Some(*code), "{format}");
            }
        }
        assert_eq!(Layout::of_code(*b"H264"), None);
        assert_eq!(Layout::code_of(PixelFormat::Mono(Samples::TwelveP)), None);
    }

    #[test]
    fn the_gray_levels_of_yuyv_are_every_second_byte_and_lines_may_be_filled_up() {
        let line = [10, 128, 20, 129, 0xee, 0xee];
        let data = [line, [30, 130, 40, 131, 0xee, 0xee]].concat();
        let read = |layout: Layout, data: &[u8], stride| layout.picture(data, [2, 2], stride, Channel::Gray);
        let levels = |picture: Option<GrayImage>| picture.map(|picture| picture.pixels);
        let first = Layout::Luma { byte: 0 };
        assert_eq!(levels(read(first, &data, 6)), Some(Pixels::Eight(vec![10, 20, 30, 40])));
        let second = Layout::Luma { byte: 1 };
        assert_eq!(levels(read(second, &data, 6)), Some(Pixels::Eight(vec![128, 129, 130, 131])));
        assert_eq!(read(first, &data[..9], 6), None, "cut off");
        let plain = [10, 0, 20, 0, 30, 0, 40, 0];
        // A driver that does not state the distance of lines writes 0.
        assert_eq!(levels(read(first, &plain, 0)), Some(Pixels::Eight(vec![10, 20, 30, 40])));
    }

    #[test]
    fn samples_and_pictures_that_are_none() {
        let gray = Layout::Samples(PixelFormat::MONO_8);
        let picture = gray.picture(&[1, 2, 9, 3, 4, 9], [2, 2], 3, Channel::Gray);
        assert_eq!(picture.map(|picture| picture.pixels), Some(Pixels::Eight(vec![1, 2, 3, 4])));
        let ten =
            Layout::Samples(PixelFormat::MONO_10).picture(&[0xff, 0x03, 1, 0], [2, 1], 4, Channel::Gray);
        assert_eq!(ten.map(|picture| picture.pixels), Some(Pixels::Sixteen(vec![0xffc0, 0x0040])));
        assert_eq!(Layout::Jpeg.picture(b"\xff\xd8 no picture", [2, 2], 0, Channel::Gray), None);
        assert!(Layout::Jpeg.has_colours() && !Layout::Jpeg.needs_channel());
        assert!(!Layout::Luma { byte: 0 }.has_colours());
    }

    /// A picture of 16 × 8 px with columns of the levels 0, 16, 32 …, by the Python package Pillow 13; without its tables,
    /// and marked, as cameras send them.
    const MJPG: &str = "ffd8ffe000104156493100000000000000000000ffdb0043000302020302020303030304030304050805050404050a070706\
        080c0a0c0c0b0a0b0b0d0e12100d0e110e0b0b1016101113141515150c0f171816141812141514ffc0000b08000800100101\
        1100ffda0008010100003f00f8ff00f66dff00975fc2bf557f66dff975fc2bffd9";

    #[test]
    fn a_jpeg_of_a_camera_needs_no_tables_of_its_own() {
        let digit = |at: usize| u8::from_str_radix(&MJPG[at..at + 2], 16).unwrap();
        let bytes: Vec<u8> = (0..MJPG.len()).step_by(2).map(digit).collect();
        for channel in [Channel::Gray, Channel::Red] {
            let image = Layout::Jpeg.picture(&bytes, [16, 8], 0, channel).unwrap();
            let Pixels::Eight(levels) = image.pixels else { panic!("a JPEG has 8 bits") };
            for (at, level) in levels.iter().enumerate() {
                let put_in = 16 * (at % 16);
                // Quality 90: Pillow's own reading is off by one at most, and decoders round differently.
                assert!(usize::from(*level).abs_diff(put_in) <= 3, "{at}: {level} for {put_in}");
            }
        }
        assert_eq!(Layout::Jpeg.picture(&bytes, [8, 16], 0, Channel::Gray), None, "another size");
        assert_eq!(Layout::Jpeg.picture(&bytes[..60], [16, 8], 0, Channel::Gray), None, "cut off");
    }
}
