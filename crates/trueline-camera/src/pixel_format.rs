//! Pixel formats by the pixel format naming convention (PFNC) of GenICam.

use std::fmt;

/// Format of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelFormat {
    /// A gray level.
    Mono(Samples),
    /// One colour of three, which depends on the pixel's place.
    Bayer(Mosaic, Samples),
    /// Red, green and blue in 8 bits each.
    Rgb8,
    /// Blue, green and red in 8 bits each.
    Bgr8,
    /// Range data: coordinate C in 16 bits.
    Coord3dC16,
    /// Range data: coordinates A and C in 16 bits each.
    Coord3dAc16,
}

/// How the bits of a sample are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// 8 bits.
    Eight,
    /// 10 bits in two bytes.
    Ten,
    /// 12 bits in two bytes.
    Twelve,
    /// 16 bits.
    Sixteen,
    /// 10 bits one after the other, the lowest first: four samples in five bytes.
    TenP,
    /// 12 bits one after the other, the lowest first: two samples in three bytes.
    TwelveP,
    /// As GigE Vision 1 packed 10 bits: two samples in three bytes, their lowest bits in the middle one.
    TenPacked,
    /// As GigE Vision 1 packed 12 bits: two samples in three bytes, their lowest bits in the middle one.
    TwelvePacked,
}

impl Samples {
    /// Bits of a sample that say something.
    #[must_use]
    pub fn bits(self) -> u32 {
        match self {
            Self::Eight => 8,
            Self::Ten | Self::TenP | Self::TenPacked => 10,
            Self::Twelve | Self::TwelveP | Self::TwelvePacked => 12,
            Self::Sixteen => 16,
        }
    }

    /// Whether samples share bytes.
    #[must_use]
    pub fn is_packed(self) -> bool {
        matches!(self, Self::TenP | Self::TwelveP | Self::TenPacked | Self::TwelvePacked)
    }
}

/// The colours of the first two pixels of the first two rows of a mosaic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mosaic {
    /// Green, red; blue, green.
    Gr,
    /// Red, green; green, blue.
    Rg,
    /// Green, blue; red, green.
    Gb,
    /// Blue, green; green, red.
    Bg,
}

impl Mosaic {
    /// Columns and rows modulo two of red; blue is diagonally opposite.
    #[must_use]
    pub fn red(self) -> [usize; 2] {
        match self {
            Self::Gr => [1, 0],
            Self::Rg => [0, 0],
            Self::Gb => [0, 1],
            Self::Bg => [1, 1],
        }
    }
}

/// Every format with its name and code \[PFNC 2.1\].
const ALL: [(PixelFormat, &str, u32); 44] = {
    use Mosaic::{Bg, Gb, Gr, Rg};
    use PixelFormat::{Bayer, Bgr8, Coord3dAc16, Coord3dC16, Mono, Rgb8};
    use Samples::{Eight, Sixteen, Ten, TenP, TenPacked, Twelve, TwelveP, TwelvePacked};
    [
        (Mono(Eight), "Mono8", 0x0108_0001),
        (Mono(Ten), "Mono10", 0x0110_0003),
        (Mono(Twelve), "Mono12", 0x0110_0005),
        (Mono(Sixteen), "Mono16", 0x0110_0007),
        (Mono(TenP), "Mono10p", 0x010A_0046),
        (Mono(TwelveP), "Mono12p", 0x010C_0047),
        (Mono(TenPacked), "Mono10Packed", 0x010C_0004),
        (Mono(TwelvePacked), "Mono12Packed", 0x010C_0006),
        (Bayer(Gr, Eight), "BayerGR8", 0x0108_0008),
        (Bayer(Rg, Eight), "BayerRG8", 0x0108_0009),
        (Bayer(Gb, Eight), "BayerGB8", 0x0108_000A),
        (Bayer(Bg, Eight), "BayerBG8", 0x0108_000B),
        (Bayer(Gr, Ten), "BayerGR10", 0x0110_000C),
        (Bayer(Rg, Ten), "BayerRG10", 0x0110_000D),
        (Bayer(Gb, Ten), "BayerGB10", 0x0110_000E),
        (Bayer(Bg, Ten), "BayerBG10", 0x0110_000F),
        (Bayer(Gr, Twelve), "BayerGR12", 0x0110_0010),
        (Bayer(Rg, Twelve), "BayerRG12", 0x0110_0011),
        (Bayer(Gb, Twelve), "BayerGB12", 0x0110_0012),
        (Bayer(Bg, Twelve), "BayerBG12", 0x0110_0013),
        (Bayer(Gr, Sixteen), "BayerGR16", 0x0110_002E),
        (Bayer(Rg, Sixteen), "BayerRG16", 0x0110_002F),
        (Bayer(Gb, Sixteen), "BayerGB16", 0x0110_0030),
        (Bayer(Bg, Sixteen), "BayerBG16", 0x0110_0031),
        (Bayer(Gr, TenP), "BayerGR10p", 0x010A_0056),
        (Bayer(Rg, TenP), "BayerRG10p", 0x010A_0058),
        (Bayer(Gb, TenP), "BayerGB10p", 0x010A_0054),
        (Bayer(Bg, TenP), "BayerBG10p", 0x010A_0052),
        (Bayer(Gr, TwelveP), "BayerGR12p", 0x010C_0057),
        (Bayer(Rg, TwelveP), "BayerRG12p", 0x010C_0059),
        (Bayer(Gb, TwelveP), "BayerGB12p", 0x010C_0055),
        (Bayer(Bg, TwelveP), "BayerBG12p", 0x010C_0053),
        (Bayer(Gr, TenPacked), "BayerGR10Packed", 0x010C_0026),
        (Bayer(Rg, TenPacked), "BayerRG10Packed", 0x010C_0027),
        (Bayer(Gb, TenPacked), "BayerGB10Packed", 0x010C_0028),
        (Bayer(Bg, TenPacked), "BayerBG10Packed", 0x010C_0029),
        (Bayer(Gr, TwelvePacked), "BayerGR12Packed", 0x010C_002A),
        (Bayer(Rg, TwelvePacked), "BayerRG12Packed", 0x010C_002B),
        (Bayer(Gb, TwelvePacked), "BayerGB12Packed", 0x010C_002C),
        (Bayer(Bg, TwelvePacked), "BayerBG12Packed", 0x010C_002D),
        (Rgb8, "RGB8", 0x0218_0014),
        (Bgr8, "BGR8", 0x0218_0015),
        (Coord3dC16, "Coord3D_C16", 0x0110_00B8),
        (Coord3dAc16, "Coord3D_AC16", 0x0220_00BB),
    ]
};

/// Its name in the first version of GigE Vision.
const RGB8_BEFORE: &str = "RGB8Packed";

impl PixelFormat {
    /// Gray levels of 8 bits.
    pub const MONO_8: Self = Self::Mono(Samples::Eight);
    /// Gray levels of 10 bits in two bytes.
    pub const MONO_10: Self = Self::Mono(Samples::Ten);
    /// Gray levels of 12 bits in two bytes.
    pub const MONO_12: Self = Self::Mono(Samples::Twelve);
    /// Gray levels of 16 bits.
    pub const MONO_16: Self = Self::Mono(Samples::Sixteen);

    /// Formats in which range data come, the preferred one first. Mono16 is one if a profiler was set to it.
    pub const RANGE: [Self; 3] = [Self::Coord3dC16, Self::Coord3dAc16, Self::MONO_16];

    /// Gray levels with bits that share bytes.
    pub const PACKED: [Self; 4] = [
        Self::Mono(Samples::TenP),
        Self::Mono(Samples::TwelveP),
        Self::Mono(Samples::TenPacked),
        Self::Mono(Samples::TwelvePacked),
    ];

    /// Formats of pictures.
    pub fn pictures() -> impl Iterator<Item = Self> {
        ALL.into_iter().map(|(format, ..)| format).filter(|format| format.samples().is_some())
    }

    /// Name in the standard features naming convention.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// Code in the pixel format naming convention.
    #[must_use]
    pub fn code(self) -> u32 {
        self.row().2
    }

    /// Every format is in the table, which a test proves.
    fn row(self) -> (Self, &'static str, u32) {
        ALL.into_iter().find(|(format, ..)| *format == self).unwrap_or(ALL[0])
    }

    /// The format of a code.
    #[must_use]
    pub fn of_code(code: u32) -> Option<Self> {
        ALL.into_iter().find(|(.., known)| *known == code).map(|(format, ..)| format)
    }

    /// The format of a name.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        let name = if name == RGB8_BEFORE { "RGB8" } else { name };
        ALL.into_iter().find(|(_, known, _)| *known == name).map(|(format, ..)| format)
    }

    /// Bytes of pixels one after the other; of packed ones the last byte may be shared. `None` for more than can be counted.
    #[must_use]
    pub fn bytes_of(self, pixels: usize) -> Option<usize> {
        // Bits on the wire are the third byte of the code.
        let bits = (self.code() >> 16 & 0xff) as usize;
        pixels.checked_mul(bits).map(|bits| bits.div_ceil(8))
    }

    /// How a picture's samples are sent; `None` for range data.
    #[must_use]
    pub fn samples(self) -> Option<Samples> {
        match self {
            Self::Mono(samples) | Self::Bayer(_, samples) => Some(samples),
            Self::Rgb8 | Self::Bgr8 => Some(Samples::Eight),
            Self::Coord3dC16 | Self::Coord3dAc16 => None,
        }
    }

    /// Bits of a number that say something.
    #[must_use]
    pub fn bits(self) -> u32 {
        self.samples().map_or(16, Samples::bits)
    }

    /// Whether pictures have colours.
    #[must_use]
    pub fn has_colours(self) -> bool {
        matches!(self, Self::Bayer(..) | Self::Rgb8 | Self::Bgr8)
    }
}

impl fmt::Display for PixelFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_is_in_the_table_once_and_says_its_bits() {
        let mut samples = vec![Samples::Eight, Samples::Ten, Samples::Twelve, Samples::Sixteen];
        samples.extend([Samples::TenP, Samples::TwelveP, Samples::TenPacked, Samples::TwelvePacked]);
        let mosaics = [Mosaic::Gr, Mosaic::Rg, Mosaic::Gb, Mosaic::Bg];
        let mut formats: Vec<PixelFormat> = samples.iter().map(|s| PixelFormat::Mono(*s)).collect();
        formats.extend(mosaics.iter().flat_map(|m| samples.iter().map(|s| PixelFormat::Bayer(*m, *s))));
        formats.extend([
            PixelFormat::Rgb8,
            PixelFormat::Bgr8,
            PixelFormat::Coord3dC16,
            PixelFormat::Coord3dAc16,
        ]);
        assert_eq!(formats.len(), ALL.len());
        for format in formats {
            assert_eq!(format.row().0, format);
            assert_eq!(PixelFormat::of_code(format.code()), Some(format));
            assert_eq!(PixelFormat::of_name(format.name()), Some(format));
            // The name contains the colours of the mosaic and the bits.
            let name = format.name();
            if let PixelFormat::Bayer(mosaic, _) = format {
                assert!(
                    name.starts_with(&format!("Bayer{mosaic:?}").to_uppercase().replace("BAYER", "Bayer")),
                    "{name}"
                );
            }
            if let Some(samples) = format.samples() {
                let digits: String = name.chars().filter(char::is_ascii_digit).collect();
                assert_eq!(digits, samples.bits().to_string(), "{name}");
                assert_eq!(name.ends_with('p') || name.ends_with("Packed"), samples.is_packed(), "{name}");
                let channels = if name.starts_with("RGB") || name.starts_with("BGR") { 3 } else { 1 };
                let on_wire = match samples {
                    Samples::TenPacked => 12,
                    packed if packed.is_packed() => packed.bits(),
                    plain => plain.bits().next_multiple_of(8),
                };
                assert_eq!(format.bytes_of(8), Some((channels * on_wire) as usize), "{name}");
            }
        }
        assert_eq!(PixelFormat::of_name("RGB8Packed"), Some(PixelFormat::Rgb8));
        assert_eq!(PixelFormat::of_name("YUV422_8"), None);
    }
}
