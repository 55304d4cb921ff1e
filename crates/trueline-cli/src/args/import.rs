//! `trueline import`.

use crate::args::choice::{Choice, one_of};
use crate::args::import_csv::ImportCsvArgs;
use crate::args::new_folder::NewFolder;
use clap::{Args, Subcommand};
use std::path::PathBuf;
use trueline_dataset::import::axis_columns::AxisColumn;
use trueline_mcap::StampClock;

#[derive(Args)]
pub(crate) struct ImportArgs {
    #[command(subcommand)]
    pub(crate) format: ImportFormat,
}

#[derive(Subcommand)]
pub(crate) enum ImportFormat {
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
        #[command(flatten)]
        folder: NewFolder,
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
    /// CSV files of any program: robots by name, every rotation, other separators and names
    #[command(aliases = ["mat", "matlab", "excel", "xlsx"])]
    Csv(Box<ImportCsvArgs>),
    /// A TUM trajectory (timestamp tx ty tz qx qy qz qw; s, m) as robot poses
    #[command(after_help = "Example:
  trueline import tum poses.txt --features features.csv --sensor sensor.toml --out scan")]
    Tum {
        /// The trajectory
        src: PathBuf,
        #[command(flatten)]
        folder: NewFolder,
        /// features.csv
        #[arg(long)]
        features: PathBuf,
        /// sensor.toml
        #[arg(long)]
        sensor: PathBuf,
    },
    /// A recording of trueline, any MCAP file with poses or tf, and pictures; a rosbag2 folder, .db3 or .db3.zstd
    #[command(visible_alias = "rosbag2", after_help = BAG_HELP)]
    Mcap(BagArgs),
}

const BAG_HELP: &str = "Examples:
  trueline import mcap recording.mcap --out scan
  trueline import mcap drive.mcap --sensor sensor.toml --base base_link --tool tool0 --out scan
  trueline import rosbag2 joints --urdf robot.urdf --tool tool0 --sensor sensor.toml --out scan
  trueline import rosbag2 rosbag2_2026_11_21 --sensor sensor.toml --pose-topic /robot/pose --out scan

Poses: PoseStamped, PoseWithCovarianceStamped, Odometry, TransformStamped, tf \
and tf_static, Foxglove's PoseInFrame and FrameTransform. Pictures: Image (mono, \
rgb, bgr, bayer), CompressedImage (png; jpeg with --allow-jpeg), Foxglove's
RawImage and CompressedImage. Profiles: PointCloud2 with y = 0, LaserScan.
Joint angles (JointState) become poses with the robot's --urdf. The stamps are \
those in the headers. The only topic of a kind is used; of several one must be named.";

#[derive(Args)]
pub(crate) struct BagArgs {
    /// The recording
    pub(crate) src: PathBuf,
    #[command(flatten)]
    pub(crate) folder: NewFolder,
    /// sensor.toml [default: the one in the recording]
    #[arg(long)]
    pub(crate) sensor: Option<PathBuf>,
    /// Topic of the robot's poses
    #[arg(long)]
    pub(crate) pose_topic: Option<String>,
    /// Topic of the pictures or profiles
    #[arg(long)]
    pub(crate) image_topic: Option<String>,
    /// Frame of the robot's base, of tf or of the URDF
    #[arg(long)]
    pub(crate) base: Option<String>,
    /// Frame of the tool, of tf or of the URDF
    #[arg(long)]
    pub(crate) tool: Option<String>,
    /// The robot's URDF, where the recording has joint angles and no poses
    #[arg(long, value_name = "FILE")]
    pub(crate) urdf: Option<PathBuf>,
    /// An external axis by the name of its joint: table_rad=JOINT of JointState, table_deg=E1 of a recorded KUKA, table_deg=eax_a of an ABB; may be repeated
    #[arg(
        long = "axis",
        value_name = "NAME=JOINT",
        long_help = "An external axis by the name of its joint: table_rad=JOINT or track_m=JOINT of JointState, table_deg=E1 of a recorded \
                     KUKA (E1 to E6, with EIPos), table_deg=eax_a of an ABB (EGM), table_deg=EXT1 of a FANUC (Stream Motion, versions 1 and \
                     2); may be repeated, in the order of the chain. What it carries follows a comma: part, robot or sensor. Written to \
                     axes.csv and cell.toml"
    )]
    pub(crate) axes: Vec<AxisColumn>,
    /// Accept JPEG pictures too, although compression moves edges by fractions of a pixel
    #[arg(long)]
    pub(crate) allow_jpeg: bool,
    /// Range of profiles that stands for no return, mm: such points are left out
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) no_return_mm: Option<f64>,
    /// Clock that stamps robot and pictures
    #[arg(long, value_parser = one_of(&CLOCKS), default_value = "recorded")]
    pub(crate) stamps: StampClock,
}

static CLOCKS: [Choice<StampClock>; 2] = [
    ("recorded", "As the recording has it", StampClock::Recorded),
    (
        "ptp",
        "IEEE 1588 times of controller and camera (recordings of trueline; RobotWare 7.16, and a camera that follows PTP)",
        StampClock::Ptp,
    ),
];
