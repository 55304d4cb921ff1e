//! Chunk data: data that a camera sends behind its pixels.
//!
//! ```text
//! data of the first chunk | id | length | data of the second chunk | id | length | …
//! ```
//!
//! Identifier and length have 32 bits each, big-endian for GigE Vision and little-endian for USB3 Vision. They follow
//! their data, so a frame is read from its end. The camera's description states the meaning of an identifier and the
//! bytes of a number: a port with a `ChunkID`, registers of that port, and features of those registers.

use roxmltree::{Document, Node};
use std::collections::BTreeMap;

/// Identifier and length, bytes.
const TAIL: usize = 8;
/// More chunks than this are not a frame of a camera.
const MOST: usize = 256;

/// Which byte of an identifier and of a length comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChunkOrder {
    /// The highest: GigE Vision.
    BigEndian,
    /// The lowest: USB3 Vision.
    LittleEndian,
}

/// A chunk of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunk<'a> {
    /// Its identifier, by the camera's description.
    pub id: u32,
    /// Its data.
    pub data: &'a [u8],
}

/// Lengths that do not fit a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ChunkError {
    /// A chunk is longer than the remaining data.
    #[error("chunk {id:#x} states {length} bytes, but {left} remain")]
    Length {
        /// Its identifier.
        id: u32,
        /// Its stated length.
        length: u32,
        /// Bytes before it.
        left: usize,
    },
    /// Bytes before the first chunk that are not a chunk.
    #[error("{0} bytes before the first chunk belong to none")]
    Rest(usize),
    /// A frame of nothing but chunks.
    #[error("more than {MOST} chunks")]
    TooMany,
}

/// The chunks of a frame, the last one first.
///
/// # Errors
/// [`ChunkError`]: lengths that do not add up to the frame.
pub fn chunks(frame: &[u8], order: ChunkOrder) -> Result<Vec<Chunk<'_>>, ChunkError> {
    let mut chunks = Vec::new();
    let mut rest = frame;
    while !rest.is_empty() {
        if chunks.len() == MOST {
            return Err(ChunkError::TooMany);
        }
        let Some((before, tail)) = rest.split_at_checked(rest.len().wrapping_sub(TAIL)) else {
            return Err(ChunkError::Rest(rest.len()));
        };
        let join = |word: u32, byte: &u8| word << 8 | u32::from(*byte);
        let word = |at: usize| match order {
            ChunkOrder::BigEndian => tail[at..at + 4].iter().fold(0, join),
            ChunkOrder::LittleEndian => tail[at..at + 4].iter().rev().fold(0, join),
        };
        let (id, length) = (word(0), word(4));
        let begin = usize::try_from(length).ok().and_then(|length| before.len().checked_sub(length));
        let Some(begin) = begin else {
            return Err(ChunkError::Length { id, length, left: before.len() });
        };
        let (before, data) = before.split_at(begin);
        chunks.push(Chunk { id, data });
        rest = before;
    }
    Ok(chunks)
}

/// A number in a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    id: u32,
    offset: usize,
    length: usize,
    is_float: bool,
    is_big_endian: bool,
    is_signed: bool,
}

/// Which chunks of a camera are numbers, by the name of their feature (`ChunkTimestamp`, …).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ChunkNames(BTreeMap<String, Place>);

impl ChunkNames {
    /// From a camera's description; parts that cannot be understood are left out.
    #[must_use]
    pub fn of(description: &str) -> Self {
        let Ok(document) = Document::parse(description) else { return Self::default() };
        let nodes: BTreeMap<&str, Node<'_, '_>> =
            document.descendants().filter_map(|node| Some((node.attribute("Name")?, node))).collect();
        let named = nodes.iter().filter(|(name, _)| name.starts_with("Chunk"));
        Self(named.filter_map(|(name, node)| Some(((*name).to_owned(), place(node, &nodes)?))).collect())
    }

    /// The number of a feature in a frame's chunks; `None` if it is missing, or shorter than the description states.
    #[must_use]
    pub fn number(&self, name: &str, chunks: &[Chunk<'_>]) -> Option<f64> {
        let (place, bytes) = self.bytes(name, chunks)?;
        if !place.is_float {
            return Some(whole(place, bytes) as f64);
        }
        let bits = whole(place, bytes);
        let value =
            if place.length == 4 { f64::from(f32::from_bits(bits as u32)) } else { f64::from_bits(bits) };
        value.is_finite().then_some(value)
    }

    /// The same of a whole number, with all its digits.
    #[must_use]
    pub fn whole(&self, name: &str, chunks: &[Chunk<'_>]) -> Option<u64> {
        let (place, bytes) = self.bytes(name, chunks)?;
        (!place.is_float).then(|| whole(place, bytes))
    }

    /// The same for a number that may be negative, by the sign in the description; `None` if it has too many digits.
    #[must_use]
    pub fn signed(&self, name: &str, chunks: &[Chunk<'_>]) -> Option<i64> {
        let (place, bytes) = self.bytes(name, chunks)?;
        let value = (!place.is_float).then(|| whole(place, bytes))?;
        if !place.is_signed {
            return i64::try_from(value).ok();
        }
        // Its highest bit is extended upwards.
        let unused = u64::BITS - 8 * place.length as u32;
        Some((value << unused).cast_signed() >> unused)
    }

    fn bytes<'a>(&self, name: &str, chunks: &[Chunk<'a>]) -> Option<(Place, &'a [u8])> {
        let place = *self.0.get(name)?;
        let chunk = chunks.iter().find(|chunk| chunk.id == place.id)?;
        Some((place, chunk.data.get(place.offset..place.offset.checked_add(place.length)?)?))
    }
}

fn whole(place: Place, bytes: &[u8]) -> u64 {
    let join = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
    if place.is_big_endian { bytes.iter().fold(0, join) } else { bytes.iter().rev().fold(0, join) }
}

/// The place of a feature's number: a register of a port with a `ChunkID`, or one that it names.
fn place(node: &Node<'_, '_>, nodes: &BTreeMap<&str, Node<'_, '_>>) -> Option<Place> {
    let text = |node: &Node<'_, '_>, tag: &str| {
        // By its local name: descriptions differ in their namespace.
        let child = node.children().find(|child| child.tag_name().name() == tag)?;
        child.text().map(|text| text.trim().to_owned())
    };
    let register = match text(node, "pValue") {
        Some(name) => *nodes.get(name.as_str())?,
        None => *node,
    };
    let kind = register.tag_name().name();
    if !matches!(kind, "IntReg" | "FloatReg") {
        return None;
    }
    let port = nodes.get(text(&register, "pPort")?.as_str())?;
    // In hexadecimal digits without a prefix.
    let id = u32::from_str_radix(text(port, "ChunkID")?.trim_start_matches("0x"), 16).ok()?;
    let number = |text: String| match text.strip_prefix("0x") {
        Some(digits) => usize::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    };
    let (offset, length) =
        (text(&register, "Address").and_then(number)?, text(&register, "Length").and_then(number)?);
    let is_float = kind == "FloatReg";
    if !(if is_float { matches!(length, 4 | 8) } else { (1..=8).contains(&length) }) {
        return None;
    }
    let is_big_endian = text(&register, "Endianess").is_none_or(|order| order == "BigEndian");
    let is_signed = text(&register, "Sign").is_some_and(|sign| sign == "Signed");
    Some(Place { id, offset, length, is_float, is_big_endian, is_signed })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn chunks(frame: &[u8]) -> Result<Vec<Chunk<'_>>, ChunkError> {
        super::chunks(frame, ChunkOrder::BigEndian)
    }

    fn tail(id: u32, length: u32) -> Vec<u8> {
        [id.to_be_bytes(), length.to_be_bytes()].concat()
    }

    #[test]
    fn chunks_are_read_from_the_end_and_lengths_that_lie_are_refused() {
        let frame = [vec![7; 6], tail(1, 6), vec![1, 2], tail(0xabcd_0002, 2), tail(3, 0)].concat();
        let found = chunks(&frame).unwrap();
        let expected: [(u32, &[u8]); 3] = [(3, &[]), (0xabcd_0002, &[1, 2]), (1, &[7; 6])];
        assert_eq!(found.iter().map(|chunk| (chunk.id, chunk.data)).collect::<Vec<_>>(), expected);
        assert_eq!(chunks(&[]), Ok(Vec::new()));
        let length = |length, left| Err(ChunkError::Length { id: 5, length, left });
        for lie in [5, 0x7fff_ffff, u32::MAX] {
            assert_eq!(chunks(&[vec![0; 4], tail(5, lie)].concat()), length(lie, 4));
        }
        // Too short a length leaves bytes that are read as a chunk, or are too few for one.
        assert_eq!(chunks(&[vec![0; 4], tail(5, 1)].concat()), Err(ChunkError::Rest(3)));
        assert_eq!(chunks(&vec![0; TAIL * (MOST + 1)]), Err(ChunkError::TooMany));
        // A cut frame counts as a frame only if it ends with a chunk.
        let ends: Vec<usize> = (0..=frame.len()).filter(|end| chunks(&frame[..*end]).is_ok()).collect();
        assert_eq!(ends, [0, 14, 24, 32]);
    }

    #[test]
    fn usb_has_the_lowest_byte_first() {
        let tail = |id: u32, length: u32| [id.to_le_bytes(), length.to_le_bytes()].concat();
        let frame = [vec![7; 6], tail(1, 6), vec![1, 2], tail(0xabcd_0002, 2)].concat();
        let found = super::chunks(&frame, ChunkOrder::LittleEndian).unwrap();
        let expected: [(u32, &[u8]); 2] = [(0xabcd_0002, &[1, 2]), (1, &[7; 6])];
        assert_eq!(found.iter().map(|chunk| (chunk.id, chunk.data)).collect::<Vec<_>>(), expected);
        assert!(chunks(&frame).is_err(), "read the other way round the length lies");
    }

    #[test]
    fn whatever_comes_is_refused_or_adds_up() {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut next = |most: u64| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state % most
        };
        let mut good = 0;
        for _ in 0..20_000 {
            // Small words are lengths that may fit.
            let words =
                (0..next(12)).map(|_| if next(4) == 0 { next(u64::MAX) as u32 } else { next(24) as u32 });
            let mut frame: Vec<u8> = words.flat_map(u32::to_be_bytes).collect();
            frame.truncate(frame.len().saturating_sub(next(3) as usize));
            if let Ok(found) = chunks(&frame) {
                let sum: usize = found.iter().map(|chunk| chunk.data.len() + TAIL).sum();
                assert_eq!(sum, frame.len());
                good += usize::from(!found.is_empty());
            }
        }
        assert!(good > 100, "{good}: nothing was tested");
    }

    #[test]
    fn numbers_are_where_the_description_says() {
        let description = r#"<R xmlns="urn:x">
            <Port Name="P"><ChunkID>a0</ChunkID></Port><Port Name="Device"/>
            <Integer Name="ChunkTimestamp"><pValue>T</pValue></Integer>
            <IntReg Name="T"><Address>0x2</Address><Length>8</Length><pPort>P</pPort><Endianess>LittleEndian</Endianess></IntReg>
            <FloatReg Name="ChunkExposureTime"><Address>10</Address><Length>4</Length><pPort>P</pPort></FloatReg>
            <IntReg Name="ChunkLong"><Address>12</Address><Length>4</Length><pPort>P</pPort></IntReg>
            <IntReg Name="ChunkEncoderValue"><Address>2</Address><Length>3</Length><pPort>P</pPort><Sign>Signed</Sign></IntReg>
            <IntReg Name="ChunkUnsigned"><Address>2</Address><Length>3</Length><pPort>P</pPort><Sign>Unsigned</Sign></IntReg>
            <IntReg Name="ChunkOfTheDevice"><Address>0</Address><Length>4</Length><pPort>Device</pPort></IntReg>
        </R>"#;
        let names = ChunkNames::of(description);
        let stamp = 0x0102_0304_0506_0708_u64;
        let data = [vec![9, 9], stamp.to_le_bytes().to_vec(), 2500.0_f32.to_be_bytes().to_vec()].concat();
        let found = [Chunk { id: 0xa0, data: &data }];
        assert_eq!(names.whole("ChunkTimestamp", &found), Some(stamp));
        assert_eq!(names.number("ChunkExposureTime", &found), Some(2500.0));
        assert_eq!(names.whole("ChunkExposureTime", &found), None, "no whole number");
        assert_eq!(names.number("ChunkLong", &found), None, "longer than the chunk");
        assert_eq!(names.signed("ChunkEncoderValue", &found), Some(0x08_07_06));
        let below = [Chunk { id: 0xa0, data: &[0, 0, 0xff, 0xff, 0xfe] }];
        assert_eq!(names.signed("ChunkEncoderValue", &below), Some(-2));
        assert_eq!(names.signed("ChunkUnsigned", &below), Some(0xff_fffe));
        let whole =
            [Chunk { id: 0xa0, data: &[[0, 0], [0xff; 2], [0xff; 2], [0xff; 2], [0xff; 2]].concat() }];
        assert_eq!(
            (names.signed("ChunkTimestamp", &whole), names.whole("ChunkTimestamp", &whole)),
            (None, Some(u64::MAX))
        );
        assert_eq!(names.number("ChunkOfTheDevice", &found), None);
        assert_eq!(names.number("ChunkTimestamp", &[]), None);
        assert_eq!(ChunkNames::of("no description"), ChunkNames::default());
    }
}
