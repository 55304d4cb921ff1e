//! `trueline simulate`.

use super::simulate_path::PathArgs;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use trueline_sim::Fault;
use trueline_sim::faults::{FAULT_NAMES, FaultName};

#[derive(Args)]
#[command(after_help = "Examples:
  trueline simulate --preset paper --out paper-scan
  trueline simulate --preset quick --random-cell --seed 7 --outliers 0.4 --out wild
  trueline simulate --preset quick --fault robot-clock-step --out stepped
  trueline simulate --preset good --fault plane-offset=0.25 --fault wobble=0.1,5 --out real
  trueline simulate --weave-frame sensor --lateral-hz 0.75 --range-hz 0.75 --out alias
  trueline simulate --preset two-lines --noise-free --out exact
  trueline simulate --plan plan --seed 3 --out planned-scan
  trueline simulate --images --joint lap --look welding --duration-s 10 --out pictures",
    after_long_help = faults_help())]
pub struct SimulateArgs {
    /// Folder to write; it must not hold a dataset yet
    #[arg(long)]
    pub out: PathBuf,
    /// Which scan
    #[arg(long, value_enum, default_value_t = PresetName::Quick)]
    pub preset: PresetName,
    /// Follow the plan in this folder instead: hand-eye and line are off its guess by as much as it allows for
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["preset", "random_cell", "duration_s", "robot_period_ms", "frame_period_ms", "images", "faults"])]
    pub plan: Option<PathBuf>,
    /// With --plan: hand-eye and line are as the plan has them
    #[arg(long, requires = "plan")]
    pub exact_guess: bool,
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
    /// Something that is wrong, with its size: plane-offset=0.25 (may be given several times; --help lists all)
    #[arg(long = "fault", value_name = "NAME[=SIZE[,SIZE]]")]
    pub faults: Vec<Fault>,
    #[command(flatten)]
    pub path: PathArgs,
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
    /// Angle between a fillet's plates, degrees
    #[arg(long, default_value_t = 90.0, requires = "images")]
    pub opening_deg: f64,
    /// How far a fillet is turned about its seam, degrees
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, requires = "images")]
    pub roll_deg: f64,
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
    /// 20 s, 200 mm, ±20 mm, ±25°, ±25 mm stand-off
    Good,
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

/// The list of faults for the long help.
fn faults_help() -> String {
    let row = |kind: &FaultName| {
        let defaults: Vec<String> = kind.defaults.iter().map(f64::to_string).collect();
        let size = if defaults.is_empty() { String::new() } else { format!("={}", defaults.join(",")) };
        let units = if kind.units.is_empty() { String::new() } else { format!(" [{}]", kind.units) };
        format!("  {}{size}{units}: {}\n", kind.name, kind.description)
    };
    let rows: String = FAULT_NAMES.iter().map(row).collect();
    format!("Faults, with their default sizes and units:\n{rows}")
}
