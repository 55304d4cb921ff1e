//! The site of one recording.

use super::shown::{PICTURE_PATH, Shown};
use super::{page, picture};
use crate::serve::html::{self, ICON_PATH, SCRIPT_PATH, STYLE_PATH};
use crate::serve::http::{Media, Reply, Site};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use trueline_cell::{CellState, LivePicture, Progress, RobotBrief};

/// Between looks at the page, ms.
const EVERY_MS: u32 = 1000;

/// The pages of a recording.
#[derive(Debug)]
pub struct CellSite {
    title: String,
    began: Instant,
    shown: Mutex<Shown>,
    picture: Option<Arc<LivePicture>>,
}

impl CellSite {
    /// A site with nothing to show yet; `picture` is the camera's.
    #[must_use]
    pub fn new(title: String, picture: Option<Arc<LivePicture>>) -> Self {
        Self { title, began: Instant::now(), shown: Mutex::default(), picture }
    }

    fn shown(&self) -> MutexGuard<'_, Shown> {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes notice of how things are; `robot` is the robot in words.
    pub fn show(&self, robot: String, brief: RobotBrief, state: &CellState) {
        let at_s = self.began.elapsed().as_secs_f64();
        let mut shown = self.shown();
        (shown.at_s, shown.robot, shown.brief) = (at_s, robot, brief);
        shown.poses.add(at_s, brief.poses);
        if let Some(counts) = &state.camera {
            shown.pictures.add(at_s, counts.frames);
        }
        if let Some(Progress::Estimated(estimated)) = &state.estimate {
            shown.growth.add(at_s, estimated);
        }
        shown.state = Some(state.clone());
    }
}

impl Site for CellSite {
    fn paths(&self) -> &'static [&'static str] {
        &["/", PICTURE_PATH, STYLE_PATH, SCRIPT_PATH, ICON_PATH]
    }

    fn reply(&self, path: &str) -> Result<Reply, String> {
        let looked = || self.picture.as_ref().and_then(|picture| picture.look());
        if let Some(asset) = html::asset(path) {
            return Ok(asset);
        }
        match path {
            PICTURE_PATH => {
                let picture = looked().ok_or("there is no picture yet")?;
                let body = picture::png(&picture).map_err(|error| error.to_string())?;
                Ok(Reply { media: Media::Png, body })
            }
            _ => {
                let picture = looked();
                let blocks = page::blocks(&self.shown(), picture.as_ref(), self.picture.is_some());
                Ok(Reply::text(Media::Html, html::page(&self.title, EVERY_MS, &blocks)))
            }
        }
    }
}
