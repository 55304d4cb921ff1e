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

/// How the samples of a pixel become a gray level.
#[derive(Clone, Copy)]
enum Layout {
    Gray,
    /// Samples of a pixel, and which of them are red, green and blue.
    Colours(usize, [usize; 3]),
    Mosaic,
}

impl Layout {
    /// Layout and bytes of a sample by the name of the encoding in ROS.
    fn of(encoding: &str) -> Option<(Self, usize)> {
        let known = match encoding {
            "mono8" | "8UC1" => (Self::Gray, 1),
            "mono16" | "16UC1" => (Self::Gray, 2),
            "rgb8" => (Self::Colours(3, [0, 1, 2]), 1),
            "rgb16" => (Self::Colours(3, [0, 1, 2]), 2),
            "bgr8" | "8UC3" => (Self::Colours(3, [2, 1, 0]), 1),
            "bgr16" | "16UC3" => (Self::Colours(3, [2, 1, 0]), 2),
            "rgba8" => (Self::Colours(4, [0, 1, 2]), 1),
            "rgba16" => (Self::Colours(4, [0, 1, 2]), 2),
            "bgra8" | "8UC4" => (Self::Colours(4, [2, 1, 0]), 1),
            "bgra16" | "16UC4" => (Self::Colours(4, [2, 1, 0]), 2),
            "bayer_rggb8" | "bayer_bggr8" | "bayer_gbrg8" | "bayer_grbg8" => (Self::Mosaic, 1),
            "bayer_rggb16" | "bayer_bggr16" | "bayer_gbrg16" | "bayer_grbg16" => (Self::Mosaic, 2),
            _ => return None,
        };
        Some(known)
    }

    fn samples(self) -> usize {
        if let Self::Colours(samples, _) = self { samples } else { 1 }
    }

    fn origin(self) -> PictureOrigin {
        match self {
            Self::Gray => PictureOrigin::Gray,
            Self::Colours(..) => PictureOrigin::Colour,
            Self::Mosaic => PictureOrigin::Mosaic,
        }
    }

    /// The gray levels of rows of samples without gaps.
    fn gray<L: Copy + Into<u32> + TryFrom<u32> + Default>(self, samples: Vec<L>, width: usize) -> Vec<L> {
        match self {
            Self::Gray => samples,
            Self::Mosaic => blended(&samples, width),
            Self::Colours(count, order) => {
                samples.chunks_exact(count).map(|pixel| luma(order.map(|k| pixel[k]))).collect()
            }
        }
    }
}

/// Weights of red, green and blue in a gray level, thousandths \[ITU-R BT.601\].
const LUMA: [u32; 3] = [299, 587, 114];

impl RawPicture<'_> {
    /// The gray levels, and their source.
    ///
    /// # Errors
    /// Another encoding, or a size that does not fit.
    pub(super) fn gray(&self) -> Result<(Picture, PictureOrigin), ContentError> {
        let (layout, sample_bytes) = Layout::of(self.encoding)
            .ok_or_else(|| ContentError::NotGray { found: self.encoding.to_owned() })?;
        let size = |n: u32| n as usize;
        let (width, height, step) = (size(self.width), size(self.height), size(self.step));
        let row_bytes = width * layout.samples() * sample_bytes;
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
        let pixels = if sample_bytes == 1 {
            Pixels::Eight(layout.gray(rows.flatten().copied().collect(), width))
        } else {
            let two = if self.big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
            let samples = rows.flat_map(|row| row.chunks_exact(2)).map(|p| two([p[0], p[1]])).collect();
            Pixels::Sixteen(layout.gray(samples, width))
        };
        Ok((Picture::Gray(GrayImage { width, height, pixels }), layout.origin()))
    }
}

fn luma<L: Into<u32> + TryFrom<u32> + Default>(colours: [L; 3]) -> L {
    let sum: u32 = colours.into_iter().zip(LUMA).map(|(level, weight)| level.into() * weight).sum();
    // The weights add up to a thousand, so that a mean of levels is a level.
    L::try_from((sum + 500) / 1000).unwrap_or_default()
}

/// A mosaic of colours as gray: the mean over each pixel and its neighbours with the weights 1 2 1, along rows and columns.
/// It weighs red, green and blue as 1 : 2 : 1 about every pixel of any colour, and shifts nothing.
fn blended<L: Copy + Into<u32> + TryFrom<u32> + Default>(mosaic: &[L], width: usize) -> Vec<L> {
    let height = mosaic.len() / width;
    let mirrored = |k: usize, by: isize, count: usize| match k.checked_add_signed(by) {
        Some(k) if k < count => k,
        // Beyond the border the mosaic continues with the colour of the other side.
        _ => k.saturating_add_signed(-by).min(count - 1),
    };
    let mut gray = Vec::with_capacity(mosaic.len());
    for v in 0..height {
        for u in 0..width {
            let mut sum = 0_u32;
            for (dv, row_weight) in [(-1, 1), (0, 2), (1, 1)] {
                let row = mirrored(v, dv, height) * width;
                for (du, weight) in [(-1, 1), (0, 2), (1, 1)] {
                    sum += row_weight * weight * mosaic[row + mirrored(u, du, width)].into();
                }
            }
            gray.push(L::try_from((sum + 8) / 16).unwrap_or_default());
        }
    }
    gray
}

/// Bytes that a PNG begins with.
const PNG: &[u8] = &[0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a];
/// Bytes that a JPEG begins with.
const JPEG: &[u8] = &[0xff, 0xd8, 0xff];

/// A compressed picture. A PNG with a gray header is kept as it is; other formats are decoded. `format` is the message's
/// name for it.
///
/// # Errors
/// Other formats are recognised by their bytes, because a message's statement of the format may be wrong.
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
