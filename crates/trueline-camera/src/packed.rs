//! Samples of 10 and 12 bits that share bytes.

use crate::pixel_format::Samples;

/// The levels of consecutive samples, scaled so that white is the same in every picture of 16 bits. Other data may follow.
/// `None` if there are fewer bytes than samples, or if they share none.
#[must_use]
pub(crate) fn levels(data: &[u8], count: usize, samples: Samples) -> Option<Vec<u16>> {
    // The layout of GigE Vision 1 takes the same space for 10 bits as for 12.
    let on_wire = if samples == Samples::TenPacked { 12 } else { samples.bits() as usize };
    let data = data.get(..count.checked_mul(on_wire)?.div_ceil(8))?;
    let up = 16 - samples.bits();
    let level = |number: usize| match samples {
        Samples::TenP => Some(bits(data, 10 * number) & 0x3ff),
        Samples::TwelveP => Some(bits(data, 12 * number) & 0xfff),
        Samples::TenPacked => Some(shared(data, number, 2)),
        Samples::TwelvePacked => Some(shared(data, number, 4)),
        Samples::Eight | Samples::Ten | Samples::Twelve | Samples::Sixteen => None,
    };
    (0..count).map(|number| level(number).map(|level| level << up)).collect()
}

/// The bits from one on, the lowest first; no level reaches beyond the second byte.
fn bits(data: &[u8], from: usize) -> u16 {
    let byte = |at: usize| data.get(at).copied().unwrap_or_default();
    u16::from_le_bytes([byte(from / 8), byte(from / 8 + 1)]) >> (from % 8)
}

/// A level of one of two pixels in three bytes. Its high bits are in the first byte or the last, its `low` lowest bits in
/// the lower or the upper half of the middle one.
fn shared(data: &[u8], pixel: usize, low: u32) -> u16 {
    let byte = |at: usize| u16::from(data.get(pixel / 2 * 3 + at).copied().unwrap_or_default());
    let (high, half) = if pixel.is_multiple_of(2) { (byte(0), byte(1)) } else { (byte(2), byte(1) >> 4) };
    high << low | half & ((1 << low) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four levels and their bytes, bit by bit as the pixel format naming convention and GigE Vision 1 draw them.
    const LEVELS_10: [u16; 4] = [0b10_1100_1101, 0b01_0011_0010, 0b11_1111_1111, 0b00_0000_0001];
    const MONO_10_P: [u8; 5] = [0b1100_1101, 0b1100_1010, 0b1111_0100, 0b0111_1111, 0b0000_0000];
    const MONO_10_PACKED: [u8; 6] =
        [0b1011_0011, 0b0010_0001, 0b0100_1100, 0b1111_1111, 0b0001_0011, 0b0000_0000];
    const LEVELS_12: [u16; 4] = [0xabc, 0x123, 0xfff, 0x001];
    const MONO_12_P: [u8; 6] = [0xbc, 0x3a, 0x12, 0xff, 0x1f, 0x00];
    const MONO_12_PACKED: [u8; 6] = [0xab, 0x3c, 0x12, 0xff, 0x1f, 0x00];

    const CASES: [(Samples, [u16; 4], &[u8]); 4] = [
        (Samples::TenP, LEVELS_10, &MONO_10_P),
        (Samples::TenPacked, LEVELS_10, &MONO_10_PACKED),
        (Samples::TwelveP, LEVELS_12, &MONO_12_P),
        (Samples::TwelvePacked, LEVELS_12, &MONO_12_PACKED),
    ];

    #[test]
    fn levels_are_where_the_formats_have_them() {
        for (samples, expected, data) in CASES {
            let up = 16 - samples.bits();
            let expected = expected.map(|level| level << up);
            assert_eq!(levels(data, 4, samples).unwrap(), expected, "{samples:?}");
            // With an odd number of samples the last byte is shared with the following data.
            assert_eq!(levels(data, 3, samples).unwrap(), expected[..3], "{samples:?}, three");
            assert_eq!(levels(&data[..data.len() - 1], 4, samples), None, "{samples:?}, cut off");
            assert_eq!(levels(data, usize::MAX / 8, samples), None, "{samples:?}, more than can be counted");
        }
        assert_eq!(levels(&[0; 9], 1, Samples::Twelve), None);
    }
}
