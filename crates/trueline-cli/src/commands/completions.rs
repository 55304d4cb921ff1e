//! `trueline completions`.

use crate::args::CompletionsArgs;
use crate::failure::Failure;
use crate::output;
use std::process::ExitCode;

/// Runs the command.
pub(crate) fn run(args: &CompletionsArgs) -> Result<ExitCode, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut crate::args::command(), "trueline", &mut script);
    output::data(&String::from_utf8_lossy(&script))?;
    Ok(ExitCode::SUCCESS)
}
