//! What is asked of a camera.

use std::fmt;
use std::net::Ipv4Addr;

/// What is asked of a camera; `None` leaves the camera as it is.
#[derive(Clone, Debug, PartialEq)]
pub struct GigeSettings {
    /// Its address.
    pub address: Ipv4Addr,
    /// Columns, px.
    pub width: Option<u32>,
    /// Rows, px.
    pub height: Option<u32>,
    /// First column and row on the sensor, px.
    pub offset: Option<[u32; 2]>,
    /// Pixel format of pictures.
    pub pixel: PixelFormat,
    /// Profiles are wanted instead of pictures: in the format that the camera is set to, if it is one of range data, else in the
    /// first of [`PixelFormat::RANGE`] that it offers.
    pub profiles: bool,
    /// Exposure time, µs.
    pub exposure_us: Option<f64>,
    /// Packet size on the wire, bytes; `None` asks for the largest that the network carries.
    pub packet_size: Option<u16>,
    /// Pictures a second, Hz.
    pub fps: Option<f64>,
}

impl GigeSettings {
    /// Pictures of 8 bits from the camera at an address, all else as the camera is set.
    #[must_use]
    pub fn at(address: Ipv4Addr) -> Self {
        Self {
            address,
            width: None,
            height: None,
            offset: None,
            pixel: PixelFormat::Mono8,
            profiles: false,
            exposure_us: None,
            packet_size: None,
            fps: None,
        }
    }
}

/// Gray levels and range data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelFormat {
    /// 8 bits.
    Mono8,
    /// 10 bits in two bytes.
    Mono10,
    /// 12 bits in two bytes.
    Mono12,
    /// 10 bits one after the other, the lowest first: four pixels in five bytes.
    Mono10p,
    /// 12 bits one after the other, the lowest first: two pixels in three bytes.
    Mono12p,
    /// As GigE Vision 1 packed 10 bits: two pixels in three bytes, their lowest bits in the middle one.
    Mono10Packed,
    /// As GigE Vision 1 packed 12 bits: two pixels in three bytes, their lowest bits in the middle one.
    Mono12Packed,
    /// 16 bits.
    Mono16,
    /// Range data: coordinate C in 16 bits.
    Coord3dC16,
    /// Range data: coordinates A and C in 16 bits each.
    Coord3dAc16,
}

impl PixelFormat {
    /// Formats in which range data come, the preferred one first. Mono16 is one if a profiler was set to it.
    pub const RANGE: [Self; 3] = [Self::Coord3dC16, Self::Coord3dAc16, Self::Mono16];

    /// Gray levels whose bits share bytes.
    pub const PACKED: [Self; 4] = [Self::Mono10p, Self::Mono12p, Self::Mono10Packed, Self::Mono12Packed];

    /// Name in the standard features naming convention.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Mono8 => "Mono8",
            Self::Mono10 => "Mono10",
            Self::Mono12 => "Mono12",
            Self::Mono10p => "Mono10p",
            Self::Mono12p => "Mono12p",
            Self::Mono10Packed => "Mono10Packed",
            Self::Mono12Packed => "Mono12Packed",
            Self::Mono16 => "Mono16",
            Self::Coord3dC16 => "Coord3D_C16",
            Self::Coord3dAc16 => "Coord3D_AC16",
        }
    }

    /// Code in the pixel format naming convention.
    #[must_use]
    pub fn code(self) -> u32 {
        match self {
            Self::Mono8 => 0x0108_0001,
            Self::Mono10 => 0x0110_0003,
            Self::Mono12 => 0x0110_0005,
            Self::Mono10p => 0x010A_0046,
            Self::Mono12p => 0x010C_0047,
            Self::Mono10Packed => 0x010C_0004,
            Self::Mono12Packed => 0x010C_0006,
            Self::Mono16 => 0x0110_0007,
            Self::Coord3dC16 => 0x0110_00B8,
            Self::Coord3dAc16 => 0x0220_00BB,
        }
    }

    /// The format of a code.
    #[must_use]
    pub(crate) fn of_code(code: u32) -> Option<Self> {
        let gray = [Self::Mono8, Self::Mono10, Self::Mono12];
        gray.into_iter().chain(Self::PACKED).chain(Self::RANGE).find(|format| format.code() == code)
    }

    /// Bytes of pixels one after the other; of packed ones the last byte may be shared. `None` for more than can be counted.
    #[must_use]
    pub fn bytes_of(self, pixels: usize) -> Option<usize> {
        // Bits on the wire are the third byte of the code.
        let bits = (self.code() >> 16 & 0xff) as usize;
        pixels.checked_mul(bits).map(|bits| bits.div_ceil(8))
    }

    /// Bits of a number that say something.
    #[must_use]
    pub fn bits(self) -> u32 {
        match self {
            Self::Mono8 => 8,
            Self::Mono10 | Self::Mono10p | Self::Mono10Packed => 10,
            Self::Mono12 | Self::Mono12p | Self::Mono12Packed => 12,
            Self::Mono16 | Self::Coord3dC16 | Self::Coord3dAc16 => 16,
        }
    }
}

impl fmt::Display for PixelFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
