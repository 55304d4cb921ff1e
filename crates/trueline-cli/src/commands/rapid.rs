//! `trueline rapid`.

use crate::args::{Mode, RapidArgs};
use crate::failure::Failure;
use crate::{output, path_file};
use std::process::ExitCode;
use trueline_dataset::outputs;
use trueline_live::pose_feed::at_pace;
use trueline_live::rapid::{guidance_module, stream_module};

/// Runs the command.
pub(crate) fn run(args: &RapidArgs) -> Result<ExitCode, Failure> {
    outputs::must_be_new(&args.out)?;
    if args.pc.ip().is_unspecified() || args.pc.port() == 0 {
        return Err(Failure::new(
            format!("--pc {}: a controller cannot send there", args.pc),
            "the address of this PC on the robot's network, and the port that `trueline record` or `scan` binds to",
        ));
    }
    let path = at_pace(path_file::read(&args.path)?, args.pace);
    let cell = args.cell();
    let module = match args.mode {
        Mode::Stream => stream_module(&cell, &path),
        Mode::Guidance => guidance_module(&cell, &path),
    };
    let module = module.map_err(|error| {
        Failure::new(error.to_string(), "names as in RAPID; the path from `trueline plan` or a robot.csv")
    })?;
    // RAPID files of controllers have DOS line ends.
    output::file(&args.out, &module.replace('\n', "\r\n"))?;
    let then = match args.mode {
        Mode::Stream => "start `trueline record`, then run it",
        Mode::Guidance => "start `trueline scan --enable-motion`, then run it",
    };
    output::note(&format!(
        "{}: written. No real controller has tried such a module here: check it in RobotStudio, run it in manual\n\
         reduced speed first. Load it into the task {}, {then}.",
        args.out.display(),
        args.task
    ));
    Ok(ExitCode::SUCCESS)
}
