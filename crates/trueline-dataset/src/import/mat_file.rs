//! Files of MATLAB, version 5 to 7: their arrays of real numbers.
//!
//! After "MAT-File Format" of MathWorks: a header of 128 bytes, then elements of a tag (type, length) and data. An element
//! may hold others, or be compressed. Only dense arrays of real numbers are read. Text, cells, structures, sparse arrays and
//! objects are skipped.

use flate2::read::ZlibDecoder;
use std::io::Read;

/// An array of two dimensions or more; all but the first are columns.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MatArray {
    /// Its name.
    pub name: String,
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
    /// Its numbers, column by column.
    pub numbers: Vec<f64>,
}

/// Fault of a file.
pub(super) type Fault = &'static str;

const HEADER: usize = 128;
/// Place of the byte-order mark in the header.
const ORDER: usize = 126;
/// Limit of decompressed data, bytes, …
const FREE: u64 = 64 << 20;
/// … or this many times the file.
const GROWTH: u64 = 20;

const SIGNED_BYTES: u32 = 1;
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Classes of arrays of numbers: double, single, and whole numbers of 8 to 64 bits.
const NUMBERS: std::ops::RangeInclusive<u32> = 6..=15;
const COMPLEX: u32 = 0x0800;

/// The arrays of a file.
///
/// # Errors
/// Malformed files, and files that would grow too much.
pub(super) fn arrays(bytes: &[u8]) -> Result<Vec<MatArray>, Fault> {
    let little = match bytes.get(ORDER..HEADER).ok_or("it is cut off in its header")? {
        b"IM" => true,
        b"MI" => false,
        _ => return Err("its header does not state the byte order"),
    };
    let mut budget = FREE.max(GROWTH * bytes.len() as u64);
    let mut elements = Elements { bytes: &bytes[HEADER..], little };
    let mut arrays = Vec::new();
    while let Some((kind, data)) = elements.next()? {
        match kind {
            MATRIX => arrays.extend(array(data, little)?),
            COMPRESSED => {
                let mut grown = Vec::new();
                let read = ZlibDecoder::new(data).take(budget).read_to_end(&mut grown);
                budget -= read.map_err(|_| "a compressed array is damaged")? as u64;
                if budget == 0 {
                    return Err("its arrays grow too much when they are decompressed");
                }
                let mut inner = Elements { bytes: &grown, little };
                if let Some((MATRIX, data)) = inner.next()? {
                    arrays.extend(array(data, little)?);
                }
            }
            _ => {}
        }
    }
    Ok(arrays)
}

/// Elements that follow one another.
struct Elements<'a> {
    bytes: &'a [u8],
    little: bool,
}

impl<'a> Elements<'a> {
    /// Type and data of the next; `None` at the end.
    fn next(&mut self) -> Result<Option<(u32, &'a [u8])>, Fault> {
        const CUT_OFF: Fault = "it is cut off";
        let Some((first, rest)) = self.bytes.split_at_checked(4) else {
            return if self.bytes.is_empty() { Ok(None) } else { Err(CUT_OFF) };
        };
        let first = word(first, self.little);
        let (second, rest) = rest.split_at_checked(4).ok_or(CUT_OFF)?;
        // Up to four bytes of data are in the tag itself.
        let short = (first >> 16) as usize;
        if short > 0 {
            self.bytes = rest;
            return Ok(Some((first & 0xffff, second.get(..short).ok_or("a short element is too long")?)));
        }
        let length = word(second, self.little) as usize;
        let data = rest.get(..length).ok_or(CUT_OFF)?;
        // Data is filled up to eight bytes, but for compressed data, and at the end of the file.
        let step = if first == COMPRESSED { length } else { length.next_multiple_of(8) };
        self.bytes = rest.get(step..).unwrap_or_default();
        Ok(Some((first, data)))
    }

    fn expect(&mut self) -> Result<(u32, &'a [u8]), Fault> {
        self.next()?.ok_or("an array is cut off")
    }
}

/// The array of a matrix element; `None` if it holds no real numbers.
fn array(bytes: &[u8], little: bool) -> Result<Option<MatArray>, Fault> {
    let mut parts = Elements { bytes, little };
    // An empty matrix element has no meaning.
    let Some((_, flags)) = parts.next()? else { return Ok(None) };
    let flags = word(flags.get(..4).ok_or("an array without its class")?, little);
    if !NUMBERS.contains(&(flags & 0xff)) || flags & COMPLEX != 0 {
        return Ok(None);
    }
    let (_, size) = parts.expect()?;
    let size: Vec<usize> = size.chunks_exact(4).map(|bytes| word(bytes, little) as usize).collect();
    let [rows, others @ ..] = &size[..] else { return Err("an array without its size") };
    let columns = others.iter().try_fold(1_usize, |product, n| product.checked_mul(*n));
    let (SIGNED_BYTES, name) = parts.expect()? else { return Err("an array without a name") };
    let name = String::from_utf8(name.to_vec()).map_err(|_| "a name that is not text")?;
    let (kind, data) = parts.expect()?;
    let numbers = numbers(kind, data, little).ok_or("an array of an unknown type")?;
    match columns.filter(|columns| rows.checked_mul(*columns) == Some(numbers.len())) {
        Some(columns) => Ok(Some(MatArray { name, rows: *rows, columns, numbers })),
        None => Err("an array with a number of values that contradicts its size"),
    }
}

/// Numbers as stored: whole ones may take fewer bytes than their class has.
fn numbers(kind: u32, data: &[u8], little: bool) -> Option<Vec<f64>> {
    fn each<const N: usize>(data: &[u8], little: bool, number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        let (chunks, _) = data.as_chunks::<N>();
        let ordered = |mut bytes: [u8; N]| {
            if !little {
                bytes.reverse();
            }
            number(bytes)
        };
        chunks.iter().copied().map(ordered).collect()
    }
    Some(match kind {
        1 => each(data, little, |bytes| f64::from(i8::from_le_bytes(bytes))),
        2 => each(data, little, |bytes| f64::from(u8::from_le_bytes(bytes))),
        3 => each(data, little, |bytes| f64::from(i16::from_le_bytes(bytes))),
        4 => each(data, little, |bytes| f64::from(u16::from_le_bytes(bytes))),
        5 => each(data, little, |bytes| f64::from(i32::from_le_bytes(bytes))),
        6 => each(data, little, |bytes| f64::from(u32::from_le_bytes(bytes))),
        7 => each(data, little, |bytes| f64::from(f32::from_le_bytes(bytes))),
        9 => each(data, little, f64::from_le_bytes),
        12 => each(data, little, |bytes| i64::from_le_bytes(bytes) as f64),
        13 => each(data, little, |bytes| u64::from_le_bytes(bytes) as f64),
        _ => return None,
    })
}

/// Four bytes as a number, less than four as 0.
fn word(bytes: &[u8], little: bool) -> u32 {
    let bytes = bytes.first_chunk().copied().unwrap_or_default();
    if little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One array of 8-bit numbers in a file with big-endian words, as written by hand after the format's description.
    fn big_endian(size: [u32; 2], data: &[u8]) -> Vec<u8> {
        let words = |words: &[u32]| words.iter().flat_map(|word| word.to_be_bytes()).collect::<Vec<u8>>();
        let mut inner = words(&[6, 8, 6, 0, 5, 8, size[0], size[1], 1 << 16 | 1]);
        inner.extend(b"x\0\0\0");
        inner.extend(words(&[1, data.len() as u32]));
        inner.extend(data);
        inner.resize(inner.len().next_multiple_of(8), 0);
        let mut file = b"MATLAB 5.0 MAT-file".to_vec();
        file.resize(ORDER - 2, b' ');
        file.extend([1, 0, b'M', b'I']);
        file.extend(words(&[MATRIX, inner.len() as u32]));
        file.extend(inner);
        file
    }

    #[test]
    fn either_order_of_bytes_and_narrow_numbers_are_read() {
        let read = arrays(&big_endian([2, 2], &[1, 2, 0xff, 4])).unwrap();
        let expected = MatArray { name: "x".into(), rows: 2, columns: 2, numbers: vec![1.0, 2.0, -1.0, 4.0] };
        assert_eq!(read, [expected]);
    }

    #[test]
    fn a_size_that_lies_is_refused() {
        for size in [[3, 2], [0, 2], [u32::MAX, u32::MAX]] {
            let said = arrays(&big_endian(size, &[1, 2, 3, 4])).unwrap_err();
            assert_eq!(said, "an array with a number of values that contradicts its size");
        }
        let whole = big_endian([2, 2], &[1, 2, 3, 4]);
        for cut in HEADER + 1..whole.len() {
            assert!(arrays(&whole[..cut]).is_err(), "cut off at {cut}");
        }
    }
}
