//! PLY, ascii or binary: one element `vertex` with x and z, and a time, frame or y that separates profiles.

use super::RawProfile;
use super::rows::point_of_mm;
use crate::error::{Error, Problem};
use std::path::Path;

/// How numbers are stored.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A property of a vertex: its name and type.
struct Property {
    name: String,
    kind: Kind,
}

#[derive(Clone, Copy)]
enum Kind {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
}

struct Header {
    encoding: Encoding,
    vertices: usize,
    properties: Vec<Property>,
    /// Start of the data.
    data: usize,
}

/// Reads the vertices as profiles.
///
/// # Errors
/// Another element before the vertices, lists, missing x or z, or a file that is cut off.
pub fn read(file: &Path, bytes: &[u8]) -> Result<Vec<RawProfile>, Error> {
    let refuse = |why: &str| Error::in_file(file, Problem::Ply(why.to_owned()));
    let header = header(bytes).map_err(|why| refuse(&why))?;
    let place = |names: &[&str]| header.properties.iter().position(|p| names.contains(&p.name.as_str()));
    let x = place(&["x"]).ok_or_else(|| refuse("there is no property x"))?;
    let z = place(&["z"]).ok_or_else(|| refuse("there is no property z"))?;
    let time = place(&["time", "time_s", "timestamp"]);
    let apart = time.or_else(|| place(&["frame", "scan", "profile"])).or_else(|| place(&["y"]));
    let apart = apart.ok_or_else(|| refuse("there is no property time, frame or y to separate profiles"))?;
    let rows = rows(&header, &bytes[header.data..]).ok_or_else(|| refuse("it is cut off or not a number"))?;
    let mut profiles: Vec<RawProfile> = Vec::new();
    let mut last: Option<f64> = None;
    for row in rows {
        if !(row[x].is_finite() && row[z].is_finite()) {
            continue;
        }
        if last != Some(row[apart]) {
            let stamp_ns = time.map(|place| (row[place] * 1e9).round() as i64);
            profiles.push(RawProfile { stamp_ns, ..RawProfile::of_points(Vec::new()) });
            last = Some(row[apart]);
        }
        if let Some(profile) = profiles.last_mut() {
            profile.points.push(point_of_mm(row[x], row[z]));
        }
    }
    Ok(profiles)
}

fn header(bytes: &[u8]) -> Result<Header, String> {
    const END: &[u8] = b"end_header";
    let end = bytes.windows(END.len()).position(|window| window == END).ok_or("the header does not end")?;
    let line_end = bytes[end..].iter().position(|&byte| byte == b'\n').ok_or("the header does not end")?;
    let text = std::str::from_utf8(&bytes[..end]).map_err(|_| "the header is not text")?;
    let mut found =
        Header { encoding: Encoding::Ascii, vertices: 0, properties: Vec::new(), data: end + line_end + 1 };
    let mut element = "";
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["format", encoding, _] => {
                found.encoding = match encoding {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    other => return Err(format!("unknown format {other}")),
                }
            }
            ["element", "vertex", count] => {
                found.vertices = count.parse().map_err(|_| "the number of vertices is not a number")?;
                element = "vertex";
            }
            ["element", other, _] if found.vertices == 0 => {
                return Err(format!("element {other} before the vertices"));
            }
            ["element", ..] => element = "other",
            ["property", "list", ..] if element == "vertex" => return Err("a list in a vertex".to_owned()),
            ["property", kind, name] if element == "vertex" => {
                found.properties.push(Property { name: name.to_lowercase(), kind: kind_of(kind)? });
            }
            ["comment", ..] if line.split_whitespace().any(|word| word.trim_matches(',') == "metres") => {
                return Err("it is stated in metres, but profiles are in millimetres".to_owned());
            }
            _ => {}
        }
    }
    Ok(found)
}

fn kind_of(name: &str) -> Result<Kind, String> {
    Ok(match name {
        "char" | "int8" => Kind::Signed(1),
        "short" | "int16" => Kind::Signed(2),
        "int" | "int32" => Kind::Signed(4),
        "uchar" | "uint8" => Kind::Unsigned(1),
        "ushort" | "uint16" => Kind::Unsigned(2),
        "uint" | "uint32" => Kind::Unsigned(4),
        "float" | "float32" => Kind::Float(4),
        "double" | "float64" => Kind::Float(8),
        other => return Err(format!("unknown type {other}")),
    })
}

/// The numbers of every vertex; `None` if there are fewer than the header states.
fn rows(header: &Header, data: &[u8]) -> Option<Vec<Vec<f64>>> {
    if header.encoding == Encoding::Ascii {
        let text = std::str::from_utf8(data).ok()?;
        let lines = text.lines().filter(|line| !line.trim().is_empty()).take(header.vertices);
        let row = |line: &str| -> Option<Vec<f64>> {
            let numbers: Vec<f64> =
                line.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?;
            (numbers.len() >= header.properties.len()).then_some(numbers)
        };
        let rows: Vec<Vec<f64>> = lines.map(row).collect::<Option<_>>()?;
        return (rows.len() == header.vertices).then_some(rows);
    }
    let size: usize = header.properties.iter().map(|property| property.kind.size()).sum();
    // A header may promise any number: memory is reserved only for existing data.
    let needed = size.checked_mul(header.vertices).filter(|&needed| size > 0 && needed <= data.len())?;
    let row = |vertex: &[u8]| {
        let mut rest = vertex;
        let number = |property: &Property| {
            let (field, after) = rest.split_at(property.kind.size());
            rest = after;
            property.kind.value(field, header.encoding)
        };
        header.properties.iter().map(number).collect()
    };
    Some(data[..needed].chunks_exact(size).map(row).collect())
}

impl Kind {
    fn size(self) -> usize {
        match self {
            Self::Signed(size) | Self::Unsigned(size) | Self::Float(size) => size,
        }
    }

    fn value(self, field: &[u8], encoding: Encoding) -> f64 {
        // Eight bytes, least significant first, the sign carried on.
        let mut bytes = [0; 8];
        for (k, byte) in bytes[..field.len()].iter_mut().enumerate() {
            *byte = if encoding == Encoding::BigEndian { field[field.len() - 1 - k] } else { field[k] };
        }
        let raw = u64::from_le_bytes(bytes);
        let unused_bits = 64 - 8 * field.len();
        match self {
            Self::Signed(_) => ((raw << unused_bits) as i64 >> unused_bits) as f64,
            Self::Unsigned(_) => raw as f64,
            Self::Float(4) => f64::from(f32::from_bits(raw as u32)),
            Self::Float(_) => f64::from_bits(raw),
        }
    }
}
