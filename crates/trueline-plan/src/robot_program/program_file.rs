//! A file for a robot's controller.

use super::language::Language;
use super::waypoints::Waypoints;

/// A file, and its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProgramFile {
    /// Its name, which other files of the same program may refer to.
    pub name: String,
    /// Folder on the controller, or how it gets there.
    pub goes_to: &'static str,
    /// Its content, with the line ends that the controller writes itself.
    pub text: String,
}

impl ProgramFile {
    /// The path in a language.
    #[must_use]
    pub fn of(language: Language, path: &Waypoints) -> Self {
        let (text, goes_to) = (language.program(path), language.goes_to());
        match language {
            Language::Rapid | Language::Krl | Language::Ls => {
                Self::with_dos_lines(language.file_name(), goes_to, &text)
            }
            Language::UrScript | Language::Csv => {
                Self { name: language.file_name().to_owned(), goes_to, text }
            }
        }
    }

    /// Controllers of ABB, KUKA and FANUC write DOS line ends.
    pub(crate) fn with_dos_lines(name: impl Into<String>, goes_to: &'static str, text: &str) -> Self {
        Self { name: name.into(), goes_to, text: text.replace('\n', "\r\n") }
    }
}
