//! The live pages in a real browser: nothing is blocked, nothing complains, and what changes is drawn without a reload.
//!
//! Needs Chromium: see `common/chromium.rs`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "it/common/chromium.rs"]
mod chromium;
#[path = "it/common/live_sites.rs"]
mod common;

use chromium::attribute;
use common::{Growing, offer_picture, state_with_an_alarm};
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use trueline_cli::serve::http::Reply;
use trueline_cli::serve::{FolderSite, Limits, LiveServer, Prefix, Site, WatchSite};

/// The page as it is after some seconds, when its script has looked three times, and what the browser said meanwhile.
fn opened(browser: &Path, folder: &Path, server: &LiveServer, width_px: u32) -> [String; 2] {
    let address = format!("http://{}/", server.address());
    chromium::opened(browser, folder, &address, width_px, &["--virtual-time-budget=9000", "--dump-dom"])
}

fn is_well(page: &str, said: &str) {
    let root = page.split_once("<head>").map_or("", |(root, _)| root);
    assert!(!said.contains(":CONSOLE"), "{said}");
    assert_eq!(attribute(root, "data-problems"), Some(""), "{root}");
    assert_eq!(attribute(root, "data-overflow"), Some("0"), "wider than the window: {root}");
    assert!(attribute(root, "data-silent").is_none(), "no answer: {root}");
    let asked: u32 = attribute(root, "data-asked").expect("the script did not run").parse().unwrap();
    assert!(asked >= 2, "{root}");
}

/// A recording that has grown when its page is asked for once more.
struct GrowsWhenAsked {
    growing: Growing,
    asked: AtomicU32,
}

impl Site for GrowsWhenAsked {
    fn paths(&self) -> &'static [&'static str] {
        self.growing.site.paths()
    }

    fn reply(&self, path: &str) -> Result<Reply, String> {
        if path == "/" && self.asked.fetch_add(1, Ordering::SeqCst) == 1 {
            self.growing.grow(1.0);
        }
        self.growing.site.reply(path)
    }
}

fn serve(site: Arc<dyn Site>) -> LiveServer {
    LiveServer::start(SocketAddr::from(([127, 0, 0, 1], 0)), &[], Limits::default(), site).unwrap()
}

#[test]
fn live_pages_draw_what_changes_and_nothing_is_blocked() {
    let Some(browser) = chromium::browser("live pages") else { return };
    let folder = tempfile::tempdir().unwrap();
    let watched = serve(Arc::new(WatchSite::of(vec![state_with_an_alarm(folder.path())])));
    for width in [1400, 520] {
        let [page, said] = opened(&browser, folder.path(), &watched, width);
        is_well(&page, &said);
        assert!(page.contains("ALARM: Pictures arrive "), "{page}");
    }

    let growing = Growing::new();
    growing.grow(0.4);
    offer_picture(&growing.picture, 17);
    let first = String::from_utf8(growing.site.reply("/").unwrap().body).unwrap();
    let recorded = serve(Arc::new(GrowsWhenAsked { growing, asked: AtomicU32::new(0) }));
    let [page, said] = opened(&browser, folder.path(), &recorded, 1400);
    is_well(&page, &said);
    assert!(page.contains("the seam is marked"), "{page}");
    let points =
        |page: &str| page.split("seam points</th><td>").nth(1)?.split('<').next()?.parse::<u32>().ok();
    assert!(points(&page) > points(&first), "it did not grow: {:?} {:?}", points(&first), points(&page));
}

/// A cell with something on every page: link and sensor, a finished recording, a result, and welds with an alarm.
fn cell(folder: &Path) {
    state_with_an_alarm(folder);
    std::fs::write(folder.join("link.json"), "{}").unwrap();
    std::fs::write(folder.join("sensor.toml"), "kind = \"profiler\"\n").unwrap();
    std::fs::create_dir(folder.join("scan")).unwrap();
    std::fs::write(folder.join("scan/robot.csv"), "time_s\n").unwrap();
}

/// As a phone and a desktop show them, by day and by night: no page is wider than the window, and nothing is blocked.
#[test]
fn the_pages_of_a_cell_fit_phones_and_desktops_by_day_and_by_night() {
    let Some(browser) = chromium::browser("pages of a cell") else { return };
    let folder = tempfile::tempdir().unwrap();
    cell(folder.path());
    let prefix = Prefix::new("/cells/7").unwrap();
    let site = Arc::new(FolderSite::of(folder.path().to_owned(), prefix.text()));
    let address = SocketAddr::from(([127, 0, 0, 1], 0));
    let server = LiveServer::start_under(&prefix, address, &[], Limits::default(), site).unwrap();
    let scratch = tempfile::tempdir().unwrap();
    for (page, width_px, is_dark) in [
        ("", 400, true),
        ("first-scan/", 400, false),
        ("recordings/", 400, true),
        ("watch/", 400, false),
        ("history/", 400, true),
        ("first-scan/", 1400, true),
        ("history/", 1400, false),
    ] {
        let url = format!("http://{}/cells/7/{page}", server.address());
        let mut more = vec!["--virtual-time-budget=9000", "--dump-dom"];
        if is_dark {
            more.push("--force-dark-mode");
        }
        let [shown, said] = chromium::opened(&browser, scratch.path(), &url, width_px, &more);
        is_well(&shown, &said);
        assert!(shown.contains("read-only"), "{shown}");
    }
}
