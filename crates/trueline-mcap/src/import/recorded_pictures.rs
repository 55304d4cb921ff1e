//! The pictures of a recording, decoded one by one on request.

use crate::import::stored_picture::{MessageType, RecordedFrame};
use crate::import_error::ImportError;
use crate::message::content::{Content, Picture};
use crate::message::decode::decode;
use crate::read::bag::Bag;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use trueline_dataset::{Error, FrameStamp, GrayImage, PictureSource, Problem, gray_picture, gray_png};

/// The pictures of a recording. Nothing is held in memory but where each of them is.
pub struct RecordedPictures {
    bag: Bag,
    topic: String,
    types: Vec<MessageType>,
    frames: Vec<RecordedFrame>,
}

impl std::fmt::Debug for RecordedPictures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} pictures of {}", self.frames.len(), self.topic)
    }
}

impl RecordedPictures {
    pub(crate) fn new(
        bag: Bag,
        topic: String,
        types: Vec<MessageType>,
        mut frames: Vec<RecordedFrame>,
    ) -> Self {
        // The camera's own clock counts for all frames or for none.
        if frames.iter().any(|frame| frame.device_ns.is_none()) {
            frames.iter_mut().for_each(|frame| frame.device_ns = None);
        }
        Self { bag, topic, types, frames }
    }

    /// A picture as it was recorded.
    ///
    /// # Errors
    /// A recording that has changed or cannot be read any more.
    pub fn recorded(&self, number: usize) -> Result<Picture, ImportError> {
        let frame = &self.frames[number];
        let bytes = self.bag.read_again(frame.place)?;
        let MessageType { schema, encoding } = &self.types[frame.message_type];
        match decode(schema, encoding, &bytes) {
            Ok(Content::Picture(picture)) => Ok(picture.picture),
            other => {
                let why =
                    other.err().map_or_else(|| "it is not a picture".to_owned(), |error| error.to_string());
                Err(Error::in_file(&self.file(number), Problem::Picture { why }).into())
            }
        }
    }

    fn file(&self, number: usize) -> PathBuf {
        let file = self.bag.files().nth(self.frames[number].place.file).unwrap_or(Path::new(""));
        PathBuf::from(format!("{}, picture {} of {}", file.display(), number + 1, self.topic))
    }
}

impl PictureSource for RecordedPictures {
    fn count(&self) -> usize {
        self.frames.len()
    }

    fn stamp(&self, number: usize) -> FrameStamp {
        let RecordedFrame { stamp_ns, frame, device_ns, .. } = self.frames[number];
        FrameStamp { stamp_ns, frame, device_ns }
    }

    fn name(&self, number: usize) -> String {
        self.file(number).display().to_string()
    }

    fn read(&self, number: usize, spare: &mut Vec<u8>) -> Result<GrayImage, Error> {
        let picture = self.recorded(number).map_err(|error| match error {
            ImportError::Dataset(error) => error,
            other => Error::in_file(&self.file(number), Problem::Picture { why: other.to_string() }),
        })?;
        match picture {
            Picture::Gray(image) => Ok(image),
            Picture::Compressed(bytes) => gray_picture::decode(&self.file(number), &bytes),
            Picture::Png(bytes) => gray_png::decode(&self.file(number), Cursor::new(bytes), spare),
        }
    }
}
