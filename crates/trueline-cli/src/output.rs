//! Destinations of words and data.

use crate::failure::Failure;
use crate::{logging, stderr};
use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use trueline_dataset::Recording;
use trueline_dataset::calibration_file::KnownCalibration;
use trueline_dataset::result_file::ResultFile;
use trueline_dataset::{outputs, whole_file};
use trueline_method::input::stops::stand_at_readings;
use trueline_report::terminal_text::json_shown;
use trueline_report::verdict_colours::coloured;
use trueline_report::wrapped::wrapped_to;

/// Words for a person: stderr, and the log.
pub(crate) fn words(text: &str) {
    logging::told(text.trim_end());
    stderr::words(text);
}

/// The same, unless all is to be quiet.
pub(crate) fn note(text: &str) {
    if !logging::is_quiet() {
        words(text);
    }
}

/// Data for the next program: stdout.
pub(crate) fn data(text: &str) -> Result<(), Failure> {
    // Colours go to terminals that want them, and to nothing else.
    let mut out = anstream::stdout().lock();
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Err(Failure::BrokenPipe),
        Err(error) => Err(Failure::new(format!("stdout cannot be written: {error}"), "is the disk full?")),
    }
}

/// Colours on a terminal that shows them, always or never.
pub(crate) fn use_colours(when: clap::ColorChoice) {
    let choice = match when {
        clap::ColorChoice::Auto => anstream::ColorChoice::Auto,
        clap::ColorChoice::Always => anstream::ColorChoice::Always,
        clap::ColorChoice::Never => anstream::ColorChoice::Never,
    };
    choice.write_global();
}

/// A line on a terminal that the next one overwrites.
#[cfg(feature = "live")]
pub(crate) fn status(text: &str) {
    let mut out = std::io::stderr().lock();
    let _ =
        write!(out, "\r\x1b[2K{}", trueline_report::terminal_text::shown(text)).and_then(|()| out.flush());
}

/// JSON into the file that a user named; - is stdout.
pub(crate) fn json(path: &Path, text: &str) -> Result<(), Failure> {
    if path == Path::new("-") { data(&json_shown(text)) } else { file(path, text) }
}

/// A calibration's result as JSON into the file that a user named.
pub(crate) fn result(path: &Path, result: &ResultFile) -> Result<(), Failure> {
    let text = result.to_json().map_err(|error| {
        Failure::new(format!("the result cannot be written as JSON: {error}"), "this is a bug of trueline")
    })?;
    json(path, &text)
}

/// A summary for a person: on stdout, unless JSON goes there.
pub(crate) fn summary(json: Option<&Path>, text: &str) -> Result<(), Failure> {
    let text = wrapped_to(text, stderr::columns().unwrap_or(usize::MAX));
    if json == Some(Path::new("-")) {
        words(&text);
        return Ok(());
    }
    data(&coloured(&text))
}

/// A file that a user named as output. It appears whole or not at all: the old one stays until then.
pub(crate) fn file(path: &Path, content: &(impl AsRef<[u8]> + ?Sized)) -> Result<(), Failure> {
    let content = content.as_ref();
    whole_file::write(path, content).map_err(|error| Failure::cannot_write(path, &error))?;
    tracing::info!(file = %path.display(), bytes = content.len(), "written");
    Ok(())
}

/// A folder of that name exists; reports the place of the former one, if it is kept.
pub(crate) fn former_folder(folder: &Path, former: Option<PathBuf>) {
    if let Some(former) = former {
        words(&format!(
            "{}: the previous content is kept in {}; remove it if it is not needed",
            folder.display(),
            former.display()
        ));
    }
}

/// Refuses files that cannot be written, or that are read, before the work is done for them; - is stdout.
pub(crate) fn expect_files(inputs: &[&Path], files: &[Option<&Path>]) -> Result<(), Failure> {
    Ok(outputs::check(inputs, &files.iter().flatten().copied().collect::<Vec<_>>())?)
}

/// The same of a file that must not be there yet, beside others.
pub(crate) fn expect_new(new: Option<&Path>, others: &[Option<&Path>]) -> Result<(), Failure> {
    new.map_or(Ok(()), outputs::must_be_new)?;
    expect_files(&[], &[&[new], others].concat())
}

static COMMAND_LINE: OnceLock<String> = OnceLock::new();

/// Remembers the command line, its first word being the program's own name, for reports to show.
pub(crate) fn remember_command_line(words: &[OsString]) {
    let quoted = |word: String| if word.contains([' ', '"', '\'']) { format!("{word:?}") } else { word };
    let words = words.iter().skip(1).map(|word| quoted(word.to_string_lossy().into_owned()));
    let line = std::iter::once("trueline".to_owned()).chain(words).collect::<Vec<_>>().join(" ");
    // A process runs one command.
    let _ = COMMAND_LINE.set(line);
}

/// The command that is running, as a person types it.
pub(crate) fn command_line() -> String {
    COMMAND_LINE.get().cloned().unwrap_or_default()
}

/// Reports, even with --quiet, that a calibration was not accepted; returns whether it may be trusted.
pub(crate) fn is_trusted(file: &Path, calibration: &KnownCalibration) -> bool {
    let is_trusted = calibration.accepted != Some(false);
    if !is_trusted {
        words(&format!("warning: {} was not accepted; its reasons are in it", file.display()));
    }
    is_trusted
}

/// The same for a recording; a calibration of a sensor with another carrier is refused.
pub(crate) fn fits(file: &Path, known: &KnownCalibration, on: &Recording) -> Result<bool, Failure> {
    known.check_recording(file, on)?;
    if known.at_stops && !on.at_stops && !stand_at_readings(on) {
        return Err(Failure::new(
            format!(
                "{}: was made at stops and has no time offset, but the robot moves in this recording",
                file.display()
            ),
            "calibrate a scan of the moving robot: that gives the time offset",
        ));
    }
    if let Some(file) = known.belongs_to_another_file(on) {
        words(&format!(
            "warning: sensor.toml is not the file that the calibration belongs to ({}); use that file, or calibrate again with this one",
            file.name
        ));
    }
    Ok(is_trusted(file, known))
}
