//! The command line of the program `trueline`: every command, its options and their help.
//!
//! Values are read into the units and types of the libraries (SI) and checked for their range. `commands` runs them.
#![allow(
    missing_docs,
    reason = "the documentation of what clap derives is help: that of a command stands in the list of commands"
)]

mod apply;
mod calibrate;
#[cfg(feature = "live")]
mod camera_address;
#[cfg(feature = "gige")]
mod camera_sim;
mod choice;
mod cloud;
mod diff;
mod drawn_line;
mod evaluate;
pub(crate) mod export;
mod features;
#[cfg(feature = "live")]
mod foxglove;
mod global;
mod headings;
pub(crate) mod hints;
#[cfg(feature = "live")]
mod history;
mod import;
mod import_csv;
pub(crate) mod left_out;
#[cfg(feature = "live")]
mod link_hint;
#[cfg(feature = "live")]
mod listen;
mod new_folder;
mod number;
mod part_moves;
mod plan;
#[cfg(feature = "live")]
mod protocol;
mod rapid_egm;
mod requirement;
mod robot_program;
#[cfg(feature = "live")]
mod robot_sim;
#[cfg(feature = "ros2")]
mod ros2_node;
#[cfg(feature = "live")]
mod scan;
mod seam_scan_options;
mod sensor;
#[cfg(feature = "live")]
mod serve;
#[cfg(feature = "serve")]
mod serve_cell;
mod simulate;
mod simulate_axes;
mod simulate_boards;
mod simulate_curve;
mod simulate_path;
mod simulate_plates;
mod simulate_production;
mod simulate_shop;
mod simulate_sightings;
mod simulated_profiles;
mod simulated_scenario;
mod simulated_sensor;
#[cfg(feature = "live")]
mod stream_sim;
#[cfg(feature = "live")]
mod testbench;
#[cfg(feature = "live")]
mod watch;
#[cfg(feature = "live")]
mod wiring;

pub(crate) use apply::ApplyArgs;
pub(crate) use calibrate::{CalibrateArgs, TargetName};
#[cfg(feature = "gige")]
pub(crate) use camera_sim::CameraSimArgs;
pub(crate) use cloud::CloudArgs;
pub(crate) use diff::DiffArgs;
pub(crate) use evaluate::{EvaluateArgs, ReproduceArgs};
pub(crate) use export::ExportArgs;
pub(crate) use features::FeaturesArgs;
#[cfg(feature = "live")]
pub(crate) use foxglove::FoxgloveArgs;
pub(crate) use global::GlobalArgs;
#[cfg(feature = "live")]
pub(crate) use history::HistoryArgs;
pub(crate) use import::{BagArgs, ImportArgs, ImportFormat};
pub(crate) use import_csv::ImportCsvArgs;
#[cfg(feature = "live")]
pub(crate) use link_hint::link_hint;
#[cfg(feature = "live")]
pub(crate) use listen::ListenArgs;
pub(crate) use new_folder::NewFolder;
pub(crate) use plan::PlanArgs;
#[cfg(feature = "live")]
pub(crate) use protocol::LinkArgs;
pub(crate) use rapid_egm::RapidEgmArgs;
pub(crate) use robot_program::RobotProgramArgs;
#[cfg(feature = "live")]
pub(crate) use robot_sim::RobotSimArgs;
#[cfg(feature = "ros2")]
pub(crate) use ros2_node::Ros2NodeArgs;
#[cfg(feature = "live")]
pub(crate) use scan::{CameraArgs, RecordArgs, ScanArgs};
pub(crate) use sensor::{IntrinsicsArgs, LaserPlaneArgs, SensorArgs, SensorCommand};
#[cfg(feature = "live")]
pub(crate) use serve::ServeArgs;
#[cfg(feature = "serve")]
pub(crate) use serve_cell::ServeCellArgs;
pub(crate) use simulate::SimulateArgs;
pub(crate) use simulate_path::PathArgs;
pub(crate) use simulate_production::ProductionArgs;
#[cfg(feature = "live")]
pub(crate) use stream_sim::StreamSimArgs;
#[cfg(feature = "live")]
pub(crate) use testbench::{Device, Testbench, is_called as is_testbench};
#[cfg(feature = "live")]
pub(crate) use watch::WatchArgs;

use clap::error::{ContextKind, ContextValue};
use clap::{Args, CommandFactory, Parser, Subcommand};
use std::ffi::OsString;
use std::path::PathBuf;

/// The command line.
#[derive(Parser)]
#[command(
    name = "trueline",
    version,
    about = "Calibrate a laser seam sensor on a robot: time offset, hand-eye and line, from one scan",
    after_help = "Examples:
  trueline demo
  trueline simulate --preset quick --out scan
  trueline calibrate scan --json result.json --report report.html

Exit code: 0 accepted, 1 computed but not accepted (reasons listed), 2 could not run."
)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(crate) global: GlobalArgs,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// Options that have a letter, the same one in every command.
const LETTERS: [(&str, char); 6] =
    [("quiet", 'q'), ("out", 'o'), ("json", 'j'), ("report", 'r'), ("preset", 'p'), ("calibration", 'c')];

/// The command line. The value of every option may begin with a minus, so that the command itself reports values out of
/// range.
pub fn command() -> clap::Command {
    finished(left_out::named(Arguments::command()))
}

/// The same for `trueline-testbench`.
#[cfg(feature = "live")]
pub fn testbench() -> clap::Command {
    finished(Testbench::command())
}

fn finished(command: clap::Command) -> clap::Command {
    fn completed(command: clap::Command) -> clap::Command {
        command.mut_args(|arg| with_letter(with_negative_numbers(arg))).mut_subcommands(completed)
    }
    let mut command = headings::with_headings(completed(command), "").max_term_width(100);
    command.build();
    let program = command.get_name().to_owned();
    let of_all =
        |arg: clap::Arg| if arg.get_id() == "help" { arg.help_heading(global::HEADING) } else { arg };
    command.mut_args(of_all).mut_subcommands(|sub| without_global(sub, &program))
}

/// Hides the options of every command in the help of one: that of the program explains them.
fn without_global(command: clap::Command, program: &str) -> clap::Command {
    let is_global = |arg: &clap::Arg| global::IDS.contains(&arg.get_id().as_str());
    let hidden = |arg: clap::Arg| if is_global(&arg) { arg.hide(true) } else { arg };
    let note = global::where_explained(program);
    let with_note = |text: &clap::builder::StyledStr| format!("{text}\n\n{note}");
    let end = command.get_after_help().map_or_else(|| note.clone(), with_note);
    let long_end = command.get_after_long_help().map_or_else(|| end.clone(), with_note);
    // `-h` shows the options for everybody only.
    let has_more = command.get_arguments().any(clap::Arg::is_hide_short_help_set);
    let end = match command.get_bin_name().filter(|_| has_more) {
        Some(name) => end.replace(&note, &format!("All options: `{name} --help`\n{note}")),
        None => end,
    };
    command
        .after_help(end)
        .after_long_help(long_end)
        .mut_args(hidden)
        .mut_subcommands(|sub| without_global(sub, program))
}

/// The command that words name, with its parts, `import csv`; the first word is the program.
#[must_use]
pub(crate) fn named_command(mut at: clap::Command, words: &[OsString]) -> Option<String> {
    let mut names = Vec::new();
    for word in words.iter().skip(1) {
        match at.find_subcommand(word).cloned() {
            Some(inner) => {
                names.push(inner.get_name().to_owned());
                at = inner;
            }
            None if names.is_empty() => {}
            None => break,
        }
    }
    (!names.is_empty()).then(|| names.join(" "))
}

/// The same error, with the most similar suggestion first.
#[must_use]
pub(crate) fn nearest_first(mut told: clap::Error) -> clap::Error {
    let kind = ContextKind::SuggestedSubcommand;
    // They come sorted, the nearest last.
    if let Some(ContextValue::Strings(names)) = told.get(kind) {
        let nearest_first = names.iter().rev().cloned().collect();
        told.insert(kind, ContextValue::Strings(nearest_first));
    }
    told
}

fn with_negative_numbers(arg: clap::Arg) -> clap::Arg {
    let takes = arg.get_action().takes_values() && !arg.is_positional() && !arg.is_allow_hyphen_values_set();
    if takes { arg.allow_negative_numbers(true) } else { arg }
}

fn with_letter(arg: clap::Arg) -> clap::Arg {
    let letter = LETTERS.iter().find(|(name, _)| arg.get_id() == name && !arg.is_positional());
    match letter {
        Some((_, letter)) => arg.short(*letter),
        None => arg,
    }
}

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Simulate a scan, calibrate it, print the summary and write trueline-demo/report.html
    Demo(DemoArgs),
    /// Write a simulated dataset with its truth
    Simulate(Box<SimulateArgs>),
    /// Turn a foreign recording into a dataset folder
    Import(ImportArgs),
    /// Find the seam in a dataset's pictures or profiles and write features.csv
    Features(FeaturesArgs),
    /// Estimate time offset, hand-eye transform and lines from a dataset folder
    Calibrate(Box<CalibrateArgs>),
    /// Calibrate the sensor itself from pictures of a chessboard: camera intrinsics, laser plane
    Sensor(SensorArgs),
    /// Plan the most informative scan within the limits of robot, sensor and guess
    Plan(PlanArgs),
    /// Check a calibration on another scan, of a known or fitted line, circle or curve
    Evaluate(EvaluateArgs),
    /// Compare two calibrations of one sensor: unchanged, or what has moved
    Diff(DiffArgs),
    /// Place every seam point of a recording in the robot's base, corrected in time
    Apply(ApplyArgs),
    /// Place every measured point of recordings in the robot's base: a cloud
    Cloud(CloudArgs),
    /// Write the transform in the form of a robot or a program
    Export(ExportArgs),
    /// Monitor a calibration in production: from every weld, whether it is still valid, and what moved
    #[cfg(feature = "live")]
    Watch(WatchArgs),
    /// History of `watch`: control charts and a table
    #[cfg(feature = "live")]
    History(HistoryArgs),
    /// Show a cell in the browser: the first scan step by step, recordings, watch and history
    #[cfg(feature = "serve")]
    Serve(ServeCellArgs),
    /// Place profiles of ROS 2 in the robot's base while it runs, as a node
    #[cfg(feature = "ros2")]
    Ros2Node(Ros2NodeArgs),
    /// Repeat the paper's experiments in simulation: tables, CSV and a report
    Reproduce(ReproduceArgs),
    /// Listen to a robot and report its stream: sender, regularity, errors
    #[cfg(feature = "live")]
    Listen(ListenArgs),
    /// Record a robot while its own program drives it
    #[cfg(feature = "live")]
    Record(RecordArgs),
    /// Guide a robot along a planned path and record it; a dry run without --enable-motion
    #[cfg(feature = "live")]
    Scan(ScanArgs),
    /// Write a robot's own program for a path, with what it needs to stream its poses meanwhile
    RobotProgram(RobotProgramArgs),
    /// Find out why a dataset does not calibrate: undo the usual mistakes one at a time
    Doctor(DoctorArgs),
    /// Print a completion script for a shell
    Completions(CompletionsArgs),
    /// Write the manual pages
    Man(ManArgs),
}

#[derive(Args)]
#[command(after_help = "Examples:
  trueline completions bash > ~/.local/share/bash-completion/completions/trueline
  trueline completions zsh > ~/.zfunc/_trueline
  trueline completions powershell >> $PROFILE")]
pub(crate) struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    pub(crate) shell: clap_complete::Shell,
}

#[derive(Args)]
#[command(after_help = "Example:
  trueline man --out man && man man/trueline-calibrate.1")]
pub(crate) struct ManArgs {
    /// Folder to write; it must be new or empty
    #[arg(long)]
    pub(crate) out: PathBuf,
}

#[derive(Args)]
pub(crate) struct DemoArgs {
    /// Seed of the simulated noise
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Print nothing but errors
    #[arg(long)]
    pub(crate) quiet: bool,
}

#[derive(Args)]
#[command(after_help = "Example:
  trueline doctor scan
  trueline doctor scan --fix scan-fixed

Reported first: the messages of `calibrate` on the data, and poses that no robot can take. Then the mistakes \
that are tried, the most likely first: mm, m and \
inches, quaternion order, inverted poses or rotations, Euler angles in all orders, rho read as translation, degrees and \
radians, s, ms and µs, swapped or mirrored pixels, a mirrored laser plane, the order of the distortion, frame rate, clocks of \
different origin, a switched tool frame; and against initial.toml: sign of the offset, inverted transform, units, another \
tool frame.

Without a mistake --fix writes nothing.

Exit code: 0 nothing wrong, 1 something was found, or nothing explains the bad fit, 2 could not run.")]
pub(crate) struct DoctorArgs {
    /// Dataset folder, recording.mcap or rosbag2
    pub(crate) dataset: PathBuf,
    /// Write the diagnosis as JSON; - is stdout
    #[arg(long)]
    pub(crate) json: Option<PathBuf>,
    /// Write the dataset without the mistake that was found, to a new folder
    #[arg(long, value_name = "OUT")]
    pub(crate) fix: Option<PathBuf>,
    /// Time limit after the fit of the data as they are, s; then no further trial starts
    #[arg(long, value_name = "SECONDS", default_value_t = 12.0, value_parser = crate::args::number::seconds)]
    pub(crate) longest_s: f64,
    /// Replace the folder of --fix if it has trueline's files alone; it is kept as FIX.replaced-1
    #[arg(long, requires = "fix")]
    pub(crate) force: bool,
    /// Print no summary
    #[arg(long)]
    pub(crate) quiet: bool,
}
