//! `trueline reproduce`.

use crate::args::ReproduceArgs;
use crate::failure::Failure;
use crate::{output, progress};
use std::process::ExitCode;
use trueline_dataset::WholeFolder;
use trueline_experiments::{Settings, reproduce};
use trueline_report::{reproduction_page, reproduction_tables};

/// Experiments, for the progress bar.
const PARTS: u64 = 4;

/// Runs the command.
pub(crate) fn run(args: &ReproduceArgs) -> Result<ExitCode, Failure> {
    let whole = WholeFolder::begin_new(&args.out)?;
    let settings = Settings { seed: args.seed, repeats: args.repeats, ..Settings::default() };
    let bar = progress::bar(PARTS, "experiments", args.quiet);
    let all = reproduce(&settings, |_| bar.inc(1));
    bar.finish_and_clear();
    let all = all?;
    let markdown = reproduction_tables::markdown(&all);
    let file = |name: &str, text: &str| output::file(&whole.path().join(name), text);
    file("tables.md", &markdown)?;
    file("report.html", &reproduction_page::html(&all, &output::command_line()))?;
    file("convergence.csv", &reproduction_tables::convergence_csv(&all.convergence))?;
    file("welds.csv", &reproduction_tables::welds_csv(&all.welds))?;
    file("speeds.csv", &reproduction_tables::speeds_csv(&all))?;
    for weld in &all.welds {
        let name = weld.kind.name().to_lowercase().replace([' ', '-'], "_");
        file(&format!("{name}_points.csv"), &reproduction_tables::points_csv(weld))?;
    }
    whole.finish()?;
    if !args.quiet {
        output::data(&markdown)?;
        output::words(&format!("written to {}", args.out.display()));
    }
    Ok(ExitCode::SUCCESS)
}
