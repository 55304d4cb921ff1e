//! Log of the program: events and spans of the libraries and messages to users, as lines of JSON in a file (`--log-file`),
//! and their part that `--verbose` shows on stderr. Nothing of it goes to stdout.

use crate::args::GlobalArgs;
use crate::failure::Failure;
use crate::log_layer::{Entry, LogLayer, Sink};
use crate::stderr;
use std::env;
use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Write as _};
use std::path::Path;
use std::sync::{Mutex, OnceLock};
use tracing::Level;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::{Layer as _, SubscriberExt as _};
use tracing_subscriber::util::SubscriberInitExt as _;

/// The target of words that stand on stderr already.
const TOLD: &str = "trueline::told";
/// Environment variable that selects the logged events.
const VARIABLE: &str = "RUST_LOG";
/// All crates of ours begin with this.
const OURS: &str = "trueline";
/// How every line of a log begins.
const LINE_BEGINS: &str = "{\"time\":\"";

static VERBOSE: OnceLock<bool> = OnceLock::new();
static QUIET: OnceLock<bool> = OnceLock::new();

/// Whether details are wanted.
pub(crate) fn is_verbose() -> bool {
    VERBOSE.get().copied().unwrap_or(false)
}

/// Whether messages that are not errors are suppressed.
pub(crate) fn is_quiet() -> bool {
    QUIET.get().copied().unwrap_or(false)
}

/// Logs messages to a user.
pub(crate) fn told(text: &str) {
    if text.starts_with("error: ") {
        tracing::error!(target: TOLD, "{text}");
    } else if text.starts_with("warning: ") {
        tracing::warn!(target: TOLD, "{text}");
    } else {
        tracing::info!(target: TOLD, "{text}");
    }
}

/// Starts the log that the options and `RUST_LOG` request. Without these nothing is logged, at no cost.
pub(crate) fn start(args: &GlobalArgs) -> Result<(), Failure> {
    // A process runs one command.
    let (_, _) = (VERBOSE.set(args.verbose), QUIET.set(args.quiet));
    let chosen = chosen();
    let file = args.log_file.as_deref().map(LogFile::open).transpose()?;
    let on_stderr = args.verbose || chosen.is_some() && file.is_none();
    let of_ours = |level| Targets::new().with_target(OURS, level);
    let file = file.map(|file| {
        let usual = of_ours(LevelFilter::DEBUG).with_default(LevelFilter::INFO);
        LogLayer::new(file).with_filter(chosen.clone().unwrap_or(usual))
    });
    let stderr = on_stderr.then(|| {
        let usual = of_ours(LevelFilter::INFO).with_default(LevelFilter::WARN);
        LogLayer::new(Stderr).with_filter(chosen.unwrap_or(usual))
    });
    if file.is_none() && stderr.is_none() {
        return Ok(());
    }
    // Libraries without spans write to `log`, which is included here. The program is part of another one that has its
    // own.
    if tracing_subscriber::registry().with(file).with(stderr).try_init().is_err() {
        stderr::words("warning: nothing is logged: this process has a log of its own");
    }
    tracing::debug!(version = env!("CARGO_PKG_VERSION"), pid = std::process::id(), "started");
    Ok(())
}

/// Selection of `RUST_LOG`. It may be set for other programs: an invalid value is no error here.
fn chosen() -> Option<Targets> {
    let text = env::var(VARIABLE).ok().filter(|text| !text.trim().is_empty())?;
    match text.parse() {
        Ok(targets) => Some(targets),
        Err(_) => {
            stderr::words(&format!(
                "warning: {VARIABLE} is ignored, for it is neither a level (debug) nor a list as trueline_watch=debug,warn"
            ));
            None
        }
    }
}

/// Output of `--verbose`.
struct Stderr;

impl Sink for Stderr {
    fn take(&self, entry: &Entry<'_>) {
        if entry.target != TOLD {
            stderr::words(&text(entry));
        }
    }
}

/// An entry as a line of words.
fn text(entry: &Entry<'_>) -> String {
    let level = match entry.level {
        Level::ERROR => "error: ",
        Level::WARN => "warning: ",
        _ => "",
    };
    let mut out = match entry.duration_s {
        Some(duration_s) => format!("{}: {duration_s:.2} s", entry.span),
        None => format!("{level}{}", entry.message),
    };
    let mut before = if entry.duration_s.is_some() { ", " } else { ": " };
    for (name, value) in entry.fields {
        let shown = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let _ = write!(out, "{before}{name} {shown}");
        before = ", ";
    }
    out
}

/// A file of lines of JSON that is added to.
struct LogFile {
    file: Mutex<File>,
    /// Reported once: the log cannot be written.
    failed: OnceLock<()>,
}

impl LogFile {
    /// Opens a log, or begins one. A file that is not a log is left unchanged.
    fn open(path: &Path) -> Result<Self, Failure> {
        let cannot = |error: &io::Error| {
            Failure::new(
                format!("{}: the log cannot be written: {error}", path.display()),
                "--log-file takes the name of a file in a folder that is there; check the path and its permissions",
            )
        };
        let file =
            OpenOptions::new().create(true).append(true).read(true).open(path).map_err(|e| cannot(&e))?;
        let mut first = String::new();
        // A pipe or a device cannot be read back, and holds nothing that could be spoiled.
        let is_read = file.metadata().is_ok_and(|about| about.is_file() && about.len() > 0);
        let read = if is_read { BufReader::new(&file).read_line(&mut first) } else { Ok(0) };
        if read.is_err() || !first.is_empty() && !first.starts_with(LINE_BEGINS) {
            return Err(Failure::new(
                format!("{}: exists, but is not a log of trueline", path.display()),
                "--log-file adds to a log: name a new file, or one that it began",
            ));
        }
        Ok(Self { file: Mutex::new(file), failed: OnceLock::new() })
    }
}

impl Sink for LogFile {
    fn take(&self, entry: &Entry<'_>) {
        let line = format!("{}\n", trueline_report::terminal_text::json_shown(&json(entry)));
        let written = self.file.lock().map(|mut file| file.write_all(line.as_bytes()));
        if let Ok(Err(error)) = written
            && self.failed.set(()).is_ok()
        {
            stderr::words(&format!("warning: the log cannot be written any more: {error}"));
        }
    }
}

/// An entry as JSON. The time comes first, for people who read the file directly.
fn json(entry: &Entry<'_>) -> String {
    let mut out = format!("{LINE_BEGINS}{}\"", jiff::Timestamp::now());
    let mut add = |name: &str, value: serde_json::Value| {
        let _ = write!(out, ",\"{name}\":{value}");
    };
    add("level", entry.level.as_str().into());
    add("target", entry.target.into());
    if !entry.span.is_empty() {
        add("span", entry.span.into());
    }
    if let Some(duration_s) = entry.duration_s {
        add("duration_s", duration_s.into());
    }
    if !entry.message.is_empty() {
        add("message", entry.message.into());
    }
    if !entry.fields.is_empty() {
        let fields = entry.fields.iter().map(|(name, value)| ((*name).to_owned(), value.clone()));
        add("fields", serde_json::Value::Object(fields.collect()));
    }
    out.push('}');
    out
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn entry<'a>(fields: &'a [(&'static str, serde_json::Value)], duration_s: Option<f64>) -> Entry<'a> {
        let message = if duration_s.is_some() { "" } else { "written" };
        Entry {
            level: Level::INFO,
            target: "trueline",
            span: "calibrate/search",
            message,
            duration_s,
            fields,
        }
    }

    #[test]
    fn an_event_and_the_end_of_a_span_are_lines_of_json_and_of_words() {
        let fields = [("file", "a\n\"b".into()), ("bytes", 12.into())];
        let event: serde_json::Value = serde_json::from_str(&json(&entry(&fields, None))).unwrap();
        assert!(event["time"].as_str().unwrap().parse::<jiff::Timestamp>().is_ok());
        assert_eq!(event["fields"]["file"], "a\n\"b");
        assert_eq!((&event["level"], &event["message"]), (&"INFO".into(), &"written".into()));
        assert_eq!(text(&entry(&fields[1..], None)), "written: bytes 12");
        let end: serde_json::Value = serde_json::from_str(&json(&entry(&[], Some(0.25)))).unwrap();
        assert_eq!((end["duration_s"].as_f64(), &end["span"]), (Some(0.25), &"calibrate/search".into()));
        assert_eq!(text(&entry(&fields[1..], Some(0.251))), "calibrate/search: 0.25 s, bytes 12");
    }
}
