//! Pictures: gray PNG of 8 or 16 bits.

use crate::error::{Error, Problem};
use crate::picture_size;
use crate::source_file;
use png::{BitDepth, ColorType, Decoder, DeflateCompression, Encoder, Filter, Transformations};
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Cursor, Seek, SeekFrom};
use std::path::Path;

/// Pixels of a picture, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pixels {
    /// 8 bits.
    Eight(Vec<u8>),
    /// 16 bits.
    Sixteen(Vec<u16>),
}

/// A gray picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GrayImage {
    /// Columns, px.
    pub width: usize,
    /// Rows, px.
    pub height: usize,
    /// The pixels.
    pub pixels: Pixels,
}

impl GrayImage {
    /// Bytes of its pixels.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match &self.pixels {
            Pixels::Eight(levels) => levels.len(),
            Pixels::Sixteen(levels) => 2 * levels.len(),
        }
    }

    /// The levels as numbers, row by row.
    #[must_use]
    pub fn levels_f32(&self) -> Vec<f32> {
        match &self.pixels {
            Pixels::Eight(levels) => levels.iter().map(|x| f32::from(*x)).collect(),
            Pixels::Sixteen(levels) => levels.iter().map(|x| f32::from(*x)).collect(),
        }
    }

    /// The levels in 8 bits, row by row; of 16 bits the brightest is white.
    #[must_use]
    pub fn levels_u8(&self) -> Vec<u8> {
        match &self.pixels {
            Pixels::Eight(levels) => levels.clone(),
            Pixels::Sixteen(levels) => {
                let brightest = u32::from(levels.iter().copied().max().unwrap_or(0).max(255));
                levels.iter().map(|level| (u32::from(*level) * 255 / brightest) as u8).collect()
            }
        }
    }
}

/// Reads a gray PNG of 8 or 16 bits. `spare` is memory that may be used again.
///
/// # Errors
/// A file that is missing, no PNG, cut off, not gray, or of another depth.
pub fn read(file: &Path, spare: &mut Vec<u8>) -> Result<GrayImage, Error> {
    decode(file, BufReader::new(source_file::open(file)?), spare)
}

/// Decodes a gray PNG of 8 or 16 bits from the reader's position; errors name `file`.
///
/// # Errors
/// As [`read()`], but for a file that is missing.
pub fn decode(file: &Path, mut input: impl BufRead + Seek, spare: &mut Vec<u8>) -> Result<GrayImage, Error> {
    let stored = input.stream_position().and_then(|start| {
        let end = input.seek(SeekFrom::End(0))?;
        input.seek(SeekFrom::Start(start))?;
        Ok(end.saturating_sub(start))
    });
    let stored = stored.map_err(|error| Error::in_file(file, Problem::Io(error)))?;
    let broken =
        |error: png::DecodingError| Error::in_file(file, Problem::Picture { why: error.to_string() });
    let mut decoder = Decoder::new(input);
    decoder.set_transformations(Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(broken)?;
    let (color, depth) = reader.output_color_type();
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    if color != ColorType::Grayscale || !matches!(depth, BitDepth::Eight | BitDepth::Sixteen) {
        let found = format!("{} bits, {color:?}", depth as u8);
        return Err(Error::in_file(file, Problem::NotGray { found }));
    }
    let bytes_a_pixel = if depth == BitDepth::Sixteen { 2 } else { 1 };
    let bytes = picture_size::bytes([width, height], bytes_a_pixel, stored)
        .map_err(|why| Error::in_file(file, Problem::Picture { why }))?;
    spare.resize(bytes, 0);
    reader.next_frame(spare).map_err(broken)?;
    let pixels = match depth {
        BitDepth::Sixteen => Pixels::Sixteen(
            spare.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect(),
        ),
        _ => Pixels::Eight(std::mem::take(spare)),
    };
    Ok(GrayImage { width, height, pixels })
}

/// Rows as their differences from the row above: 3 % larger than with the best filter for each row, and decoded in 0.6 of the time.
const LIGHTLY: Packing = (DeflateCompression::FdeflateUltraFast, Filter::Up);
/// Uncompressed: for a container that compresses its content.
const STORED: Packing = (DeflateCompression::NoCompression, Filter::NoFilter);
/// For a person, who looks at it once.
const WELL: Packing = (DeflateCompression::Level(6), Filter::Adaptive);
/// Pixels of more bytes are compressed even where the container does it: readers refuse large blocks of data that shrink to
/// nearly nothing, as dark pictures do.
const MOST_STORED_BYTES: usize = 32 << 20;
/// PNGs of fewer bytes are not worth packing anew.
const WORTH_PACKING: usize = 1 << 16;

/// How the rows of a picture are compressed.
type Packing = (DeflateCompression, Filter);

/// Writes a gray PNG that is fast to write and to read, rather than small.
///
/// # Errors
/// Error of the operating system.
pub fn write(file: &Path, image: &GrayImage) -> Result<(), Error> {
    let out = File::create(file).map_err(|error| Error::in_file(file, Problem::Io(error)))?;
    encode_image(BufWriter::new(out), image, LIGHTLY).map_err(|error| refused(file, error))
}

/// A gray PNG in memory for a container that compresses its content, as a recording does. Its pixels are stored
/// uncompressed, so they are compressed, and decoded, once. Very large pictures are compressed nevertheless.
///
/// # Errors
/// Error of the encoder about a picture with a wrong number of pixels.
pub fn encode_gray(image: &GrayImage) -> Result<Vec<u8>, String> {
    let mut png = Vec::new();
    let packing = if image.bytes() <= MOST_STORED_BYTES { STORED } else { LIGHTLY };
    encode_image(&mut png, image, packing).map_err(|error| error.to_string())?;
    Ok(png)
}

/// Whether a PNG holds uncompressed pixels, and so should be packed before it becomes a file of its own.
#[must_use]
pub fn is_stored(png: &[u8]) -> bool {
    let pixels = || {
        let reader = Decoder::new(Cursor::new(png)).read_info().ok()?;
        let info = reader.info();
        // A row begins with its filter.
        info.raw_row_length().checked_sub(1)?.checked_mul(info.height as usize)
    };
    png.len() >= WORTH_PACKING && pixels().is_some_and(|bytes| png.len() >= bytes)
}

fn encode_image(
    out: impl std::io::Write,
    image: &GrayImage,
    packing: Packing,
) -> Result<(), png::EncodingError> {
    let big_endian: Vec<u8>;
    let (depth, bytes): (_, &[u8]) = match &image.pixels {
        Pixels::Eight(pixels) => (BitDepth::Eight, pixels),
        Pixels::Sixteen(pixels) => {
            big_endian = pixels.iter().flat_map(|value| value.to_be_bytes()).collect();
            (BitDepth::Sixteen, &big_endian)
        }
    };
    let format = (ColorType::Grayscale, depth);
    encode(out, [image.width, image.height], format, (packing, bytes))
}

/// Writes a picture of red, green and blue bytes: an overlay for a person.
///
/// # Errors
/// Error of the operating system.
pub fn write_rgb(file: &Path, size: [usize; 2], rgb: &[u8]) -> Result<(), Error> {
    write_bytes(file, size, (ColorType::Rgb, BitDepth::Eight), rgb)
}

/// A PNG of red, green and blue bytes in memory, small rather than fast.
///
/// # Errors
/// A size that is not that of the bytes.
pub fn encode_rgb(size: [usize; 2], rgb: &[u8]) -> Result<Vec<u8>, Error> {
    let mut png = Vec::new();
    encode(&mut png, size, (ColorType::Rgb, BitDepth::Eight), (WELL, rgb))
        .map_err(|error| refused(Path::new("picture"), error))?;
    Ok(png)
}

fn write_bytes(
    file: &Path,
    size: [usize; 2],
    format: (ColorType, BitDepth),
    bytes: &[u8],
) -> Result<(), Error> {
    let out = File::create(file).map_err(|error| Error::in_file(file, Problem::Io(error)))?;
    encode(BufWriter::new(out), size, format, (LIGHTLY, bytes)).map_err(|error| refused(file, error))
}

fn encode(
    out: impl std::io::Write,
    size: [usize; 2],
    format: (ColorType, BitDepth),
    ((compression, filter), bytes): (Packing, &[u8]),
) -> Result<(), png::EncodingError> {
    let mut encoder = Encoder::new(out, size[0] as u32, size[1] as u32);
    encoder.set_color(format.0);
    encoder.set_depth(format.1);
    encoder.set_deflate_compression(compression);
    encoder.set_filter(filter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()
}

fn refused(file: &Path, error: png::EncodingError) -> Error {
    match error {
        png::EncodingError::IoError(error) => Error::in_file(file, Problem::Io(error)),
        other => Error::in_file(file, Problem::Picture { why: other.to_string() }),
    }
}
