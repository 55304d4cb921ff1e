//! A headless Chromium, for tests of what people see; also of the program's reports.
//!
//! Needs a Chromium in the path, or named by `TRUELINE_CHROMIUM`; without one a test says so and tests nothing.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The browser, or the word that the test is skipped: `shown` is what nobody looks at then.
pub(crate) fn browser(shown: &str) -> Option<PathBuf> {
    let named = std::env::var_os("TRUELINE_CHROMIUM").map(PathBuf::from);
    let folders: Vec<PathBuf> =
        std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()).collect();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let found =
        folders.iter().flat_map(|folder| names.map(|name| folder.join(name))).find(|file| file.exists());
    if named.is_none() && found.is_none() {
        let mut stderr = std::io::stderr();
        writeln!(stderr, "SKIPPED: browser: no Chromium here, the {shown} are not looked at").unwrap();
    }
    named.or(found)
}

/// The browser's print of an address, and its messages meanwhile. It keeps its profile in `folder`.
pub(crate) fn opened(
    browser: &Path,
    folder: &Path,
    address: &str,
    width_px: u32,
    more: &[&str],
) -> [String; 2] {
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
            "--disable-background-networking",
        ])
        .args(["--disable-component-update", "--disable-sync", "--disable-quic", "--enable-logging=stderr"])
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(format!("--window-size={width_px},1200"))
        .args(more)
        .arg(address)
        .output()
        .unwrap();
    [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
}

/// An attribute of the first element in a text.
pub(crate) fn attribute<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let start = text.find(&format!("{name}=\""))? + name.len() + 2;
    text[start..].split('"').next()
}
