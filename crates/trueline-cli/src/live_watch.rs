//! Reports on welds as they are watched; watches those of a recording as they end.

use crate::args::RecordArgs;
use crate::failure::Failure;
use crate::foxglove_view::FoxgloveView;
use crate::live_cell::LiveCell;
use crate::output;
use crate::wrong_file;
use std::path::Path;
use std::sync::Arc;
use trueline_cell::LiveWelds;
use trueline_dataset::Recording;
use trueline_watch::{Watcher, WatcherError, WatcherSettings, weld_text};

impl From<WatcherError> for Failure {
    fn from(error: WatcherError) -> Self {
        let of_another_kind = match &error {
            WatcherError::Calibration(error) => wrong_file::failure(error),
            WatcherError::Store(error) => wrong_file::of_state(error),
            _ => None,
        };
        let (message, hint) = of_another_kind.unwrap_or_else(|| (error.to_string(), error.hint()));
        Self::new(message, hint)
    }
}

impl From<trueline_watch::store::StoreError> for Failure {
    fn from(error: trueline_watch::store::StoreError) -> Self {
        let of_another_kind = wrong_file::of_state(&error);
        let (message, hint) = of_another_kind.unwrap_or_else(|| (error.to_string(), error.hint().to_owned()));
        Self::new(message, hint)
    }
}

/// Warns if the calibration was not accepted.
pub(crate) fn warn_of_calibration(watcher: &Watcher, file: &Path) {
    if watcher.was_accepted() == Some(false) {
        output::words(&format!(
            "note: {} was not accepted; welds are watched for changes against it",
            file.display()
        ));
    }
}

/// Watches a weld and reports on it; returns its line of JSON.
pub(crate) fn told(
    watcher: &mut Watcher,
    name: &str,
    recording: Recording,
    quiet: bool,
    view: &FoxgloveView,
) -> Result<String, Failure> {
    if watcher.meets_another_sensor(&recording) {
        output::words(&format!("warning: {}", weld_text::OTHER_SENSOR));
    }
    let line = watcher.one(name, recording)?;
    view.weld(&line);
    if !quiet {
        output::words(&weld_text::of(&line));
    }
    Ok(line.to_json().to_string())
}

/// Reports the receivers that could not be reached.
pub(crate) fn tell_who_was_not_told(watcher: &mut Watcher) -> Result<(), Failure> {
    for receiver in watcher.finish()? {
        output::words(&weld_text::not_told(&receiver));
    }
    Ok(())
}

/// A watcher of the present recording.
pub(crate) struct LiveWatch<'a> {
    welds: Arc<LiveWelds>,
    watcher: Watcher,
    args: &'a RecordArgs,
    view: &'a FoxgloveView,
    number: usize,
    failed: usize,
}

impl<'a> LiveWatch<'a> {
    /// Divides a cell's recording into welds, if requested.
    pub(crate) fn of(
        args: &'a RecordArgs,
        cell: &mut LiveCell,
        view: &'a FoxgloveView,
    ) -> Result<Option<Self>, Failure> {
        let (Some(state), Some(calibration)) = (&args.watch, &args.calibration) else { return Ok(None) };
        let Some(welds) = cell.cut_into_welds(args.weld_pause_s) else {
            return Err(Failure::new(
                "--watch needs a camera and its sensor.toml",
                "--camera IP or --replay DATASET, and --sensor FILE",
            ));
        };
        let watcher = Watcher::of(&WatcherSettings {
            state,
            calibration,
            tell: &args.tell,
            keep: None,
            tolerance_m: None,
        })?;
        warn_of_calibration(&watcher, calibration);
        Ok(Some(Self { welds, watcher, args, view, number: 0, failed: 0 }))
    }

    /// Watches the welds that have ended; `is_over`: nothing more will come. One that cannot be watched ends nothing.
    pub(crate) fn look(&mut self, is_over: bool) {
        for recording in self.welds.take_ended(is_over) {
            let name = format!("{}#{}", self.args.out.display(), self.number);
            self.number += 1;
            if let Err(failure) = told(&mut self.watcher, &name, recording, self.args.quiet, self.view) {
                output::words(&failure.to_string());
                self.failed += 1;
            }
        }
    }

    /// The last look; whether nothing failed and no alarm stands.
    pub(crate) fn finish(mut self) -> Result<bool, Failure> {
        self.look(true);
        tell_who_was_not_told(&mut self.watcher)?;
        Ok(self.failed == 0 && !self.watcher.is_alarm)
    }
}
