//! The program `trueline`.

use std::process::ExitCode;

fn main() -> ExitCode {
    trueline_cli::run(std::env::args_os())
}
