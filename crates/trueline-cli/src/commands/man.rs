//! `trueline man`.

use crate::args::ManArgs;
use crate::failure::Failure;
use crate::output;
use clap_mangen::Man;
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::WholeFolder;

/// Runs the command.
pub(crate) fn run(args: &ManArgs) -> Result<ExitCode, Failure> {
    let whole = WholeFolder::begin_new(&args.out)?;
    let command = crate::args::command();
    let count = write(&command, "trueline", whole.path())?;
    #[cfg(feature = "live")]
    let count = count + write(&crate::args::testbench(), "trueline-testbench", whole.path())?;
    whole.finish()?;
    output::note(&format!("{}: {count} pages; read one with `man ./{}`", args.out.display(), "trueline.1"));
    Ok(ExitCode::SUCCESS)
}

/// A page for a command and for each below it; how many that are.
fn write(command: &clap::Command, name: &str, folder: &Path) -> Result<usize, Failure> {
    let file = folder.join(format!("{name}.1"));
    let mut page = Vec::new();
    let manual = Man::new(command.clone());
    manual.render(&mut page).map_err(|error| Failure::cannot_write(&file, &error))?;
    output::file(&file, &page)?;
    let is_shown = |below: &&clap::Command| below.get_name() != "help" && !below.is_hide_set();
    let below = command.get_subcommands().filter(is_shown);
    below
        .map(|below| write(below, &format!("{name}-{}", below.get_name()), folder))
        .sum::<Result<usize, _>>()
        .map(|n| n + 1)
}
