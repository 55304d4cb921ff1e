//! The pictures of a scan, wherever they are kept.

use crate::error::Error;
use crate::gray_png::{self, GrayImage};
use crate::images::{self, FrameFile};
use std::path::Path;

/// What is recorded of a frame besides its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameStamp {
    /// Stamp on arrival, ns.
    pub stamp_ns: i64,
    /// Frame counter.
    pub frame: u64,
    /// Stamp of the camera's own clock, ns, where recorded.
    pub device_ns: Option<i64>,
}

/// Pictures by number, in the order of the scan: a folder, a recording, an array in memory.
pub trait PictureSource: Sync {
    /// How many there are.
    fn count(&self) -> usize;

    /// When a picture was taken.
    fn stamp(&self, number: usize) -> FrameStamp;

    /// What a person calls a picture: its file, as a rule.
    fn name(&self, number: usize) -> String;

    /// Reads a picture. `spare` is memory that may be used again.
    ///
    /// # Errors
    /// A picture that is missing or cannot be decoded.
    fn read(&self, number: usize, spare: &mut Vec<u8>) -> Result<GrayImage, Error>;
}

/// The pictures of a dataset folder.
#[derive(Clone, Debug)]
pub struct PictureFolder {
    frames: Vec<FrameFile>,
}

impl PictureFolder {
    /// Reads the index of a dataset folder; the pictures are read one by one when they are asked for.
    ///
    /// # Errors
    /// As [`images::read_index`].
    pub fn open(dataset: &Path) -> Result<Self, Error> {
        Ok(Self { frames: images::read_index(dataset)? })
    }

    /// The frames.
    #[must_use]
    pub fn frames(&self) -> &[FrameFile] {
        &self.frames
    }
}

impl PictureSource for PictureFolder {
    fn count(&self) -> usize {
        self.frames.len()
    }

    fn stamp(&self, number: usize) -> FrameStamp {
        let FrameFile { stamp_ns, frame, device_ns, .. } = self.frames[number];
        FrameStamp { stamp_ns, frame, device_ns }
    }

    fn name(&self, number: usize) -> String {
        self.frames[number].path.display().to_string()
    }

    fn read(&self, number: usize, spare: &mut Vec<u8>) -> Result<GrayImage, Error> {
        gray_png::read(&self.frames[number].path, spare)
    }
}
