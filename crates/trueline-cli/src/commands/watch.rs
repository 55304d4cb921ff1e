//! `trueline watch`.

use crate::failure::Failure;
use crate::interrupt;
use crate::{opening, output};
use sha2::{Digest, Sha256};
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;
use trueline_args::WatchArgs;
use trueline_dataset::calibration_file::{self, KnownCalibration};
use trueline_dataset::result_file::ResultFile;
use trueline_watch::{Store, WatchError, Watched, WeldFolder, watch, weld_text};

/// How often a folder is looked at.
const LOOK_EVERY: Duration = Duration::from_millis(500);

impl From<WatchError> for Failure {
    fn from(error: WatchError) -> Self {
        Self::new(error.to_string(), error.hint())
    }
}

impl From<trueline_watch::store::StoreError> for Failure {
    fn from(error: trueline_watch::store::StoreError) -> Self {
        Self::new(error.to_string(), error.hint())
    }
}

/// Runs the command.
pub fn run(args: &WatchArgs) -> Result<ExitCode, Failure> {
    let Some(folder) = &args.folder else {
        if args.welds.is_empty() {
            return Err(Failure::new(
                "there is no weld to watch",
                "name welds, or a folder that fills: --folder FOLDER",
            ));
        }
        let mut cell = Watcher::of(args)?;
        args.welds.iter().try_for_each(|weld| cell.one(weld))?;
        return cell.finish();
    };
    let mut cell = Watcher::of(args)?;
    let mut welds = WeldFolder::of(folder);
    interrupt::watch()?;
    loop {
        let finished = welds.next_ones().map_err(|error| {
            let message = format!("{}: cannot be read: {error}", folder.display());
            Failure::new(message, "name the folder in which welds appear")
        })?;
        for weld in finished {
            // Of many welds one that cannot be read must not end the watch.
            if let Err(failure) = cell.one(&weld) {
                match failure {
                    Failure::BrokenPipe => return Err(Failure::BrokenPipe),
                    failure => output::words(&failure.to_string()),
                }
                cell.failed += 1;
            }
        }
        if args.once || interrupt::times() > 0 {
            return cell.finish();
        }
        std::thread::sleep(LOOK_EVERY);
    }
}

struct Watcher<'a> {
    args: &'a WatchArgs,
    store: Store,
    known: KnownCalibration,
    calibration: Watched,
    alarms: usize,
    failed: usize,
    lines: String,
}

impl<'a> Watcher<'a> {
    fn of(args: &'a WatchArgs) -> Result<Self, Failure> {
        let (known, calibration) = calibration(&args.calibration)?;
        let store = Store::open(&args.state)?;
        Ok(Self { args, store, known, calibration, alarms: 0, failed: 0, lines: String::new() })
    }

    fn one(&mut self, weld: &Path) -> Result<(), Failure> {
        let recording = self.known.corrected(opening::open(weld, None, true)?.recording);
        let name = weld.display().to_string();
        let line = watch(&self.store, &self.calibration, &name, &recording).map_err(|error| {
            let hint = error.hint();
            Failure::new(format!("{name}: {error}"), hint)
        })?;
        self.alarms += usize::from(line.is_alarm());
        match &self.args.json {
            Some(path) if path == Path::new("-") => output::data(&line.to_json().to_string())?,
            Some(path) => {
                self.lines += &format!("{}\n", line.to_json());
                output::file(path, &self.lines)?;
            }
            None => {}
        }
        if !self.args.quiet {
            output::words(&weld_text::of(&line));
        }
        Ok(())
    }

    fn finish(&self) -> Result<ExitCode, Failure> {
        if self.failed > 0 {
            return Err(Failure::new(
                format!("{} welds could not be watched", self.failed),
                "the reasons stand above; all other welds have been watched",
            ));
        }
        Ok(ExitCode::from(u8::from(self.alarms > 0)))
    }
}

/// The calibration with all that its file tells.
fn calibration(file: &Path) -> Result<(KnownCalibration, Watched), Failure> {
    let known = calibration_file::read(file)?;
    let is_json = file.extension().is_some_and(|end| end.eq_ignore_ascii_case("json"));
    let result = is_json.then(|| ResultFile::read(file)).transpose()?;
    if known.accepted == Some(false) {
        output::words(&format!(
            "mind: {} was not accepted when it was made; what is watched is change against it",
            file.display()
        ));
    }
    let bytes = fs::read(file).map_err(|error| {
        Failure::new(
            format!("{}: cannot be read: {error}", file.display()),
            "check the path and its permissions",
        )
    })?;
    let sha256 = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    let watched = Watched { name: file.display().to_string(), sha256, guess: known.known.parameters, result };
    Ok((known, watched))
}
