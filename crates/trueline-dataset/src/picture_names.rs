//! Frames of a folder of pictures without an index: their order, and their stamps, from their names.

use crate::error::{Error, Problem};
use crate::gray_picture::is_picture;
use crate::images::FrameFile;
use crate::name_stamps;
pub use crate::name_stamps::NameStamps;
use crate::stamp;
use std::fs;
use std::path::{Path, PathBuf};

/// Source of the pictures' times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PictureStamps {
    /// The number in their names counts frames of this many a second, and the first one has this stamp, ns.
    Rate {
        /// Frames a second.
        fps: f64,
        /// Stamp of the first one, ns.
        first_ns: i64,
    },
    /// The number in their names is the stamp, in units of this many ns.
    Names {
        /// Nanoseconds of a unit.
        unit_ns: i64,
    },
}

impl PictureStamps {
    /// The same; a rate begins at a stamp, ns.
    #[must_use]
    pub fn beginning_at(self, first_ns: i64) -> Self {
        match self {
            Self::Rate { fps, .. } => Self::Rate { fps, first_ns },
            Self::Names { .. } => self,
        }
    }
}

impl NameStamps {
    /// Source of the stamps, in words.
    #[must_use]
    pub fn words(self, stamps: PictureStamps) -> &'static str {
        match (stamps, self) {
            (PictureStamps::Rate { .. }, _) => {
                "the first picture gets the stamp of the first robot pose; the time offset is relative to \
                    this"
            }
            (_, Self::Numbers) => "stamps are the numbers in the names",
            (_, Self::Dates) => {
                "stamps are the dates in the names, as seconds since 1970; if the robot's clock has another \
                 origin, `calibrate --align-clocks` estimates the shift"
            }
            (_, Self::SecondsAndFraction) => "stamps are seconds and their fraction, as the names have them",
        }
    }
}

/// Frames of a folder of pictures, and how their names were read.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedFrames {
    /// The frames, in the order of their stamps.
    pub frames: Vec<FrameFile>,
    /// Content of their names.
    pub names: NameStamps,
}

/// Whether there are pictures in `images/` of a dataset folder.
#[must_use]
pub fn has_pictures(dataset: &Path) -> bool {
    let entries = fs::read_dir(dataset.join("images")).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).any(|path| is_picture(&path))
}

/// The frames of `images/` in a dataset folder, by the last number in each name, or by the dates in them.
///
/// # Errors
/// A folder without pictures; names without a number, with equal numbers, or with several possible stamps.
pub fn frames(dataset: &Path, stamps: PictureStamps) -> Result<NamedFrames, Error> {
    frames_in(&dataset.join("images"), stamps)
}

/// The same of a folder of pictures.
///
/// # Errors
/// As [`frames`].
pub(crate) fn frames_in(folder: &Path, stamps: PictureStamps) -> Result<NamedFrames, Error> {
    let entries = fs::read_dir(folder).map_err(|error| Error::in_file(folder, Problem::Io(error)))?;
    let mut paths: Vec<PathBuf> = Vec::new();
    for entry in entries {
        let path = entry.map_err(|error| Error::in_file(folder, Problem::Io(error)))?.path();
        if is_picture(&path) {
            paths.push(path);
        }
    }
    paths.sort();
    let unit_ns = match stamps {
        PictureStamps::Rate { .. } => None,
        PictureStamps::Names { unit_ns } => Some(unit_ns),
    };
    let (mut numbered, names) = name_stamps::of(paths, unit_ns)?;
    numbered.sort();
    let Some((first, _)) = numbered.first().cloned() else {
        return Err(Error::in_file(folder, Problem::NoRows));
    };
    if let Some(twice) = numbered.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(Error::in_file(&twice[1].1, Problem::NumberTwice { number: twice[1].0 }));
    }
    let frame = |(place, (number, path)): (usize, (i64, PathBuf))| {
        let (stamp_ns, frame) = match stamps {
            PictureStamps::Rate { fps, first_ns } => {
                // A number that is missing is a picture that was lost.
                let counted = if names == NameStamps::Numbers { number - first } else { place as i64 };
                let since_first_ns = (counted as f64 * 1e9 / fps).round() as i64;
                (first_ns.saturating_add(since_first_ns), counted as u64)
            }
            PictureStamps::Names { .. } => (number, place as u64),
        };
        if !stamp::is_in_range(stamp_ns) {
            let text = format!("{} s", stamp::seconds(stamp_ns));
            return Err(Error::in_file(&path, Problem::NotAStamp { text }));
        }
        Ok(FrameFile { stamp_ns, frame, device_ns: None, path })
    };
    let frames = numbered.into_iter().enumerate().map(frame).collect::<Result<_, Error>>()?;
    Ok(NamedFrames { frames, names })
}
