//! The pictures of a scan, wherever they are kept.

use crate::decoded_picture::{self, DecodedPicture};
use crate::error::{Error, Problem};
use crate::gray_picture;
use crate::gray_png::{self, GrayImage};
use crate::images::{self, FrameFile};
use crate::laser_channel::Channel;
use std::path::Path;
use std::sync::OnceLock;

/// Data of a frame besides its pixels.
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
    /// Their number.
    fn count(&self) -> usize;

    /// When a picture was taken.
    fn stamp(&self, number: usize) -> FrameStamp;

    /// Name of a picture for people: its file, as a rule.
    fn name(&self, number: usize) -> String;

    /// Reads a picture. `spare` is memory that may be used again.
    ///
    /// # Errors
    /// A picture that is missing or cannot be decoded.
    fn read(&self, number: usize, spare: &mut Vec<u8>) -> Result<GrayImage, Error>;

    /// Excess of the laser's colour over the others in a picture, pixel by pixel: in daylight it separates the stripe from
    /// other light. `None` of pictures that have no colours, or are kept without them.
    ///
    /// # Errors
    /// As [`Self::read`].
    fn colour(&self, _number: usize) -> Result<Option<GrayImage>, Error> {
        Ok(None)
    }
}

/// Colour pictures from which the laser's channel is learnt.
const CHANNEL_PICTURES: usize = 5;

/// The pictures of a dataset folder.
#[derive(Clone, Debug)]
pub struct PictureFolder {
    frames: Vec<FrameFile>,
    /// The laser's channel, once a colour picture was met.
    channel: OnceLock<Channel>,
    /// The laser's colour, once requested.
    colour: OnceLock<Channel>,
}

impl PictureFolder {
    /// Reads the index of a dataset folder; the pictures are read one by one on request.
    ///
    /// # Errors
    /// As [`images::read_index`].
    pub fn open(dataset: &Path) -> Result<Self, Error> {
        Ok(Self { frames: images::read_index(dataset)?, channel: OnceLock::new(), colour: OnceLock::new() })
    }

    /// The channel used of colour pictures; `None` as long as all are gray.
    #[must_use]
    pub fn channel(&self) -> Option<Channel> {
        self.channel.get().copied()
    }

    /// A picture of whichever form; of one in colour the laser's channel.
    fn read_any(&self, number: usize) -> Result<GrayImage, Error> {
        let decoded = self.decoded(number)?;
        if decoded.channels < 3 {
            return Ok(Channel::Gray.image(decoded));
        }
        let channel = self.channel.get_or_init(|| Channel::of_laser(self.some().iter()));
        Ok(channel.image(decoded))
    }

    /// Some pictures, spread over the scan: the same whichever picture is read first.
    fn some(&self) -> Vec<DecodedPicture> {
        let step = self.frames.len().div_ceil(CHANNEL_PICTURES).max(1);
        (0..self.frames.len()).step_by(step).filter_map(|number| self.decoded(number).ok()).collect()
    }

    fn decoded(&self, number: usize) -> Result<DecodedPicture, Error> {
        let file = &self.frames[number].path;
        let bytes = gray_picture::bytes(file)?;
        decoded_picture::decode(&bytes).map_err(|why| Error::in_file(file, Problem::Picture { why }))
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
        let file = &self.frames[number].path;
        if !file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
            return self.read_any(number);
        }
        // Into memory that is there already; few are not gray.
        match gray_png::read(file, spare) {
            Err(Error { problem: Problem::NotGray { .. }, .. }) => self.read_any(number),
            // The format may differ from the name, as in downloaded pictures.
            Err(error @ Error { problem: Problem::Picture { .. }, .. }) => {
                self.read_any(number).map_err(|_| error)
            }
            read => read,
        }
    }

    fn colour(&self, number: usize) -> Result<Option<GrayImage>, Error> {
        // Gray pictures are not decoded again: one in colour has its channel since it was read.
        if self.channel().is_none() {
            return Ok(None);
        }
        let decoded = self.decoded(number)?;
        let colour = self.colour.get_or_init(|| Channel::of_colour(self.some().iter()));
        Ok((decoded.channels >= 3).then(|| colour.colour_image(&decoded)))
    }
}
