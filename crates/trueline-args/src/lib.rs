//! The command line of the program `trueline`: every command, its options and their help.
//!
//! Values are read into the units and types of the libraries (SI); what is read here is in range. What a command does is not
//! here: shell completions and manual pages need no more than this.
//!
//! ```
//! use clap::FromArgMatches;
//! use trueline_args::{Arguments, Command};
//!
//! let words = ["trueline", "calibrate", "scan", "--speed-mm-s", "100"];
//! let arguments = Arguments::from_arg_matches(&trueline_args::command().try_get_matches_from(words)?)?;
//! let Command::Calibrate(calibrate) = arguments.command else { unreachable!("that is the word") };
//! assert_eq!(calibrate.config().used_at.speed_m_s, 0.1, "millimetres end here");
//! # Ok::<(), clap::Error>(())
//! ```
#![allow(
    missing_docs,
    reason = "the documentation of what clap derives is help: that of a command stands in the list of commands"
)]

mod apply;
mod calibrate;
mod camera_address;
#[cfg(feature = "gige")]
mod camera_sim;
mod choice;
mod cloud;
mod diff;
mod drawn_line;
mod evaluate;
pub mod export;
mod features;
mod headings;
pub mod hints;
mod history;
mod import;
mod import_csv;
mod link_hint;
mod listen;
mod new_folder;
mod number;
mod plan;
mod protocol;
mod rapid;
mod requirement;
mod robot_program;
mod robot_sim;
mod scan;
mod seam_scan_options;
mod sensor;
mod serve;
mod simulate;
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
mod stream_sim;
mod watch;
mod wiring;

pub use apply::ApplyArgs;
pub use calibrate::{CalibrateArgs, TargetName};
pub use camera_address::CameraAddress;
#[cfg(feature = "gige")]
pub use camera_sim::CameraSimArgs;
pub use cloud::CloudArgs;
pub use diff::DiffArgs;
pub use evaluate::{EvaluateArgs, ReproduceArgs};
pub use export::ExportArgs;
pub use features::FeaturesArgs;
pub use history::HistoryArgs;
pub use import::{BagArgs, ImportArgs, ImportFormat};
pub use import_csv::ImportCsvArgs;
pub use link_hint::link_hint;
pub use listen::ListenArgs;
pub use new_folder::NewFolder;
pub use plan::PlanArgs;
pub use protocol::LinkArgs;
pub use rapid::RapidArgs;
pub use requirement::Want;
pub use robot_program::RobotProgramArgs;
pub use robot_sim::{Mode, RobotSimArgs};
pub use scan::{CameraArgs, RecordArgs, ScanArgs};
pub use sensor::{IntrinsicsArgs, LaserPlaneArgs, SensorArgs, SensorCommand};
pub use serve::ServeArgs;
pub use simulate::SimulateArgs;
pub use simulate_boards::BoardsArgs;
pub use simulate_curve::CurveArgs;
pub use simulate_path::PathArgs;
pub use simulate_production::ProductionArgs;
pub use simulate_shop::{OnlyErrors, ShopArgs};
pub use simulate_sightings::SightingsArgs;
pub use stream_sim::StreamSimArgs;
pub use watch::WatchArgs;

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
pub struct Arguments {
    /// When to use colours
    #[arg(long, global = true, value_enum, value_name = "WHEN", default_value_t = clap::ColorChoice::Auto)]
    pub color: clap::ColorChoice,
    /// Say more: what is read and written and how long it took; with doctor, everything that was tried
    #[arg(long, short, global = true)]
    pub verbose: bool,
    #[command(subcommand)]
    pub command: Command,
}

/// Options that have a letter, the same one in every command.
const LETTERS: [(&str, char); 6] =
    [("quiet", 'q'), ("out", 'o'), ("json", 'j'), ("report", 'r'), ("preset", 'p'), ("calibration", 'c')];

/// The command line, in which the value of every option may begin with a minus: what is out of range is then told in the
/// command's own words.
pub fn command() -> clap::Command {
    fn completed(command: clap::Command) -> clap::Command {
        command.mut_args(|arg| with_letter(with_negative_numbers(arg))).mut_subcommands(completed)
    }
    headings::with_headings(completed(Arguments::command()), "").max_term_width(100)
}

/// The command that words name, the first of them being the program, with what it is made of: `import csv`.
#[must_use]
pub fn named_command(words: &[OsString]) -> Option<String> {
    let (mut at, mut names) = (command(), Vec::new());
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

/// The same error, with the suggestion first that is most like what was typed.
#[must_use]
pub fn nearest_first(mut told: clap::Error) -> clap::Error {
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
pub enum Command {
    /// Simulate a scan, calibrate it, print the summary and write trueline-demo/report.html
    Demo(DemoArgs),
    /// Write a simulated dataset with its truth
    Simulate(Box<SimulateArgs>),
    /// Turn a foreign recording into a dataset folder
    Import(ImportArgs),
    /// Find the seam in a dataset's pictures or profiles and write features.csv
    Features(FeaturesArgs),
    /// Estimate time offset, hand-eye transform and lines from a dataset folder
    Calibrate(CalibrateArgs),
    /// Calibrate the sensor itself from pictures of a chessboard: camera intrinsics, laser plane
    Sensor(SensorArgs),
    /// Plan the most informative scan within the limits of robot, sensor and guess
    Plan(PlanArgs),
    /// Check a calibration on another scan, of a known or fitted line, circle or curve
    Evaluate(EvaluateArgs),
    /// Compare two calibrations of one sensor: the same, or what has moved
    Diff(DiffArgs),
    /// Place every seam point of a recording in the robot's base, corrected in time
    Apply(ApplyArgs),
    /// Place every measured point of recordings in the robot's base: a cloud
    Cloud(CloudArgs),
    /// Write the transform in the form of a robot or a program
    Export(ExportArgs),
    /// Watch a calibration in production: from every weld, whether it is still good, and what moved
    Watch(WatchArgs),
    /// What `watch` has seen: control charts and a table
    History(HistoryArgs),
    /// Repeat the paper's experiments in simulation: tables, CSV and a report
    Reproduce(ReproduceArgs),
    /// Listen to a robot and say who talks, how regularly, and what is wrong
    Listen(ListenArgs),
    /// Record a robot while its own program drives it
    Record(RecordArgs),
    /// Guide a robot along a planned path and record it; a dry run without --enable-motion
    Scan(ScanArgs),
    /// Write a RAPID module for a planned path
    Rapid(RapidArgs),
    /// Write a robot's own program for a path, with what it needs to stream its poses meanwhile
    RobotProgram(RobotProgramArgs),
    /// Run a simulated robot controller with EGM
    RobotSim(RobotSimArgs),
    /// A simulated controller of another make that streams its poses: UR, FANUC, KUKA
    StreamSim(StreamSimArgs),
    /// A simulated GigE Vision camera that sees what a simulated robot's camera would see
    #[cfg(feature = "gige")]
    CameraSim(CameraSimArgs),
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
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

#[derive(Args)]
#[command(after_help = "Example:
  trueline man --out man && man man/trueline-calibrate.1")]
pub struct ManArgs {
    /// Folder to write; it must be new or empty
    #[arg(long)]
    pub out: PathBuf,
}

#[derive(Args)]
pub struct DemoArgs {
    /// Seed of the simulated noise
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Args)]
#[command(after_help = "Example:
  trueline doctor scan
  trueline doctor scan --fix scan-fixed

Named first: what `calibrate` says of the data, and poses that no robot takes. Then tried, the likeliest first: mm, m and \
inches, quaternion order, inverted poses or rotations, Euler angles in all orders, rho read as translation, degrees and \
radians, s, ms and µs, swapped or mirrored pixels, a mirrored laser plane, the order of the distortion, frame rate, clocks of \
different origin, a switched tool frame; and against initial.toml: sign of the offset, inverted transform, units, another \
tool frame.

Where nothing is wrong, --fix writes nothing.

Exit code: 0 nothing wrong, 1 something was found, or nothing explains the bad fit, 2 could not run.")]
pub struct DoctorArgs {
    /// Dataset folder, recording.mcap or rosbag2
    pub dataset: PathBuf,
    /// Write the diagnosis as JSON; - is stdout
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Write the dataset without the mistake that was found, to a new folder
    #[arg(long, value_name = "OUT")]
    pub fix: Option<PathBuf>,
    /// Begin no further trial after so long, s
    #[arg(long, value_name = "SECONDS", default_value_t = 12.0, value_parser = crate::number::seconds)]
    pub longest_s: f64,
    /// Replace the folder of --fix if it has trueline's files alone; it is kept as FIX.replaced-1
    #[arg(long, requires = "fix")]
    pub force: bool,
    /// Print no summary
    #[arg(long)]
    pub quiet: bool,
}
