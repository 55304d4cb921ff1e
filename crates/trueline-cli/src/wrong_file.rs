//! A file in place of another one: its kind, and the needed kind.

use std::path::Path;
use trueline_dataset::error::Problem;
use trueline_dataset::file_kind::{FileKind, Form};
use trueline_mcap::ImportError;
#[cfg(feature = "live")]
use trueline_watch::store::StoreError;

/// Message and hint for a file of another kind than the one read; `None` if it may be the right one.
pub(crate) fn failure(error: &trueline_dataset::Error) -> Option<(String, String)> {
    let kind = FileKind::of(&error.file)?;
    let needed = needed(&error.problem, &kind)?;
    Some(told(&error.file, &kind, needed))
}

/// The same for a state of `watch`.
#[cfg(feature = "live")]
pub(crate) fn of_state(error: &StoreError) -> Option<(String, String)> {
    let (StoreError::Database { file, .. } | StoreError::NoFile { file }) = error else { return None };
    let kind = FileKind::of(file).filter(|kind| *kind != FileKind::Database)?;
    Some(told(file, &kind, "the data base of `trueline watch --state`"))
}

/// The same for a recording.
pub(crate) fn of_recording(error: &ImportError) -> Option<(String, String)> {
    let file = match error {
        ImportError::NotARecording { file } => file,
        ImportError::Io { file, .. } => file.ancestors().find(|part| part.is_file())?,
        _ => return None,
    };
    let kind = FileKind::of(file).filter(|kind| kind.form() != Form::Folder)?;
    Some(told(file, &kind, "a scan (a dataset folder, an .mcap file or a rosbag2)"))
}

fn told(file: &Path, kind: &FileKind, needed: &str) -> (String, String) {
    (format!("{}: is {kind}; {needed} is needed", file.display()), hint(file, kind))
}

/// The kind of file that a reader needs; `None` if the file has the needed form.
fn needed(problem: &Problem, kind: &FileKind) -> Option<&'static str> {
    let form = kind.form();
    match problem {
        Problem::IsFolder if form == Form::Folder => Some("a file"),
        Problem::Toml(why) if form != Form::Toml => Some(of_toml(why)),
        // A key of one kind of TOML is unknown in the others.
        Problem::Toml(why) => unknown_field(why).filter(|key| kind.has_key(key)).map(|_| of_toml(why)),
        Problem::NoResult(_) if form != Form::Json => Some("a result of `trueline calibrate --json`"),
        Problem::NotUtf8 if form == Form::Binary => Some("a text file"),
        Problem::UnknownColumn { .. } | Problem::MissingColumn { .. } | Problem::NoHeader
            if form != Form::Table =>
        {
            Some("a table")
        }
        _ => None,
    }
}

/// Which of the TOML files was read, by the fields that it may have.
fn of_toml(why: &str) -> &'static str {
    match unknown_field(why).and_then(|_| why.split_once("expected one of")) {
        Some((_, fields)) if fields.contains("`guess_error`") => "a cell (`trueline plan --example`)",
        Some((_, fields)) if fields.contains("`tool_from_camera`") => "a result or a guess",
        Some((_, fields)) if fields.contains("`laser_plane`") => "a sensor.toml",
        _ => "a JSON result or a TOML file",
    }
}

fn unknown_field(why: &str) -> Option<&str> {
    why.split_once("unknown field `")?.1.split_once('`').map(|(key, _)| key)
}

/// Advice about the existing file.
fn hint(file: &Path, kind: &FileKind) -> String {
    let shown = file.display();
    match kind {
        FileKind::Dataset => {
            format!(
                "`trueline calibrate {shown} --json result.json` writes a result; or name a file of the folder"
            )
        }
        FileKind::Folder => "name a file in it".to_owned(),
        FileKind::Result => {
            "a result goes with --calibration, --initial, `export`, `apply`, `diff` and `watch`".to_owned()
        }
        FileKind::Sensor => "sensor.toml belongs into a dataset's folder, or with --sensor".to_owned(),
        FileKind::Guess => {
            "a guess goes with --initial, or into a dataset's folder as initial.toml".to_owned()
        }
        FileKind::Cell => "a cell goes with `trueline plan`".to_owned(),
        FileKind::Table(_) => {
            "tables of a scan are read by their folder; `trueline import csv` takes those of other programs"
                .to_owned()
        }
        FileKind::Database => {
            "a state of `watch` goes with --state; a rosbag2 with `trueline calibrate` or `import`".to_owned()
        }
        FileKind::Mcap => "`trueline calibrate` and `trueline import` read recordings".to_owned(),
        FileKind::Json | FileKind::Picture | FileKind::Parquet => "is it the file that you meant?".to_owned(),
    }
}
