//! Some lines on a terminal that say how a scan is doing.

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use trueline_cell::CellState;

/// Lines of the robot, the camera and the estimate, and one for losses.
const LINES: usize = 4;

/// The lines; empty without a terminal.
pub(crate) struct LiveScreen {
    lines: Option<(MultiProgress, [ProgressBar; LINES])>,
}

impl LiveScreen {
    /// Empty lines on stderr.
    pub(crate) fn new(quiet: bool) -> Self {
        if quiet || !std::io::stderr().is_terminal() {
            return Self { lines: None };
        }
        let screen = MultiProgress::new();
        let style =
            ProgressStyle::with_template("{wide_msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
        let lines = [(); LINES].map(|()| screen.add(ProgressBar::new_spinner().with_style(style.clone())));
        Self { lines: Some((screen, lines)) }
    }

    /// Shows how things are.
    pub(crate) fn show(&self, robot: &str, state: &CellState) {
        let Some((_, lines)) = &self.lines else { return };
        lines[0].set_message(format!("robot     {robot}"));
        let camera = state.camera.as_ref().map(|counts| format!("camera    {counts}"));
        lines[1].set_message(camera.unwrap_or_default());
        let Some(progress) = &state.estimate else { return };
        lines[2].set_message(format!("estimate  {progress}"));
        let advice = progress.advice();
        let missing = advice.first().map(|first| match advice.len() {
            1 => format!("not yet   {first}"),
            count => format!("not yet   {first} (and {} more)", count - 1),
        });
        lines[3].set_message(missing.unwrap_or_default());
    }
}

impl Drop for LiveScreen {
    fn drop(&mut self) {
        if let Some((screen, lines)) = &self.lines {
            for line in lines {
                line.finish_and_clear();
            }
            let _gone = screen.clear();
        }
    }
}
