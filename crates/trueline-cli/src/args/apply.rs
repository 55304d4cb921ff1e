//! `trueline apply`.

use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline apply weld --calibration result.json --out seam.csv
  trueline apply recording.mcap --calibration result.json --out seam.ply
  trueline apply weld --calibration result.json --out seam.mcap

CSV: time_s,frame,line,x_mm,y_mm,z_mm. PLY: metres.
MCAP: foxglove.PointCloud on /seam_points, metres, in frame base. Coordinates are in the \
robot's base; time_s is the true exposure by the robot's clock, the stamp minus \
the time offset; images without a frame counter are numbered from 0.

Exit code: 0 written, 1 written by a calibration that was not accepted, 2 could not be written.")]
pub(crate) struct ApplyArgs {
    /// Dataset folder or recording
    pub(crate) recording: PathBuf,
    /// The JSON of `trueline calibrate --json`, or a TOML like initial.toml
    #[arg(long)]
    pub(crate) calibration: PathBuf,
    /// File to write: .csv, .ply or .mcap; - is CSV on stdout
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Print no summary
    #[arg(long)]
    pub(crate) quiet: bool,
}
