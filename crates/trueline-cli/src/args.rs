//! The command line.

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Calibrates a laser vision sensor on a robot against one straight line.
#[derive(Parser)]
#[command(
    version,
    about,
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
    /// Find out why a dataset does not calibrate: undoes the usual mistakes in turn
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
#[command(after_help = "Examples:
  trueline simulate --preset paper --out paper-scan
  trueline simulate --preset quick --random-cell --seed 7 --outliers 0.4 --out wild
  trueline simulate --preset quick --mishap robot-clock-step --out stepped
  trueline simulate --preset two-lines --noise-free --out exact
  trueline simulate --images --joint lap --look welding --duration-s 10 --out pictures")]
pub struct SimulateArgs {
    /// Folder to write; it must not hold a dataset yet
    #[arg(long)]
    pub out: PathBuf,
    /// Which scan
    #[arg(long, value_enum, default_value_t = PresetName::Quick)]
    pub preset: PresetName,
    /// Seed of all that is random
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Any hand-eye transform, line and offset (±1 s) instead of the preset's
    #[arg(long)]
    pub random_cell: bool,
    /// No noise at all, and a robot that moves straight between its samples
    #[arg(long)]
    pub noise_free: bool,
    /// Time offset, ms
    #[arg(long, allow_negative_numbers = true)]
    pub time_offset_ms: Option<f64>,
    /// Duration, s
    #[arg(long)]
    pub duration_s: Option<f64>,
    /// Time between robot samples, ms
    #[arg(long)]
    pub robot_period_ms: Option<f64>,
    /// Standard deviation of a feature, px
    #[arg(long)]
    pub feature_noise_px: Option<f64>,
    /// Standard deviation of a feature of a profiler or of points, mm
    #[arg(long)]
    pub feature_noise_mm: Option<f64>,
    /// Standard deviation of the robot's position, mm
    #[arg(long)]
    pub robot_noise_mm: Option<f64>,
    /// Standard deviation of image stamps, ms
    #[arg(long)]
    pub stamp_jitter_ms: Option<f64>,
    /// Drift of the camera clock against the robot's, ppm
    #[arg(long, allow_negative_numbers = true)]
    pub clock_drift_ppm: Option<f64>,
    /// Part of the features that is anywhere in the field of view, 0 to 1
    #[arg(long)]
    pub outliers: Option<f64>,
    /// Part of the frames that is lost, 0 to 1
    #[arg(long)]
    pub drops: Option<f64>,
    /// Something that goes wrong in the recording
    #[arg(long, value_enum)]
    pub mishap: Option<MishapName>,
    /// Time between images, ms
    #[arg(long)]
    pub frame_period_ms: Option<f64>,
    /// Write pictures instead of features, and the true seam to truth_features.csv
    #[arg(long)]
    pub images: bool,
    /// What the pictures show
    #[arg(long, value_enum, default_value_t = SceneName::Fillet, requires = "images")]
    pub joint: SceneName,
    /// How the pictures look
    #[arg(long, value_enum, default_value_t = LookName::Speckle, requires = "images")]
    pub look: LookName,
    /// Exposure time, ms
    #[arg(long, requires = "images")]
    pub exposure_ms: Option<f64>,
    /// How much of each plate is missing at a fillet's corner, mm
    #[arg(long, requires = "images")]
    pub corner_gap_mm: Option<f64>,
    /// Bits of a pixel, 8 or 16
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u8).range(8..=16), requires = "images")]
    pub bits: u8,
    /// Print nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum PresetName {
    /// The paper's scan: 60 s, ±10 mm, ±5°, 33 Hz, 17.73 ms
    Paper,
    /// 20 s, well excited
    Quick,
    /// 20 s, hardly any tilt
    Weak,
    /// Two lines beside each other
    TwoLines,
    /// A laser profiler instead of a camera
    Profiler,
    /// S-path without rotation: the translation cannot be seen
    ConstantAttitude,
    /// Straight along the line: next to nothing can be seen
    AlongLine,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum SceneName {
    /// Two plates at 90°
    Fillet,
    /// A plate of 3 mm on another
    Lap,
    /// Bevelled plates, 90°, 5 mm deep
    VGroove,
    /// Two plates 1.5 mm apart
    Butt,
    /// One plate, no joint
    Plate,
    /// No stripe at all
    Nothing,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum LookName {
    /// The bare stripe in whole grey levels
    Clean,
    /// Full speckle, shot and read noise
    Speckle,
    /// The same, and each plate mirrors in the other
    Shiny,
    /// The same, with spatter, the arc's glow and missing pieces
    Welding,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum MishapName {
    /// Twenty bad frames in a row, three times
    Bursts,
    /// For a quarter of the scan the detector follows a parallel edge 5 mm beside
    SecondLine,
    /// The robot stream is silent for 0.4 s, twice
    RobotGaps,
    /// Every 50th robot row is recorded twice
    DuplicateRows,
    /// The robot's clock is set forward by 80 ms two thirds through
    RobotClockStep,
    /// From two thirds on images arrive 45 ms later
    LateImages,
}

#[derive(Args)]
pub struct ImportArgs {
    #[command(subcommand)]
    pub format: ImportFormat,
}

#[derive(Subcommand)]
pub enum ImportFormat {
    /// The text files of the paper's authors: the simulation (egm.txt, cam.txt), or real recordings
    #[command(after_help = "Examples:
  trueline import lvs-st-calib data/calib --out authors
  trueline import lvs-st-calib run1 --robot robot.txt --images images.txt --pixels uv.txt --sensor sensor.toml --out run1-dataset

File names are looked up in SRC. The recording's rows are
  robot   sec nsec x y z ex ey ez qw qx qy qz ts_us      (mm, degrees)
  images  sec nsec index ts_ns
  pixels  u v, or u v of the left, centre and right corner")]
    LvsStCalib {
        /// Folder with the files
        src: PathBuf,
        /// Folder to write
        #[arg(long)]
        out: PathBuf,
        /// Robot rows of a real recording
        #[arg(long, requires = "images")]
        robot: Option<PathBuf>,
        /// Image rows of a real recording
        #[arg(long, requires = "pixels")]
        images: Option<PathBuf>,
        /// Pixel rows of a real recording
        #[arg(long, requires = "sensor")]
        pixels: Option<PathBuf>,
        /// sensor.toml that belongs to a real recording
        #[arg(long, requires = "robot")]
        sensor: Option<PathBuf>,
    },
    /// CSV files with other column names
    #[command(after_help = "Example:
  trueline import csv logs --robot-map time_s=t,x_mm=X,y_mm=Y,z_mm=Z,qw=w,qx=x,qy=y,qz=z \\
      --features-map time_ms=stamp,u_px=col,v_px=row --out scan

A mapping is ours=theirs; the unit stands in our name. Without a mapping a file keeps its names.")]
    Csv {
        /// Folder with the files
        src: PathBuf,
        /// Folder to write
        #[arg(long)]
        out: PathBuf,
        /// Robot poses, looked up in SRC
        #[arg(long, default_value = "robot.csv")]
        robot: PathBuf,
        /// Features, looked up in SRC
        #[arg(long, default_value = "features.csv")]
        features: PathBuf,
        /// Sensor, looked up in SRC
        #[arg(long, default_value = "sensor.toml")]
        sensor: PathBuf,
        /// Columns of the robot file, ours=theirs
        #[arg(long, value_delimiter = ',')]
        robot_map: Vec<String>,
        /// Columns of the feature file, ours=theirs
        #[arg(long, value_delimiter = ',')]
        features_map: Vec<String>,
        /// Character between columns
        #[arg(long, default_value_t = ',')]
        delimiter: char,
    },
    /// A TUM trajectory (timestamp tx ty tz qx qy qz qw; s, m) as robot poses
    #[command(after_help = "Example:
  trueline import tum poses.txt --features features.csv --sensor sensor.toml --out scan")]
    Tum {
        /// The trajectory
        src: PathBuf,
        /// Folder to write
        #[arg(long)]
        out: PathBuf,
        /// features.csv
        #[arg(long)]
        features: PathBuf,
        /// sensor.toml
        #[arg(long)]
        sensor: PathBuf,
    },
}

#[derive(Args)]
#[command(after_help = "Examples:
  trueline features scan
  trueline features scan --joint lap --overlay looked-at
  trueline features scan --json - --quiet | jq .found

A features.csv that is there already is kept under another name.

Exit code: 0 features were written, 1 there is no seam in any picture, 2 could not run.")]
pub struct FeaturesArgs {
    /// Dataset folder with sensor.toml and images/index.csv
    pub dataset: PathBuf,
    /// What the laser shines on
    #[arg(long, value_enum, default_value_t = JointName::Auto)]
    pub joint: JointName,
    /// Folder for pictures of what was found; it must not hold any yet
    #[arg(long)]
    pub overlay: Option<PathBuf>,
    /// Draw every n-th picture
    #[arg(long, default_value_t = NonZeroUsize::MIN, requires = "overlay")]
    pub overlay_every: NonZeroUsize,
    /// Threads; the default is one for each core
    #[arg(long)]
    pub threads: Option<NonZeroUsize>,
    /// Write the summary as JSON; - is stdout
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum JointName {
    /// Whatever most pictures show
    Auto,
    /// Two plates at an angle: their corner
    Fillet,
    /// A plate on a plate: the edge of the upper one
    Lap,
    /// Bevelled plates: the bottom of the groove
    VGroove,
    /// Two plates side by side: the middle of the gap
    Butt,
}

#[derive(Args)]
#[command(after_help = "Examples:
  trueline calibrate scan
  trueline calibrate scan --json - --quiet | jq .time_offset_s
  trueline calibrate scan --require translation=0.1mm,time=0.1ms
  trueline calibrate scan --initial guess.toml --accept-partial
  trueline calibrate scan --initial guess.toml --fix time-offset
  trueline calibrate scan --residual point-to-line --report paper.html")]
pub struct CalibrateArgs {
    /// Dataset folder
    pub dataset: PathBuf,
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
    /// Which stamps are believed: those that the scan bears out, those recorded, or those of the clock behind
    #[arg(long, value_enum, default_value_t = StampsName::Auto)]
    pub stamps: StampsName,
    /// Accuracy to reach, or exit 1: time=0.1ms,translation=0.1mm,rotation=0.05deg (one sigma, any of them)
    #[arg(long, value_name = "WHAT=LIMIT,…")]
    pub require: Option<String>,
    /// Hold what the scan does not show at the initial guess instead of refusing
    #[arg(long)]
    pub accept_partial: bool,
    /// Speed along the seam at which the error at the torch is predicted, mm/s
    #[arg(long, default_value_t = 50.0)]
    pub speed_mm_s: f64,
    /// Distance of the seam from the sensor there, mm; the default is the scan's own
    #[arg(long)]
    pub stand_off_mm: Option<f64>,
    /// What the laser shines on, for a dataset with pictures and no features
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
    /// Print no summary
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
    /// Dataset folder
    pub dataset: PathBuf,
    /// Write the diagnosis as JSON; - is stdout
    #[arg(long)]
    pub json: Option<PathBuf>,
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
    /// The clock's where they leave clearly less residual
    Auto,
    /// As recorded
    Raw,
    /// The clock's behind each stream that ticks evenly
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
    /// Blind beyond 8 sigma
    Tukey,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum FixName {
    /// The time offset: the paper's "without temporal calibration" with an initial offset of 0
    TimeOffset,
    /// Hand-eye rotation and translation
    HandEye,
}
