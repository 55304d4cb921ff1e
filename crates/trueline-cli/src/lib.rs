//! The program `trueline`: arguments in, words on stderr, data on stdout.
//!
//! Exit code 0: accepted. 1: computed, but not accepted; the reasons are listed. 2: could not run.

mod args;
mod clocks;
mod cloud_file;
mod commands;
#[cfg(feature = "foxglove")]
mod estimate_json;
mod failure;
#[cfg(feature = "live")]
mod foxglove_view;
#[cfg(feature = "live")]
mod interrupt;
#[cfg(feature = "live")]
mod live_cell;
#[cfg(feature = "live")]
mod live_page;
#[cfg(any(feature = "foxglove", feature = "ros2"))]
mod live_placing;
#[cfg(feature = "live")]
mod live_screen;
#[cfg(feature = "live")]
mod live_watch;
mod log_layer;
mod logging;
mod measured_frames;
mod mistake;
mod opening;
mod output;
mod path_file;
mod picture_progress;
mod picture_report;
mod pictures;
mod planned_scan;
mod progress;
#[cfg(feature = "live")]
mod robot_link;
#[cfg(feature = "serve")]
pub mod serve;
#[cfg(feature = "live")]
mod service;
mod side_view;
mod stderr;
mod wrong_file;

pub use args::command;
#[cfg(feature = "live")]
pub use args::testbench;

use crate::args::{Arguments, Command, SensorCommand};
#[cfg(feature = "live")]
use crate::args::{Device, Testbench};
use clap::error::ErrorKind;
use clap::{ArgMatches, FromArgMatches};
use failure::Failure;
use std::ffi::OsString;
use std::panic;
use std::process::ExitCode;
use std::sync::Once;
use trueline_dataset::guarded;
use trueline_report::terminal_text::shown;

/// Exit code of a command, or why it could not run.
type Outcome = Result<ExitCode, Failure>;

/// Runs the program with the words of a command line; the first is its own name. Prints help and errors of the command
/// line.
pub fn run(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    let words: Vec<_> = words.into_iter().collect();
    #[cfg(feature = "live")]
    if args::is_testbench(&words) {
        let name = OsString::from("trueline-testbench");
        return run_testbench(std::iter::once(name).chain(words.into_iter().skip(1)));
    }
    run_as(words, args::command, called, |called| match called {
        Called::Command(arguments) => execute(&arguments),
        Called::LeftOut(failure) => Err(failure),
    })
}

/// Program of a command line.
enum Called {
    Command(Box<Arguments>),
    /// A command that this build leaves out.
    LeftOut(Failure),
}

fn called(matches: &ArgMatches) -> Result<Called, clap::Error> {
    match matches.subcommand_name().and_then(Failure::of_left_out) {
        Some(failure) => Ok(Called::LeftOut(failure)),
        None => Ok(Called::Command(Box::new(Arguments::from_arg_matches(matches)?))),
    }
}

/// The same for the program `trueline-testbench`.
#[cfg(feature = "live")]
pub fn run_testbench(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    let words = words.into_iter().collect();
    run_as(words, args::testbench, Testbench::from_arg_matches, |testbench| execute_device(&testbench))
}

/// Parses words and runs the command.
fn run_as<T>(
    words: Vec<OsString>,
    command: fn() -> clap::Command,
    read: impl Fn(&ArgMatches) -> Result<T, clap::Error>,
    execute: impl FnOnce(T) -> Outcome,
) -> ExitCode {
    output::remember_command_line(&words);
    keep_guarded_panics_quiet();
    let named = args::named_command(command(), &words);
    // Errors are reported with control characters stripped.
    let harmless: Vec<OsString> =
        words.iter().map(|word| shown(&word.to_string_lossy()).into_owned().into()).collect();
    let parsed = |words: &[OsString]| read(&command().try_get_matches_from(words)?);
    match parsed(&words).map_err(|told| parsed(&harmless).err().unwrap_or(told)) {
        Ok(called) => exit_code(execute(called)),
        Err(told) if told.kind() == ErrorKind::ValueValidation => {
            output::words(&Failure::of_value(&told, command().get_name(), named.as_deref()).to_string());
            ExitCode::from(2)
        }
        Err(told) => {
            // Without a reader the output is dropped.
            let told = args::nearest_first(told);
            let _ = told.print();
            u8::try_from(told.exit_code()).map_or(ExitCode::FAILURE, ExitCode::from)
        }
    }
}

/// A decoder's panic is reported as an error: nothing else is printed of it.
fn keep_guarded_panics_quiet() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !guarded::is_guarded() {
                usual(info);
            }
        }));
    });
}

fn exit_code(outcome: Outcome) -> ExitCode {
    match outcome {
        Ok(code) => code,
        // A reader may close our output: that is not a failure.
        Err(Failure::BrokenPipe) => ExitCode::SUCCESS,
        Err(failure) => {
            output::words(&failure.to_string());
            ExitCode::from(2)
        }
    }
}

fn execute(arguments: &Arguments) -> Outcome {
    output::use_colours(arguments.global.color);
    logging::start(&arguments.global)?;
    match &arguments.command {
        Command::Demo(args) => commands::demo::run(args),
        Command::Simulate(args) => commands::simulate::run(args),
        Command::Import(args) => commands::import::run(args),
        Command::Features(args) => commands::features::run(args),
        Command::Calibrate(args) => commands::calibrate::run(args),
        Command::Sensor(args) => match &args.command {
            SensorCommand::Intrinsics(args) => commands::sensor_intrinsics::run(args),
            SensorCommand::LaserPlane(args) => commands::sensor_laser_plane::run(args),
        },
        Command::Plan(args) => commands::plan::run(args),
        Command::Evaluate(args) => commands::evaluate::run(args),
        Command::Diff(args) => commands::diff::run(args),
        Command::Apply(args) => commands::apply::run(args),
        Command::Cloud(args) => commands::cloud::run(args),
        Command::Export(args) => commands::export::run(args),
        #[cfg(feature = "live")]
        Command::Watch(args) => commands::watch::run(args),
        #[cfg(feature = "live")]
        Command::History(args) => commands::history::run(args),
        #[cfg(feature = "serve")]
        Command::Serve(args) => commands::serve::run(args),
        #[cfg(feature = "ros2")]
        Command::Ros2Node(args) => commands::ros2_node::run(args),
        Command::Reproduce(args) => commands::reproduce::run(args),
        #[cfg(feature = "live")]
        Command::Listen(args) => commands::listen::run(args),
        #[cfg(feature = "live")]
        Command::Record(args) => commands::record::run(args),
        #[cfg(feature = "live")]
        Command::Scan(args) => commands::scan::run(args),
        Command::RobotProgram(args) => commands::robot_program::run(args),
        Command::Doctor(args) => commands::doctor::run(args),
        Command::Completions(args) => commands::completions::run(args),
        Command::Man(args) => commands::man::run(args),
    }
}

#[cfg(feature = "live")]
fn execute_device(testbench: &Testbench) -> Outcome {
    output::use_colours(testbench.global.color);
    logging::start(&testbench.global)?;
    match &testbench.device {
        Device::Robot(args) => commands::robot_sim::run(args),
        Device::Stream(args) => commands::stream_sim::run(args),
        #[cfg(feature = "gige")]
        Device::Camera(args) => commands::camera_sim::run(args),
    }
}
