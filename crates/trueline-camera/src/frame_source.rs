//! Sources of pictures, of any kind.

use crate::error::CameraError;
use crate::latch_clock::LatchSample;
use crate::range::RangeProfile;
use std::time::Duration;
use trueline_dataset::{FrameSignals, GrayImage};

/// A camera, a recording or a simulation that gives pictures one after the other.
pub trait FrameSource: Send {
    /// Waits for the next picture; `None` if none comes in time.
    ///
    /// # Errors
    /// [`CameraError`]: pictures that came before it are given first.
    fn next(&mut self, timeout: Duration) -> Result<Option<CameraFrame>, CameraError>;

    /// Source of the pictures.
    fn about(&self) -> &SourceAbout;

    /// Its serial number, which it is found and known by when it comes back; `None` where its address is that.
    fn serial(&self) -> Option<&str> {
        None
    }

    /// Asks the camera for the time of its own clock; `None` if it has none.
    ///
    /// # Errors
    /// [`CameraError::Unplugged`].
    fn latch(&mut self) -> Result<Option<LatchSample>, CameraError> {
        Ok(None)
    }

    /// Whether nothing can come any more, as at the end of a recording.
    fn has_ended(&self) -> bool {
        false
    }

    /// How often the camera went away and was waited for.
    fn interruptions(&self) -> u64 {
        0
    }
}

/// Source of the pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceAbout {
    /// Maker, model and serial number, or the folder.
    pub name: String,
    /// Columns, px.
    pub width: usize,
    /// Rows, px.
    pub height: usize,
    /// Ticks of the camera's clock in a second, Hz; `None` if it does not tell.
    pub tick_hz: Option<f64>,
    /// Meaning of `device_ns`, in words.
    pub stamp_meaning: String,
    /// The signal that each picture waits for, in the camera's words; `None` for a free-running camera.
    pub trigger: Option<String>,
}

/// One picture and its stamps.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFrame {
    /// The picture; `None` unless every pixel of it came and it is of the size and format of the session.
    pub image: Option<GrayImage>,
    /// The profiles of a profiler, in the order in which they were taken; a camera has none.
    pub profiles: Vec<RangeProfile>,
    /// Counts pictures without ever wrapping; a jump is a lost picture.
    pub frame: u64,
    /// Stamp of the camera's own clock, ns; ticks if the camera does not state their length.
    pub device_ns: Option<i64>,
    /// When the first packet came, ns on the steady clock of [`trueline_live::HostClock`].
    pub first_packet_ns: Option<i64>,
    /// When the last packet came, ns on the same clock.
    pub complete_ns: i64,
    /// Exposure time as the camera last told, µs.
    pub exposure_us: Option<f64>,
    /// State of the camera's inputs with the picture.
    pub signals: FrameSignals,
    /// Whether the picture can be used.
    pub status: FrameStatus,
}

/// Whether a picture can be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FrameStatus {
    /// Every pixel came.
    Complete,
    /// Packets were lost for good.
    Incomplete {
        /// Packets with pixels that did not come, at least.
        missing: u32,
    },
    /// Not the size of the session.
    WrongSize {
        /// Columns, px.
        width: u32,
        /// Rows, px.
        height: u32,
    },
    /// Not the pixel format of the session.
    WrongFormat {
        /// The format's name.
        found: String,
    },
}
