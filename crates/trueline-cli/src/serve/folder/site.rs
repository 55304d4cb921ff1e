//! The site of a cell's folder.

use super::contents::Contents;
use super::{first_scan, history, recordings};
use crate::serve::html::{self, ICON_PATH, SCRIPT_PATH, STYLE_PATH, block};
use crate::serve::http::{Media, Reply, Site};
use crate::serve::watch::WatchSite;
use std::path::PathBuf;

/// Between looks at a page, ms.
const EVERY_MS: u32 = 2000;
/// Pages and their content.
const PAGES: [(&str, &str, &str); 4] = [
    ("/first-scan/", "First scan", "connect, look, plan, record, calibrate, copy the answer: step by step"),
    ("/recordings/", "Recordings", "past and running recordings"),
    ("/watch/", "Watch", "whether the calibration is still good, from every weld"),
    ("/history/", "History", "the last welds of every cell"),
];

/// A cell's folder. Each request reads the folder's present content; nothing is ever written.
#[derive(Clone, Debug)]
pub struct FolderSite {
    folder: PathBuf,
    prefix: String,
}

impl FolderSite {
    /// A site of a folder. Its links begin with the prefix under which a proxy shows it; empty without a proxy.
    #[must_use]
    pub fn of(folder: PathBuf, prefix: &str) -> Self {
        Self { folder, prefix: prefix.to_owned() }
    }

    fn page(&self, title: &str, blocks: &str) -> Reply {
        let links: String = [("/", "Overview", "")]
            .iter()
            .chain(&PAGES)
            .map(|(path, name, _)| format!("<a href=\"{}{path}\">{name}</a> ", html::escape(&self.prefix)))
            .collect();
        let body = format!("<nav>{links}</nav>{blocks}");
        Reply::text(Media::Html, html::page_under(&self.prefix, title, EVERY_MS, &body))
    }

    fn overview(&self, contents: &Contents) -> String {
        let states = [
            (contents.answer.is_some(), "a result"),
            (!contents.recordings.is_empty(), "recordings"),
            (!contents.states.is_empty(), "a state of watch"),
        ];
        let has: Vec<&str> =
            states.into_iter().filter_map(|(is_there, name)| is_there.then_some(name)).collect();
        let has = if has.is_empty() { "nothing yet".to_owned() } else { has.join(", ") };
        let rows: String = PAGES
            .iter()
            .map(|(path, name, what)| {
                let prefix = html::escape(&self.prefix);
                format!(
                    "<tr><th scope=\"row\"><a href=\"{prefix}{path}\">{name}</a></th><td>{what}</td></tr>"
                )
            })
            .collect();
        let folder = html::escape(&self.folder.display().to_string());
        block("overview", &format!("<p>{folder}: {has}.</p><table>{rows}</table>"))
    }
}

impl Site for FolderSite {
    fn paths(&self) -> &'static [&'static str] {
        &[
            "/",
            "/first-scan/",
            "/recordings/",
            "/watch/",
            "/history/",
            "/metrics",
            STYLE_PATH,
            SCRIPT_PATH,
            ICON_PATH,
        ]
    }

    fn reply(&self, path: &str) -> Result<Reply, String> {
        if let Some(asset) = html::asset(path) {
            return Ok(asset);
        }
        let contents = Contents::of(&self.folder)?;
        let watched = || WatchSite::of(contents.states.clone());
        Ok(match path {
            "/metrics" => watched().reply(path)?,
            "/first-scan/" => self.page("First scan", &first_scan::blocks(&self.folder, &contents)),
            "/recordings/" => self.page("Recordings", &recordings::blocks(&contents)),
            "/watch/" if contents.states.is_empty() => {
                self.page("Watch", &block("watch", "<p class=\"state\">No weld has been watched yet.</p>"))
            }
            "/watch/" => self.page("Watch", &watched().blocks()),
            "/history/" => self.page("History", &history::blocks(&contents.states)),
            _ => self.page("trueline", &self.overview(&contents)),
        })
    }
}
