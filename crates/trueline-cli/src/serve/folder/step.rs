//! A step of the first scan: the task, its command line, and whether it was done.

use crate::serve::html::{card, escape};
use std::path::Path;

/// Whether a step was done, as its files say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    /// Its files are there.
    Done,
    /// It is the next one.
    Next,
    /// A later step was done without it.
    Skipped,
    /// Others come before.
    Later,
}

/// A step.
#[derive(Clone, Debug)]
pub(super) struct Step {
    /// Its heading.
    pub heading: &'static str,
    /// Advice in plain text.
    pub words: String,
    /// Command lines, each with its purpose.
    pub commands: Vec<(String, String)>,
    /// Its finding; markup.
    pub finding: String,
    /// Whether its files are there.
    pub is_done: bool,
}

impl Step {
    /// The card of a step.
    pub(super) fn card(&self, number: usize, progress: Progress) -> String {
        let (class, word) = match progress {
            Progress::Done => ("good", "done"),
            Progress::Next => ("mind", "next"),
            Progress::Skipped => ("", "skipped"),
            Progress::Later => ("", "later"),
        };
        let commands: String = self
            .commands
            .iter()
            .map(|(what, line)| format!("<p class=\"soft\">{}</p><pre>{}</pre>", escape(what), escape(line)))
            .collect();
        let inside = format!(
            "<p class=\"state {class}\">{word}</p><p>{}</p>{commands}{}",
            escape(&self.words),
            self.finding
        );
        card(&format!("{number}. {}", self.heading), "", &inside)
    }
}

/// A path as one word of a shell.
pub(super) fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+:,@%".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        return text;
    }
    format!("'{}'", text.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_one_word() {
        assert_eq!(quoted(Path::new("/cells/a-1_2")), "/cells/a-1_2");
        assert_eq!(
            quoted(Path::new("/my cells/o'hara; rm -rf $HOME")),
            "'/my cells/o'\\''hara; rm -rf $HOME'"
        );
    }
}
