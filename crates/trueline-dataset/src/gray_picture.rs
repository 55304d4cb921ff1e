//! Pictures as cameras and phones store them, as gray levels: PNG and JPEG, gray or in colour.

use crate::error::{Error, Problem};
use crate::gray_png::{GrayImage, Pixels};
use png::{BitDepth, ColorType, Decoder, Transformations};
use std::io::Cursor;
use std::path::Path;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Pictures larger than this are refused before memory is set aside for them.
const MOST_PIXELS: usize = 1 << 28;

/// Weights of red, green and blue in a gray level \[ITU-R BT.601\], as JPEG has them too.
const LUMA: [f64; 3] = [0.299, 0.587, 0.114];

/// Whether a file's name is that of a picture: .png, .jpg or .jpeg.
#[must_use]
pub fn is_picture(file: &Path) -> bool {
    let ending = file.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    matches!(ending.as_deref(), Some("png" | "jpg" | "jpeg"))
}

/// The bytes of a file.
///
/// # Errors
/// A file that is missing or cannot be read.
pub fn bytes(file: &Path) -> Result<Vec<u8>, Error> {
    std::fs::read(file).map_err(|error| {
        let missing = error.kind() == std::io::ErrorKind::NotFound;
        Error::in_file(file, if missing { Problem::Missing } else { Problem::Io(error) })
    })
}

/// Decodes a picture by its first bytes, whatever its name is; `file` is for messages only.
///
/// # Errors
/// Bytes that are neither PNG nor JPEG, or are cut off, or a picture that is too large.
pub fn decode(file: &Path, bytes: &[u8]) -> Result<GrayImage, Error> {
    let decoded = if bytes.starts_with(b"\x89PNG") {
        png(bytes)
    } else if bytes.starts_with(&[0xff, 0xd8]) {
        jpeg(bytes)
    } else {
        Err("it is neither PNG nor JPEG".to_owned())
    };
    decoded.map_err(|why| Error::in_file(file, Problem::Picture { why }))
}

fn jpeg(bytes: &[u8]) -> Result<GrayImage, String> {
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::Luma);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|error| error.to_string())?;
    let (width, height) = decoder.dimensions().ok_or("it has no size")?;
    small_enough(width, height)?;
    let levels = decoder.decode().map_err(|error| error.to_string())?;
    if levels.len() != width * height {
        return Err("its colours cannot be turned into gray".to_owned());
    }
    Ok(GrayImage { width, height, pixels: Pixels::Eight(levels) })
}

fn png(bytes: &[u8]) -> Result<GrayImage, String> {
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|error| error.to_string())?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    small_enough(width, height)?;
    let (colour, depth) = reader.output_color_type();
    let size = reader.output_buffer_size().ok_or("it is too large")?;
    let mut raw = vec![0; size];
    reader.next_frame(&mut raw).map_err(|error| error.to_string())?;
    let channels = match colour {
        ColorType::Grayscale => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
        ColorType::Indexed => return Err("its palette cannot be turned into gray".to_owned()),
    };
    let pixels = if depth == BitDepth::Sixteen {
        let wide: Vec<u16> = raw.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect();
        Pixels::Sixteen(wide.chunks_exact(channels).map(|p| gray(p) as u16).collect())
    } else {
        Pixels::Eight(raw.chunks_exact(channels).map(|p| gray(p) as u8).collect())
    };
    Ok(GrayImage { width, height, pixels })
}

/// The gray level of a pixel with one, two, three or four channels; opacity does not count.
fn gray<L: Copy + Into<f64>>(channels: &[L]) -> f64 {
    match channels {
        [r, g, b] | [r, g, b, _] => {
            (LUMA[0] * (*r).into() + LUMA[1] * (*g).into() + LUMA[2] * (*b).into()).round()
        }
        [level, ..] => (*level).into(),
        [] => 0.0,
    }
}

fn small_enough(width: usize, height: usize) -> Result<(), String> {
    let fits = width.checked_mul(height).is_some_and(|n| n <= MOST_PIXELS);
    if fits { Ok(()) } else { Err(format!("{width} x {height} pixels are more than can be read")) }
}
