//! What is set on a camera before it begins.

use crate::pixel_format::PixelFormat;
use crate::trigger::Trigger;
use trueline_dataset::Channel;

/// What is set on a camera that has GenICam features; `None` leaves it as it is. Its triggers are turned off unless asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraSetup {
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
    /// Pictures a second, Hz; of a camera that runs by itself.
    pub fps: Option<f64>,
    /// What begins an exposure.
    pub trigger: Trigger,
}
