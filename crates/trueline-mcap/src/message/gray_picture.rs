//! Pictures as other programs write them, as gray levels of 8 or 16 bits.

use crate::message::content::{Picture, PictureOrigin};
use crate::message::content_error::ContentError;
use trueline_dataset::{GrayImage, Pixels};

/// Rows of pixels with padding.
pub(super) struct RawPicture<'a> {
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Bytes from row to row.
    pub step: u32,
    /// `mono8`, `mono16`, `rgb8`, `bayer_rggb8`, … as ROS names them.
    pub encoding: &'a str,
    /// Which byte of a pixel of 16 bits comes first.
    pub big_endian: bool,
    /// The rows.
    pub bytes: &'a [u8],
}

/// How the bytes of a pixel become a gray level.
#[derive(Clone, Copy)]
enum Layout {
    Eight,
    Sixteen,
    /// Bytes of a pixel, and which of them are red, green and blue.
    Colours(usize, [usize; 3]),
    Mosaic,
}

/// Weights of red, green and blue in a gray level, thousandths \[ITU-R BT.601\].
const LUMA: [u32; 3] = [299, 587, 114];

impl RawPicture<'_> {
    /// The gray levels, and what they were made of.
    ///
    /// # Errors
    /// Another encoding, or a size that does not fit.
    pub(super) fn gray(&self) -> Result<(Picture, PictureOrigin), ContentError> {
        let (layout, origin) = match self.encoding {
            "mono8" | "8UC1" => (Layout::Eight, PictureOrigin::Gray),
            "mono16" | "16UC1" => (Layout::Sixteen, PictureOrigin::Gray),
            "rgb8" => (Layout::Colours(3, [0, 1, 2]), PictureOrigin::Colour),
            "bgr8" | "8UC3" => (Layout::Colours(3, [2, 1, 0]), PictureOrigin::Colour),
            "rgba8" => (Layout::Colours(4, [0, 1, 2]), PictureOrigin::Colour),
            "bgra8" | "8UC4" => (Layout::Colours(4, [2, 1, 0]), PictureOrigin::Colour),
            "bayer_rggb8" | "bayer_bggr8" | "bayer_gbrg8" | "bayer_grbg8" => {
                (Layout::Mosaic, PictureOrigin::Mosaic)
            }
            other => return Err(ContentError::NotGray { found: other.to_owned() }),
        };
        let size = |n: u32| n as usize;
        let (width, height, step) = (size(self.width), size(self.height), size(self.step));
        let row_bytes = width
            * match layout {
                Layout::Eight | Layout::Mosaic => 1,
                Layout::Sixteen => 2,
                Layout::Colours(bytes, _) => bytes,
            };
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
        let pixels = match layout {
            Layout::Eight => Pixels::Eight(rows.flatten().copied().collect()),
            Layout::Mosaic => Pixels::Eight(blended(&rows.flatten().copied().collect::<Vec<u8>>(), width)),
            Layout::Colours(bytes, order) => Pixels::Eight(
                rows.flat_map(|row| row.chunks_exact(bytes))
                    .map(|pixel| luma(order.map(|k| pixel[k])))
                    .collect(),
            ),
            Layout::Sixteen => {
                let two = if self.big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
                Pixels::Sixteen(rows.flat_map(|row| row.chunks_exact(2)).map(|p| two([p[0], p[1]])).collect())
            }
        };
        Ok((Picture::Gray(GrayImage { width, height, pixels }), origin))
    }
}

fn luma(colours: [u8; 3]) -> u8 {
    let sum: u32 = colours.iter().zip(LUMA).map(|(level, weight)| u32::from(*level) * weight).sum();
    // The weights add up to a thousand.
    ((sum + 500) / 1000) as u8
}

/// A mosaic of colours as gray: the mean over each pixel and its neighbours with the weights 1 2 1, along rows and columns. It
/// weighs red, green and blue as 1 : 2 : 1 about every pixel whatever its own colour is, and moves nothing.
fn blended(mosaic: &[u8], width: usize) -> Vec<u8> {
    let height = mosaic.len() / width;
    let mirrored = |k: usize, by: isize, count: usize| match k.checked_add_signed(by) {
        Some(k) if k < count => k,
        // Behind the border the mosaic goes on with the colour of the other side.
        _ => k.saturating_add_signed(-by).min(count - 1),
    };
    let mut gray = Vec::with_capacity(mosaic.len());
    for v in 0..height {
        for u in 0..width {
            let mut sum = 0_u32;
            for (dv, row_weight) in [(-1, 1), (0, 2), (1, 1)] {
                let row = mirrored(v, dv, height) * width;
                for (du, weight) in [(-1, 1), (0, 2), (1, 1)] {
                    sum += row_weight * weight * u32::from(mosaic[row + mirrored(u, du, width)]);
                }
            }
            gray.push(((sum + 8) / 16) as u8);
        }
    }
    gray
}

/// Bytes that a PNG begins with.
const PNG: &[u8] = &[0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a];
/// Bytes that a JPEG begins with.
const JPEG: &[u8] = &[0xff, 0xd8, 0xff];

/// A compressed picture: a PNG that is gray by its head as it is, and what else can be decoded; `format` is what the message calls it.
///
/// # Errors
/// Anything else: by its bytes, for what a message says of its format is not always so.
pub(super) fn compressed(bytes: &[u8], format: &str) -> Result<(Picture, PictureOrigin), ContentError> {
    if bytes.starts_with(JPEG) {
        return Ok((Picture::Compressed(bytes.to_vec()), PictureOrigin::Jpeg));
    }
    // Signature, length and name of the first block, width, height; then depth and kind of colour.
    match (bytes.starts_with(PNG), bytes.get(24..26)) {
        (true, Some([8 | 16, 0])) => Ok((Picture::Png(bytes.to_vec()), PictureOrigin::Gray)),
        (true, Some([8 | 16, 2 | 6])) => Ok((Picture::Compressed(bytes.to_vec()), PictureOrigin::Colour)),
        (true, Some([depth, color])) => {
            Err(ContentError::NotGray { found: format!("png of {depth} bits, colour type {color}") })
        }
        _ => Err(ContentError::NotGray { found: format.to_owned() }),
    }
}
