//! Why a command could not run, and the remedy.

use crate::args::left_out;
use crate::wrong_file;
use clap::error::ContextKind;
use std::error::Error as _;
use std::fmt;
use std::path::Path;

/// An error as the user reads it: the message, and a hint on a line of its own.
pub(crate) enum Failure {
    /// Something cannot be used.
    Said {
        /// The fault.
        message: String,
        /// The remedy.
        hint: String,
    },
    /// The reader of our output is gone.
    BrokenPipe,
}

impl Failure {
    /// A failure with a hint.
    pub(crate) fn new(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Said { message: message.into(), hint: hint.into() }
    }

    /// A file that cannot be written.
    pub(crate) fn cannot_write(file: &Path, error: &std::io::Error) -> Self {
        let hint = match error.kind() {
            std::io::ErrorKind::StorageFull => "the disk is full: free some space, or write to another one",
            _ => "check the path and its permissions",
        };
        Self::new(format!("{}: cannot be written: {error}", file.display()), hint)
    }
}

impl Failure {
    /// A command that this build leaves out.
    pub(crate) fn of_left_out(command: &str) -> Option<Self> {
        let feature = left_out::feature_of(command)?;
        let message = format!(
            "`trueline {command}` is not in this program: it was built without the feature `{feature}`"
        );
        Some(Self::new(message, left_out::how_to_have(feature)))
    }

    /// An option with a wrong value; its reader states the right form.
    pub(crate) fn of_value(told: &clap::Error, program: &str, command: Option<&str>) -> Self {
        let option = told.get(ContextKind::InvalidArg).map(ToString::to_string).unwrap_or_default();
        let option = option.split(' ').next().unwrap_or_default();
        let why = told.source().map_or_else(|| told.to_string(), ToString::to_string);
        let help = command.map_or_else(String::new, |command| format!(" {command}"));
        Self::new(format!("`{option}`: {why}"), format!("`{program}{help} --help` explains it"))
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Said { message, hint } => write!(f, "error: {message}\n\nhint: {hint}"),
            Self::BrokenPipe => write!(f, "error: broken pipe"),
        }
    }
}

impl From<trueline_dataset::Error> for Failure {
    fn from(error: trueline_dataset::Error) -> Self {
        match wrong_file::failure(&error) {
            Some((message, hint)) => Self::new(message, hint),
            None => Self::new(error.to_string(), error.hint()),
        }
    }
}

impl From<trueline_method::Error> for Failure {
    fn from(error: trueline_method::Error) -> Self {
        Self::new(error.to_string(), crate::args::hints::for_error(&error))
    }
}

impl From<trueline_plan::PlanError> for Failure {
    fn from(error: trueline_plan::PlanError) -> Self {
        Self::new(error.to_string(), error.hint())
    }
}
