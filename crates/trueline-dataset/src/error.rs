//! Faults of a recording, their places and their remedies.

pub use crate::problem::Problem;
use std::fmt;
use std::path::{Path, PathBuf};

/// A file that cannot be used: where, and why.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", Location { file, line: *line, column: column.as_deref() })]
pub struct Error {
    /// The file.
    pub file: PathBuf,
    /// Line, from 1, where the problem has one.
    pub line: Option<u64>,
    /// Column by name, where the problem has one.
    pub column: Option<String>,
    /// The fault.
    pub problem: Problem,
}

impl Error {
    /// A problem of a file as a whole.
    #[must_use]
    pub fn in_file(file: &Path, problem: Problem) -> Self {
        Self { file: file.to_owned(), line: None, column: None, problem }
    }

    /// A problem at a line of a file.
    #[must_use]
    pub(crate) fn at_line(file: &Path, line: u64, problem: Problem) -> Self {
        Self { file: file.to_owned(), line: Some(line), column: None, problem }
    }

    /// A file of another program that cannot be read as its kind.
    #[must_use]
    pub fn unreadable(file: &Path, what: impl Into<String>, hint: &'static str) -> Self {
        Self::in_file(file, Problem::Unreadable { what: what.into(), hint })
    }

    /// The same, in a named column.
    #[must_use]
    pub(crate) fn in_column(mut self, column: &str) -> Self {
        self.column = Some(column.to_owned());
        self
    }

    /// Remedy for the user.
    #[must_use]
    pub fn hint(&self) -> String {
        self.problem.hint()
    }
}

struct Location<'a> {
    file: &'a Path,
    line: Option<u64>,
    column: Option<&'a str>,
}

impl fmt::Display for Location<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, ", line {line}")?;
        }
        if let Some(column) = self.column {
            write!(f, ", column `{column}`")?;
        }
        Ok(())
    }
}
