//! `trueline robot-program`.

use crate::args::RobotProgramArgs;
use crate::failure::Failure;
use crate::{output, path_file};
use std::process::ExitCode;
use trueline_dataset::WholeFolder;
use trueline_plan::robot_program::Waypoints;
use trueline_plan::robot_program::waypoints::at_pace;

/// Runs the command.
pub(crate) fn run(args: &RobotProgramArgs) -> Result<ExitCode, Failure> {
    let path = at_pace(path_file::read(&args.path)?, args.pace);
    let waypoints = Waypoints::of(&path).ok_or_else(|| {
        let told = format!("{}: no path for a robot's program", path_file::file(&args.path).display());
        Failure::new(told, "it lasts a quarter of a second or longer, its times rise, and it moves")
    })?;
    let files = args.files(&path, &waypoints).map_err(|[told, hint]| Failure::new(told, hint))?;
    let whole = WholeFolder::begin_new(&args.out)?;
    for file in &files {
        output::file(&whole.path().join(&file.name), &file.text)?;
    }
    whole.finish()?;
    for file in &files {
        output::note(&format!("{}: for {}", args.out.join(&file.name).display(), file.goes_to));
    }
    if let Some(next) = args.next() {
        output::note(next);
    }
    output::note(
        "No real controller has run these: check them in the maker's simulation, run them at reduced speed first.",
    );
    Ok(ExitCode::SUCCESS)
}
