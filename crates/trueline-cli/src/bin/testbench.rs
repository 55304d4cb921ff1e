//! The program `trueline-testbench`.

use std::process::ExitCode;

fn main() -> ExitCode {
    trueline_cli::run_testbench(std::env::args_os())
}
