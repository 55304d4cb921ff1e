//! Frames of a folder of pictures without an index: their order, and their stamps, from their names.

use crate::error::{Error, Problem};
use crate::gray_picture::is_picture;
use crate::images::FrameFile;
use crate::stamp;
use std::fs;
use std::path::{Path, PathBuf};

/// What says when pictures were taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PictureStamps {
    /// The number in their names counts frames of this many a second, and the first one has this stamp, ns.
    Rate {
        /// Frames a second.
        fps: f64,
        /// Stamp of the first one, ns.
        first_ns: i64,
    },
    /// The number in their names is the stamp, in units of so many ns.
    Names {
        /// Nanoseconds of a unit.
        unit_ns: i64,
    },
}

/// The frames of `images/` in a dataset folder, by the last number in each name.
///
/// # Errors
/// A folder without pictures; names without a number, or with the same one twice.
pub fn frames(dataset: &Path, stamps: PictureStamps) -> Result<Vec<FrameFile>, Error> {
    let folder = dataset.join("images");
    let entries = fs::read_dir(&folder).map_err(|error| Error::in_file(&folder, Problem::Io(error)))?;
    let mut numbered: Vec<(i64, PathBuf)> = Vec::new();
    for entry in entries {
        let path = entry.map_err(|error| Error::in_file(&folder, Problem::Io(error)))?.path();
        if is_picture(&path) {
            let number = last_number(&path).ok_or_else(|| Error::in_file(&path, Problem::NoNumberInName))?;
            numbered.push((number, path));
        }
    }
    numbered.sort();
    let Some((first, _)) = numbered.first().cloned() else {
        return Err(Error::in_file(&folder, Problem::NoRows));
    };
    if let Some(twice) = numbered.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(Error::in_file(&twice[1].1, Problem::NumberTwice { number: twice[1].0 }));
    }
    let frame = |(place, (number, path)): (usize, (i64, PathBuf))| {
        let (stamp_ns, frame) = match stamps {
            PictureStamps::Rate { fps, first_ns } => {
                // A number that is missing is a picture that was lost.
                let counted = number - first;
                let since_first_ns = (counted as f64 * 1e9 / fps).round() as i64;
                (first_ns.saturating_add(since_first_ns), counted as u64)
            }
            PictureStamps::Names { unit_ns } => {
                let stamp = number.checked_mul(unit_ns);
                (stamp.ok_or_else(|| Error::in_file(&path, Problem::NoNumberInName))?, place as u64)
            }
        };
        if !stamp::is_in_range(stamp_ns) {
            let text = format!("{} s", stamp::seconds(stamp_ns));
            return Err(Error::in_file(&path, Problem::NotAStamp { text }));
        }
        Ok(FrameFile { stamp_ns, frame, device_ns: None, path })
    };
    numbered.into_iter().enumerate().map(frame).collect()
}

/// The last number in a file's name without its ending.
fn last_number(path: &Path) -> Option<i64> {
    let name = path.file_stem()?.to_str()?;
    let digits = name.rsplit(|c: char| !c.is_ascii_digit()).find(|part| !part.is_empty())?;
    digits.parse().ok()
}
