//! Settings of a camera before it starts.

use crate::pixel_format::PixelFormat;
use crate::trigger::Trigger;
use trueline_dataset::Channel;

/// Settings of a camera with GenICam features; `None` changes nothing. Its triggers are turned off unless requested.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraSetup {
    /// Columns, px.
    pub width: Option<u32>,
    /// Rows, px.
    pub height: Option<u32>,
    /// First column and row on the sensor, px.
    pub offset: Option<[u32; 2]>,
    /// Pixel format of pictures; `None` for the camera's present format if it can be used, else gray levels of 8 bits.
    pub pixel: Option<PixelFormat>,
    /// The channel used of a colour picture; a format with colours needs it.
    pub channel: Option<Channel>,
    /// Take profiles instead of pictures: in the camera's present format if it is one of range data, else in the first of
    /// [`PixelFormat::RANGE`] that it offers.
    pub profiles: bool,
    /// Exposure time, µs.
    pub exposure_us: Option<f64>,
    /// Pictures per second, Hz, of a free-running camera.
    pub fps: Option<f64>,
    /// Trigger of an exposure.
    pub trigger: Trigger,
}
