//! The site of one production or several.

use super::view::CellView;
use super::{metrics, page};
use crate::serve::html::{self, ICON_PATH, SCRIPT_PATH, STYLE_PATH};
use crate::serve::http::{Media, Reply, Site};
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

/// Between looks at the page, ms.
const EVERY_MS: u32 = 2000;

/// Cells by their state files; each is read anew for each request, so any program may write it.
#[derive(Clone, Debug)]
pub struct WatchSite {
    states: Vec<PathBuf>,
}

impl WatchSite {
    /// A site of these cells.
    #[must_use]
    pub fn of(states: Vec<PathBuf>) -> Self {
        Self { states }
    }

    /// The present blocks of all cells.
    pub(crate) fn blocks(&self) -> String {
        let now_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs().cast_signed());
        page::blocks(&self.cells(), now_s)
    }

    fn cells(&self) -> Vec<(String, Result<CellView, String>)> {
        let read = |state: &PathBuf| {
            let name = state.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
            (name, CellView::read(state).map_err(|error| error.to_string()))
        };
        self.states.iter().map(read).collect()
    }
}

impl Site for WatchSite {
    fn paths(&self) -> &'static [&'static str] {
        &["/", "/metrics", STYLE_PATH, SCRIPT_PATH, ICON_PATH]
    }

    fn reply(&self, path: &str) -> Result<Reply, String> {
        if let Some(asset) = html::asset(path) {
            return Ok(asset);
        }
        match path {
            "/metrics" => {
                let cells = self.cells().into_iter().map(|(_, cell)| cell).collect::<Result<Vec<_>, _>>()?;
                metrics::text(&cells).map(|text| Reply::text(Media::Metrics, text)).map_err(|e| e.to_string())
            }
            _ => Ok(Reply::text(Media::Html, html::page("trueline watch", EVERY_MS, &self.blocks()))),
        }
    }
}
