//! Properties that all pictures of a session share.

use super::{automatic, configure, features, scan3d};
use crate::error::CameraError;
use crate::frame_source::FrameStatus;
use crate::genicam::Features;
use crate::gray_image::gray_image;
use crate::pixel_format::PixelFormat;
use crate::range::{RangeProfile, RangeScale};
use crate::setup::CameraSetup;
use trueline_dataset::{Channel, GrayImage, Pixels};

/// Size and format that every picture of a session has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Session {
    /// Columns and rows, px.
    pub size: [u32; 2],
    /// Format.
    pub format: PixelFormat,
    /// The channel used of a colour picture.
    pub channel: Channel,
    /// Meaning of a profiler's numbers; `None` for a camera.
    pub range: Option<RangeScale>,
}

/// Content of a frame: a picture of a camera, or the profiles of a profiler.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    /// The picture.
    pub image: Option<GrayImage>,
    /// The profiles.
    pub profiles: Vec<RangeProfile>,
}

/// Sets a camera up and turns its automatic settings off; returns the form of its pictures, and the trigger of each, in the
/// camera's words.
///
/// # Errors
/// A feature that is missing, or cannot be set as requested.
pub(crate) fn begin(
    camera: &mut dyn Features,
    setup: &CameraSetup,
) -> Result<(Session, Option<String>), CameraError> {
    let (format, waits) = configure::configure(camera, setup)?;
    automatic::turn_off(camera)?;
    let size = [features::size(camera, "Width")?, features::size(camera, "Height")?];
    let range = setup.profiles.then(|| scan3d::scale(camera, format, size[1], &waits)).transpose()?;
    Ok((Session { size, format, channel: setup.channel.unwrap_or_default(), range }, waits.told()))
}

impl Session {
    /// Bytes of the pixels of a picture; `None` for more than can be counted.
    pub(crate) fn bytes(&self) -> Option<usize> {
        let [width, height] = self.size.map(|px| px as usize);
        self.format.bytes_of(width.checked_mul(height)?)
    }

    /// Fault of a picture with this head.
    pub(crate) fn wrong(&self, size: [u32; 2], format_code: u32) -> Option<FrameStatus> {
        if format_code != self.format.code() {
            let known = PixelFormat::of_code(format_code);
            let found = known.map_or_else(|| format!("{format_code:#010x}"), |format| format.to_string());
            return Some(FrameStatus::WrongFormat { found });
        }
        let [width, height] = size;
        (size != self.size).then_some(FrameStatus::WrongSize { width, height })
    }

    /// Content of a picture's bytes, with `padding` bytes after each line; `None` if there are too few.
    pub(crate) fn seen(&self, data: &[u8], padding: usize) -> Option<Seen> {
        let image = gray_image(data, self.size, self.format, padding, self.channel)?;
        Some(match (self.range, &image.pixels) {
            (Some(scale), Pixels::Sixteen(counts)) => {
                Seen { image: None, profiles: scale.profiles(counts, self.size[0] as usize) }
            }
            _ => Seen { image: Some(image), profiles: Vec::new() },
        })
    }

    /// A picture of another size or format is not an accident: the session ends.
    pub(crate) fn verdict(&self, status: &FrameStatus) -> Option<CameraError> {
        match status {
            FrameStatus::WrongSize { width, height } => {
                Some(CameraError::FrameSizeChanged { was: self.size, is: [*width, *height] })
            }
            FrameStatus::WrongFormat { found } => {
                Some(CameraError::Format { wanted: self.format.to_string(), offered: found.clone() })
            }
            FrameStatus::Complete | FrameStatus::Incomplete { .. } => None,
        }
    }
}
