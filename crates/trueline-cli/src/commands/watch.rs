//! `trueline watch`.

use crate::args::WatchArgs;
use crate::failure::Failure;
use crate::foxglove_view::FoxgloveView;
use crate::live_page::WatchPage;
use crate::live_watch::{tell_who_was_not_told, told, warn_of_calibration};
use crate::service::Service;
use crate::{interrupt, opening, output};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;
use trueline_dataset::json_lines;
use trueline_watch::{Repair, Store, Watcher, WatcherSettings, WeldFolder};

/// Interval between checks of a folder.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// Runs the command.
pub(crate) fn run(args: &WatchArgs) -> Result<ExitCode, Failure> {
    let Some(calibration) = &args.calibration else { return serve_only(args) };
    if args.folder.is_none() && args.welds.is_empty() && args.serve.serve.is_none() && args.repaired.is_none()
    {
        return Err(Failure::new(
            "there is no weld to watch",
            "name welds, or a folder in which they appear: --folder FOLDER",
        ));
    }
    let inputs: Vec<&Path> =
        args.welds.iter().chain([&args.state, calibration]).map(PathBuf::as_path).collect();
    output::expect_files(&inputs, &[args.json.as_deref()])?;
    args.json.as_deref().map_or(Ok(()), json_lines::expect)?;
    inputs_are_there(args)?;
    let watcher = Watcher::of(&WatcherSettings {
        state: &args.state,
        calibration,
        tell: &args.tell,
        keep: args.keep_days,
        tolerance_m: args.tolerance,
    })?;
    warn_of_calibration(&watcher, calibration);
    let _page = WatchPage::of(&args.serve, states(args))?;
    let view = FoxgloveView::of(&args.foxglove, "trueline watch")?;
    let mut session = Welds { args, watcher, view, failed: 0, repaired_before: None };
    session.repaired()?;
    match &args.folder {
        Some(folder) => session.fills(folder)?,
        None => {
            args.welds.iter().try_for_each(|weld| session.one(weld))?;
            if args.serve.serve.is_some() {
                until_interrupted()?;
            }
        }
    }
    session.finish()
}

/// Checks the inputs of `watch` before anything is written.
fn inputs_are_there(args: &WatchArgs) -> Result<(), Failure> {
    if let Some(folder) = &args.folder {
        std::fs::read_dir(folder).map_err(|error| unreadable(folder, &error))?;
    }
    let doubtful = args.welds.iter().find(|weld| !weld.exists()).or(args.welds.first());
    doubtful.map_or(Ok(()), |weld| opening::open(weld, None, true).map(|_| ()))
}

fn unreadable(folder: &Path, error: &std::io::Error) -> Failure {
    let message = format!("{}: cannot be read: {error}", folder.display());
    Failure::new(message, "name the folder in which welds appear")
}

/// Shows the states of other programs.
fn serve_only(args: &WatchArgs) -> Result<ExitCode, Failure> {
    if args.folder.is_some() || !args.welds.is_empty() {
        return Err(Failure::new(
            "a calibration is needed to compare the welds with",
            "--calibration RESULT, the JSON of `trueline calibrate --json`",
        ));
    }
    // A state that is not there yet is made, so that the page has something to show.
    drop(Store::open(&args.state)?);
    let _page = WatchPage::of(&args.serve, states(args))?;
    until_interrupted()?;
    Ok(ExitCode::SUCCESS)
}

fn states(args: &WatchArgs) -> Vec<PathBuf> {
    std::iter::once(&args.state).chain(&args.also).cloned().collect()
}

fn until_interrupted() -> Result<(), Failure> {
    interrupt::watch()?;
    let mut service = Service::ready("serves a page");
    while interrupt::times() == 0 {
        service.alive();
        std::thread::sleep(LOOK_EVERY);
    }
    Ok(())
}

/// Welds, named or as they appear.
struct Welds<'a> {
    args: &'a WatchArgs,
    watcher: Watcher,
    view: FoxgloveView,
    failed: usize,
    /// A weld that is still to come, and follows a repair.
    repaired_before: Option<PathBuf>,
}

impl Welds<'_> {
    /// Takes note of a repair: before a weld that has been watched, or one that is still to come.
    fn repaired(&mut self) -> Result<(), Failure> {
        let Some(weld) = &self.args.repaired else { return Ok(()) };
        let path = PathBuf::from(weld);
        if weld.is_empty() {
            self.note_repair(None)
        } else if self.watcher.knows(weld)? || !path.exists() {
            self.note_repair(Some(weld))
        } else if self.args.welds.contains(&path) {
            self.repaired_before = Some(path);
            Ok(())
        } else {
            self.note_repair(None)?;
            self.one(&path)
        }
    }

    fn note_repair(&mut self, before: Option<&str>) -> Result<(), Failure> {
        let words = match self.watcher.repaired(before)? {
            Repair::Before(weld) => {
                format!("Noted: the fault was repaired before weld {weld}. The next welds will verify it.")
            }
            Repair::NothingStands => "No change is active: there is nothing to repair.".to_owned(),
        };
        if !self.args.quiet {
            output::words(&words);
        }
        Ok(())
    }

    fn fills(&mut self, folder: &Path) -> Result<(), Failure> {
        let mut welds = WeldFolder::of(folder);
        interrupt::watch()?;
        let mut service = Service::ready(&format!("watches welds in {}", folder.display()));
        loop {
            service.alive();
            let found = welds.look().map_err(|error| unreadable(folder, &error))?;
            for weld in found.finished {
                // Of many welds one that cannot be read must not end the watch.
                if let Err(failure) = self.one(&weld) {
                    match failure {
                        Failure::BrokenPipe => return Err(Failure::BrokenPipe),
                        failure => output::words(&failure.to_string()),
                    }
                    self.failed += 1;
                }
                service.alive();
            }
            let is_done = self.args.once && found.unfinished == 0;
            if is_done && welds.is_empty() {
                output::words(&format!("{}: there is no weld in it", folder.display()));
            }
            if is_done || interrupt::times() > 0 {
                return Ok(());
            }
            std::thread::sleep(LOOK_EVERY);
        }
    }

    fn one(&mut self, weld: &Path) -> Result<(), Failure> {
        let recording = opening::open(weld, None, true)?.recording;
        if self.repaired_before.take_if(|path| path == weld).is_some() {
            self.note_repair(None)?;
        }
        let line =
            told(&mut self.watcher, &weld.display().to_string(), recording, self.args.quiet, &self.view)?;
        match &self.args.json {
            Some(path) if path == Path::new("-") => output::json(path, &line)?,
            Some(path) => json_lines::append(path, &line)?,
            None => {}
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<ExitCode, Failure> {
        tell_who_was_not_told(&mut self.watcher)?;
        if self.failed > 0 {
            return Err(Failure::new(
                format!("{} welds could not be watched", self.failed),
                "the reasons are listed above; all other welds have been watched",
            ));
        }
        Ok(ExitCode::from(u8::from(self.watcher.is_alarm)))
    }
}
