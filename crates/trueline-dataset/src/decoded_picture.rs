//! Pictures decoded from any form: PNG, JPEG, TIFF or BMP, gray or in colour.

use crate::gray_png::Pixels;
use crate::guarded;
use crate::picture_size;
use png::{BitDepth, ColorType, Decoder, Transformations};
use std::io::Cursor;
use tiff::decoder::DecodingResult;
use zune_bmp::BmpDecoder;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// A picture with its channels beside each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DecodedPicture {
    /// Columns, px.
    pub width: usize,
    /// Rows, px.
    pub height: usize,
    /// Channels of a pixel: 1 gray, 2 gray and opacity, 3 red, green, blue, 4 with opacity.
    pub channels: usize,
    /// All of them, pixel by pixel.
    pub levels: Pixels,
}

/// Decodes a picture by its first bytes.
///
/// # Errors
/// Bytes of another form, that are cut off, or too large a picture, in words.
pub fn decode(bytes: &[u8]) -> Result<DecodedPicture, String> {
    guarded::run(|| decode_by_form(bytes)).unwrap_or_else(|| Err("its decoder cannot read it".to_owned()))
}

fn decode_by_form(bytes: &[u8]) -> Result<DecodedPicture, String> {
    if bytes.starts_with(b"\x89PNG") {
        png(bytes)
    } else if bytes.starts_with(&[0xff, 0xd8]) {
        jpeg(bytes)
    } else if bytes.starts_with(b"II*\0") || bytes.starts_with(b"MM\0*") {
        tiff(bytes)
    } else if bytes.starts_with(b"BM") {
        bmp(bytes)
    } else {
        Err("it is neither PNG, JPEG, TIFF nor BMP".to_owned())
    }
}

fn jpeg(bytes: &[u8]) -> Result<DecodedPicture, String> {
    let mut decoder = JpegDecoder::new(ZCursor::new(bytes));
    decoder.decode_headers().map_err(|error| error.to_string())?;
    let (width, height) = decoder.dimensions().ok_or("it has no size")?;
    picture_size::bytes([width, height], 3, bytes.len() as u64)?;
    let is_gray = decoder.input_colorspace() == Some(ColorSpace::Luma);
    let (space, channels) = if is_gray { (ColorSpace::Luma, 1) } else { (ColorSpace::RGB, 3) };
    let options = DecoderOptions::default().jpeg_set_out_colorspace(space);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let levels = decoder.decode().map_err(|error| error.to_string())?;
    checked(DecodedPicture { width, height, channels, levels: Pixels::Eight(levels) })
}

fn png(bytes: &[u8]) -> Result<DecodedPicture, String> {
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|error| error.to_string())?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let (colour, depth) = reader.output_color_type();
    let bytes_a_pixel = colour.samples() * if depth == BitDepth::Sixteen { 2 } else { 1 };
    picture_size::bytes([width, height], bytes_a_pixel, bytes.len() as u64)?;
    let size = reader.output_buffer_size().ok_or("it is too large")?;
    let mut raw = vec![0; size];
    reader.next_frame(&mut raw).map_err(|error| error.to_string())?;
    let channels = match colour {
        ColorType::Grayscale => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
        ColorType::Indexed => return Err("its palette cannot be turned into levels".to_owned()),
    };
    let levels = if depth == BitDepth::Sixteen {
        Pixels::Sixteen(raw.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect())
    } else {
        Pixels::Eight(raw)
    };
    checked(DecodedPicture { width, height, channels, levels })
}

fn tiff(bytes: &[u8]) -> Result<DecodedPicture, String> {
    let broken = |error: tiff::TiffError| error.to_string();
    let mut decoder = tiff::decoder::Decoder::new(Cursor::new(bytes)).map_err(broken)?;
    let (width, height) = decoder.dimensions().map_err(broken)?;
    let (width, height) = (width as usize, height as usize);
    picture_size::bytes([width, height], 2, bytes.len() as u64)?;
    let channels = match decoder.colortype().map_err(broken)? {
        tiff::ColorType::Gray(_) => 1,
        tiff::ColorType::GrayA(_) => 2,
        tiff::ColorType::RGB(_) => 3,
        tiff::ColorType::RGBA(_) => 4,
        other => return Err(format!("its colours are {other:?}; gray or RGB can be read")),
    };
    let levels = match decoder.read_image().map_err(broken)? {
        DecodingResult::U8(levels) => Pixels::Eight(levels),
        DecodingResult::U16(levels) => Pixels::Sixteen(levels),
        _ => return Err("its levels are neither 8 nor 16 bits without a sign".to_owned()),
    };
    checked(DecodedPicture { width, height, channels, levels })
}

fn bmp(bytes: &[u8]) -> Result<DecodedPicture, String> {
    let mut decoder = BmpDecoder::new(ZCursor::new(bytes));
    decoder.decode_headers().map_err(|error| format!("{error:?}"))?;
    let (width, height) = decoder.dimensions().ok_or("it has no size")?;
    picture_size::bytes([width, height], 3, bytes.len() as u64)?;
    let levels = decoder.decode().map_err(|error| format!("{error:?}"))?;
    let channels = levels.len() / (width * height).max(1);
    checked(DecodedPicture { width, height, channels, levels: Pixels::Eight(levels) })
}

/// A picture with as many levels as its size requires.
fn checked(picture: DecodedPicture) -> Result<DecodedPicture, String> {
    let found = match &picture.levels {
        Pixels::Eight(levels) => levels.len(),
        Pixels::Sixteen(levels) => levels.len(),
    };
    let expected = picture.width * picture.height * picture.channels;
    if found == expected && (1..=4).contains(&picture.channels) {
        return Ok(picture);
    }
    Err(format!("it has {found} levels where {} x {} pixels were expected", picture.width, picture.height))
}
