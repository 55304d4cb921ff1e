//! The command line.

mod apply;
mod calibrate;
#[cfg(feature = "gige")]
mod camera_sim;
mod choice;
mod diff;
mod evaluate;
mod export;
mod features;
mod import;
mod import_csv;
mod listen;
mod number;
mod plan;
mod protocol;
mod rapid;
mod robot_sim;
mod scan;
mod sensor;
mod simulate;
mod simulate_path;
mod stream_sim;

pub use apply::ApplyArgs;
pub use calibrate::{CalibrateArgs, TargetName};
#[cfg(feature = "gige")]
pub use camera_sim::CameraSimArgs;
pub use diff::DiffArgs;
pub use evaluate::{EvaluateArgs, ReproduceArgs};
pub use export::ExportArgs;
pub use features::FeaturesArgs;
pub use import::{BagArgs, ImportArgs, ImportFormat};
pub use import_csv::ImportCsvArgs;
pub use listen::ListenArgs;
pub use plan::PlanArgs;
pub use rapid::RapidArgs;
pub use robot_sim::{Mode, RobotSimArgs};
pub use scan::{CameraArgs, RecordArgs, ScanArgs};
pub use sensor::{IntrinsicsArgs, LaserPlaneArgs, SensorArgs, SensorCommand};
pub use simulate::SimulateArgs;
pub use simulate_path::PathArgs;
pub use stream_sim::StreamSimArgs;

use clap::{Args, CommandFactory, Parser, Subcommand};
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
    #[command(subcommand)]
    pub command: Command,
}

/// The command line, in which the value of every option may begin with a minus: what is out of range is then told in the
/// command's own words.
pub fn command() -> clap::Command {
    fn with_negative_numbers(command: clap::Command) -> clap::Command {
        command
            .mut_args(|arg| {
                match arg.get_action().takes_values()
                    && !arg.is_positional()
                    && !arg.is_allow_hyphen_values_set()
                {
                    true => arg.allow_negative_numbers(true),
                    false => arg,
                }
            })
            .mut_subcommands(with_negative_numbers)
    }
    with_negative_numbers(Arguments::command())
}

#[derive(Subcommand)]
pub enum Command {
    /// Simulate a scan, calibrate it, print the summary and write trueline-demo/report.html
    Demo(DemoArgs),
    /// Write a simulated dataset with its truth
    Simulate(SimulateArgs),
    /// Turn a foreign recording into a dataset folder
    Import(ImportArgs),
    /// Find the seam in a dataset's pictures and write features.csv
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
    /// Write the transform in the form of a robot or a program
    Export(ExportArgs),
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
    /// Run a simulated robot controller with EGM
    RobotSim(RobotSimArgs),
    /// A simulated controller of another make that streams its poses: UR, FANUC, KUKA
    StreamSim(StreamSimArgs),
    /// A simulated GigE Vision camera that sees what a simulated robot's camera would see
    #[cfg(feature = "gige")]
    CameraSim(CameraSimArgs),
    /// Find out why a dataset does not calibrate: undo the usual mistakes one at a time
    Doctor(DoctorArgs),
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

Tried: mm and m, quaternion order, inverted poses or rotations, rho read as translation, degrees and radians,
swapped or mirrored pixels, a mirrored laser plane, the order of the distortion, clocks of different origin, a
switched tool frame; and against initial.toml: sign of the offset, inverted transform, units, another tool frame.

Exit code: 0 nothing wrong, 1 something was found, or nothing explains the bad fit, 2 could not run.")]
pub struct DoctorArgs {
    /// Dataset folder, recording.mcap or rosbag2
    pub dataset: PathBuf,
    /// Write the diagnosis as JSON; - is stdout
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub quiet: bool,
}
