//! Pictures as cameras and phones store them, as gray levels: PNG, JPEG, TIFF and BMP, gray or in colour.

use crate::decoded_picture;
use crate::error::{Error, Problem};
use crate::gray_png::GrayImage;
use crate::laser_channel::Channel;
use crate::source_file;
use std::path::Path;

/// Whether a file's name is that of a picture: .png, .jpg, .jpeg, .tif, .tiff or .bmp.
#[must_use]
pub fn is_picture(file: &Path) -> bool {
    let ending = file.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    matches!(ending.as_deref(), Some("png" | "jpg" | "jpeg" | "tif" | "tiff" | "bmp"))
}

/// The bytes of a file.
///
/// # Errors
/// A file that is missing or cannot be read.
pub fn bytes(file: &Path) -> Result<Vec<u8>, Error> {
    source_file::bytes(file)
}

/// Decodes a picture by its first bytes, under any name; `file` is for messages only.
///
/// # Errors
/// Bytes of no picture that can be read, or are cut off, or a picture that is too large.
pub fn decode(file: &Path, bytes: &[u8]) -> Result<GrayImage, Error> {
    let decoded =
        decoded_picture::decode(bytes).map_err(|why| Error::in_file(file, Problem::Picture { why }))?;
    Ok(Channel::Gray.image(decoded))
}
