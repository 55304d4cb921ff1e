//! `trueline calibrate`.

use super::features::JointName;
use clap::{Args, ValueEnum};
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline calibrate scan
  trueline calibrate scan --json - --quiet | jq .time_offset_s
  trueline calibrate monday tuesday --json result.json
  trueline calibrate scan --require translation=0.1mm,time=0.1ms
  trueline calibrate scan --initial guess.toml --accept-partial
  trueline calibrate scan --initial guess.toml --fix time-offset
  trueline calibrate scan --residual point-to-line --report paper.html")]
pub struct CalibrateArgs {
    /// Dataset folder, recording.mcap or rosbag2; several of one sensor are calibrated together
    #[arg(required = true)]
    pub datasets: Vec<PathBuf>,
    /// Where to start, instead of the dataset's initial.toml
    #[arg(long)]
    pub initial: Option<PathBuf>,
    /// What is minimised: the point in the laser sheet (default), or the paper's distance from the line
    #[arg(long, value_enum, default_value_t = ResidualName::Sheet)]
    pub residual: ResidualName,
    /// Robust loss; the default is tukey for sheet and huber for point-to-line
    #[arg(long, value_enum)]
    pub loss: Option<LossName>,
    /// Hold at the initial value (may be given twice)
    #[arg(long, value_enum)]
    pub fix: Vec<FixName>,
    /// Expected noise of a feature, px
    #[arg(long)]
    pub feature_sigma_px: Option<f64>,
    /// Expected noise of a feature of a profiler or of points, mm
    #[arg(long)]
    pub feature_sigma_mm: Option<f64>,
    /// Noise of the robot's position, mm; the default measures it
    #[arg(long)]
    pub robot_sigma_mm: Option<f64>,
    /// Expected jitter of an image stamp, ms; the default measures it
    #[arg(long)]
    pub stamp_sigma_ms: Option<f64>,
    /// Which timestamps to use: those that fit the data better, those recorded, or those of the sender's clock
    #[arg(long, value_enum, default_value_t = StampsName::Auto)]
    pub stamps: StampsName,
    /// Accuracy to reach, or exit 1: time=0.1ms,translation=0.1mm,rotation=0.05deg (one sigma, any of them)
    #[arg(long, value_name = "WHAT=LIMIT,…")]
    pub require: Option<String>,
    /// Where the scan alone does not decide: the time offset is within plus and minus this, s
    #[arg(long, value_name = "SECONDS")]
    pub offset_within: Option<f64>,
    /// Where the scan alone does not decide: the sensor looks along this axis of the tool, to within 60 degrees
    #[arg(long, value_enum, value_name = "AXIS", allow_hyphen_values = true)]
    pub looks: Option<AxisName>,
    /// Hold what the scan cannot determine at the initial guess instead of refusing
    #[arg(long)]
    pub accept_partial: bool,
    /// Speed along the seam at which the error at the torch is predicted, mm/s
    #[arg(long, default_value_t = 50.0)]
    pub speed_mm_s: f64,
    /// Distance of the seam from the sensor there, mm; the default is the scan's own
    #[arg(long)]
    pub stand_off_mm: Option<f64>,
    /// Joint type, for a dataset with pictures and no features
    #[arg(long, value_enum, default_value_t = JointName::Auto)]
    pub joint: JointName,
    /// Threads for large scans; the result is the same to the last bit
    #[arg(long, default_value_t = NonZeroUsize::MIN)]
    pub threads: NonZeroUsize,
    /// Write the result as JSON; - is stdout
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Write a report that opens in a browser
    #[arg(long)]
    pub report: Option<PathBuf>,
    /// Write a recording for the Rerun viewer
    #[cfg(feature = "rerun")]
    #[arg(long)]
    pub rerun: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum ResidualName {
    /// Measured point against the line's intersection with the laser sheet: maximum likelihood
    Sheet,
    /// Distance of the point from the line in base: the paper's
    PointToLine,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum StampsName {
    /// The sender's clock where that clearly fits better
    Auto,
    /// As recorded
    Raw,
    /// The sender's clock for every stream with a constant period
    Regular,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum LossName {
    /// Ordinary least squares
    Squared,
    /// Linear beyond 3 sigma
    Huber,
    /// Logarithmic beyond 3 sigma
    Cauchy,
    /// Saturates
    GemanMcClure,
    /// Ignores points beyond 8 sigma
    Tukey,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum AxisName {
    #[value(name = "+x")]
    PlusX,
    #[value(name = "-x")]
    MinusX,
    #[value(name = "+y")]
    PlusY,
    #[value(name = "-y")]
    MinusY,
    #[value(name = "+z")]
    PlusZ,
    #[value(name = "-z")]
    MinusZ,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum FixName {
    /// The time offset: the paper's "without temporal calibration" with an initial offset of 0
    TimeOffset,
    /// Hand-eye rotation and translation
    HandEye,
}
