//! Gray levels of 10 and 12 bits that share bytes.

use super::settings::PixelFormat;

/// The levels of pixels one after the other, moved up so that white is the same in every picture of 16 bits; other data may
/// follow. `None` if there are fewer bytes than pixels, or if the format is not packed.
#[must_use]
pub(super) fn levels(data: &[u8], pixels: usize, format: PixelFormat) -> Option<Vec<u16>> {
    let data = data.get(..format.bytes_of(pixels)?)?;
    let up = 16 - format.bits();
    let level = |pixel: usize| match format {
        PixelFormat::Mono10p => Some(bits(data, 10 * pixel) & 0x3ff),
        PixelFormat::Mono12p => Some(bits(data, 12 * pixel) & 0xfff),
        PixelFormat::Mono10Packed => Some(shared(data, pixel, 2)),
        PixelFormat::Mono12Packed => Some(shared(data, pixel, 4)),
        _ => None,
    };
    (0..pixels).map(|pixel| level(pixel).map(|level| level << up)).collect()
}

/// The bits from one on, the lowest first; no level reaches beyond the second byte.
fn bits(data: &[u8], from: usize) -> u16 {
    let byte = |at: usize| data.get(at).copied().unwrap_or_default();
    u16::from_le_bytes([byte(from / 8), byte(from / 8 + 1)]) >> (from % 8)
}

/// A level of one of two pixels in three bytes: its high bits in the first byte or the last, its `low` lowest bits in the lower
/// or the upper half of the one between.
fn shared(data: &[u8], pixel: usize, low: u32) -> u16 {
    let byte = |at: usize| u16::from(data.get(pixel / 2 * 3 + at).copied().unwrap_or_default());
    let (high, half) = if pixel.is_multiple_of(2) { (byte(0), byte(1)) } else { (byte(2), byte(1) >> 4) };
    high << low | half & ((1 << low) - 1)
}

#[cfg(test)]
mod tests {
    use super::super::picture::gray_image;
    use super::*;
    use trueline_dataset::Pixels;

    /// Four levels and their bytes, bit by bit as the pixel format naming convention and GigE Vision 1 draw them.
    const LEVELS_10: [u16; 4] = [0b10_1100_1101, 0b01_0011_0010, 0b11_1111_1111, 0b00_0000_0001];
    const MONO_10_P: [u8; 5] = [0b1100_1101, 0b1100_1010, 0b1111_0100, 0b0111_1111, 0b0000_0000];
    const MONO_10_PACKED: [u8; 6] =
        [0b1011_0011, 0b0010_0001, 0b0100_1100, 0b1111_1111, 0b0001_0011, 0b0000_0000];
    const LEVELS_12: [u16; 4] = [0xabc, 0x123, 0xfff, 0x001];
    const MONO_12_P: [u8; 6] = [0xbc, 0x3a, 0x12, 0xff, 0x1f, 0x00];
    const MONO_12_PACKED: [u8; 6] = [0xab, 0x3c, 0x12, 0xff, 0x1f, 0x00];

    const CASES: [(PixelFormat, [u16; 4], &[u8]); 4] = [
        (PixelFormat::Mono10p, LEVELS_10, &MONO_10_P),
        (PixelFormat::Mono10Packed, LEVELS_10, &MONO_10_PACKED),
        (PixelFormat::Mono12p, LEVELS_12, &MONO_12_P),
        (PixelFormat::Mono12Packed, LEVELS_12, &MONO_12_PACKED),
    ];

    fn read(data: &[u8], size: [u32; 2], format: PixelFormat, padding: usize) -> Option<Vec<u16>> {
        match gray_image(data, size, format, padding)?.pixels {
            Pixels::Sixteen(levels) => Some(levels),
            Pixels::Eight(_) => panic!("{format} has more than 8 bits"),
        }
    }

    #[test]
    fn levels_are_where_the_formats_have_them() {
        for (format, levels, data) in CASES {
            let up = 16 - format.bits();
            let expected = levels.map(|level| level << up);
            assert_eq!(read(data, [4, 1], format, 0).unwrap(), expected, "{format}");
            assert_eq!(read(data, [2, 2], format, 0).unwrap(), expected, "{format}, two lines");
            // Of an odd number of pixels the last byte is shared with what follows.
            assert_eq!(read(data, [3, 1], format, 0).unwrap(), expected[..3], "{format}, three");
            assert_eq!(read(&data[..data.len() - 1], [4, 1], format, 0), None, "{format}, cut off");
            assert_eq!(read(data, [u32::MAX; 2], format, 0), None, "{format}, more than can be counted");
        }
    }

    #[test]
    fn lines_that_are_filled_up_begin_with_a_byte() {
        for (format, levels, data) in CASES {
            let up = 16 - format.bits();
            let twice: Vec<u8> = [data, &[0xee; 2], data].concat();
            let expected = [levels, levels].concat().iter().map(|level| level << up).collect::<Vec<_>>();
            assert_eq!(read(&twice, [4, 2], format, 2).unwrap(), expected, "{format}");
        }
    }
}
