//! Pictures as other programs write them: gray, of 8 or 16 bits, or refused.

use crate::message::content::Picture;
use crate::message::content_error::ContentError;
use trueline_dataset::{GrayImage, Pixels};

/// Rows of pixels with padding.
pub struct RawPicture<'a> {
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Bytes from row to row.
    pub step: u32,
    /// `mono8`, `mono16`, `8UC1` or `16UC1`.
    pub encoding: &'a str,
    /// Which byte of a pixel of 16 bits comes first.
    pub big_endian: bool,
    /// The rows.
    pub bytes: &'a [u8],
}

impl RawPicture<'_> {
    /// The pixels alone.
    ///
    /// # Errors
    /// Another encoding, or a size that does not fit.
    pub fn gray(&self) -> Result<Picture, ContentError> {
        let depth_bytes = match self.encoding {
            "mono8" | "8UC1" => 1,
            "mono16" | "16UC1" => 2,
            other => return Err(ContentError::NotGray { found: other.to_owned() }),
        };
        let size = |n: u32| n as usize;
        let (width, height, step) = (size(self.width), size(self.height), size(self.step));
        let row_bytes = width * depth_bytes;
        let fits = row_bytes > 0 && height > 0 && row_bytes <= step;
        if !fits || step.checked_mul(height) != Some(self.bytes.len()) {
            return Err(ContentError::PictureSize {
                width: self.width,
                height: self.height,
                step: self.step,
                bytes: self.bytes.len(),
            });
        }
        let rows = self.bytes.chunks_exact(step).map(|row| &row[..row_bytes]);
        let pixels = if depth_bytes == 1 {
            Pixels::Eight(rows.flatten().copied().collect())
        } else {
            let two = if self.big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
            Pixels::Sixteen(rows.flat_map(|row| row.chunks_exact(2)).map(|p| two([p[0], p[1]])).collect())
        };
        Ok(Picture::Gray(GrayImage { width, height, pixels }))
    }
}

/// Bytes that a PNG begins with.
const PNG: &[u8] = &[0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a];
/// Bytes that a JPEG begins with.
const JPEG: &[u8] = &[0xff, 0xd8, 0xff];

/// A PNG that is gray by its head, as it is; `format` is what the message calls it.
///
/// # Errors
/// Anything else: by its bytes, for what a message says of its format is not always so.
pub fn checked_png(bytes: &[u8], format: &str) -> Result<Picture, ContentError> {
    if bytes.starts_with(JPEG) {
        return Err(ContentError::Jpeg);
    }
    // Signature, length and name of the first block, width, height; then depth and kind of colour.
    match (bytes.starts_with(PNG), bytes.get(24..26)) {
        (true, Some([8 | 16, 0])) => Ok(Picture::Png(bytes.to_vec())),
        (true, Some([depth, color])) => {
            Err(ContentError::NotGray { found: format!("png of {depth} bits, colour type {color}") })
        }
        _ => Err(ContentError::NotGray { found: format.to_owned() }),
    }
}
