//! `trueline cloud`.

use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline cloud scan --calibration result.json --out cloud.ply
  trueline cloud monday tuesday --calibration result.json --sigma --frame --out cloud.parquet
  trueline cloud recording.mcap --calibration result.json --thickness --out cloud.las
  trueline cloud scan --calibration result.json --out cloud.mcap --report cloud.html

Every point of every profile is placed at its true exposure: the stamp minus the time offset, by the robot's clock. Recordings \
without whole profiles give their seam points and the ends of their stripes.

PLY: binary, metres, double precision. PCD: binary, metres, single precision. LAS: metres to 1 µm, intensity to whole numbers. \
E57: metres, double precision. MCAP: foxglove.PointCloud, a message for each frame. Parquet: time_ns, frame, x_mm, y_mm, z_mm, intensity, sigma_mm. Intensity is written where it was \
recorded.

Exit code: 0 written, 1 written by a calibration that was not accepted, 2 could not be written.")]
pub(crate) struct CloudArgs {
    /// Dataset folders or recordings of one sensor
    #[arg(required = true, value_name = "SCAN")]
    pub(crate) scans: Vec<PathBuf>,
    /// The JSON of `trueline calibrate --json`, or a TOML like initial.toml
    #[arg(long)]
    pub(crate) calibration: PathBuf,
    /// File to write: .ply, .pcd, .las, .e57, .mcap or .parquet
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Write the ± of each point (PLY, PCD, MCAP, Parquet); the calibration must state its covariance
    #[arg(long)]
    pub(crate) sigma: bool,
    /// Write the number of each point's frame (PLY, PCD, MCAP, Parquet)
    #[arg(long)]
    pub(crate) frame: bool,
    /// Compare passes forth and back on flat patches, with the time offset and without it
    #[arg(long)]
    pub(crate) thickness: bool,
    /// Write a report that opens in a browser: a flat patch scanned forth and back, with the time offset and without it
    #[arg(long)]
    pub(crate) report: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub(crate) quiet: bool,
}
