//! What is asked of a camera.

use crate::pixel_format::PixelFormat;
use crate::trigger::Trigger;
use std::net::Ipv4Addr;
use trueline_dataset::Channel;

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
    /// Pixel format of pictures; `None` for the one that the camera is set to if it can be used, else gray levels of 8 bits.
    pub pixel: Option<PixelFormat>,
    /// What of a colour picture is looked at; a format with colours needs it.
    pub channel: Option<Channel>,
    /// Profiles are wanted instead of pictures: in the format that the camera is set to, if it is one of range data, else in the
    /// first of [`PixelFormat::RANGE`] that it offers.
    pub profiles: bool,
    /// Exposure time, µs.
    pub exposure_us: Option<f64>,
    /// Packet size on the wire, bytes; `None` asks for the largest that the network carries.
    pub packet_size: Option<u16>,
    /// Pictures a second, Hz; of a camera that runs by itself.
    pub fps: Option<f64>,
    /// What begins an exposure.
    pub trigger: Trigger,
}

impl GigeSettings {
    /// Pictures from the camera at an address, as it is set, but for its triggers, which are off.
    #[must_use]
    pub fn at(address: Ipv4Addr) -> Self {
        Self {
            address,
            width: None,
            height: None,
            offset: None,
            pixel: None,
            channel: None,
            profiles: false,
            exposure_us: None,
            packet_size: None,
            fps: None,
            trigger: Trigger::Off,
        }
    }
}
