//! `trueline simulate`.

use crate::args::choice::{Choice, one_of};
use crate::args::number;
use crate::args::simulate_axes::AxesArgs;
use crate::args::simulate_boards::BoardsArgs;
use crate::args::simulate_curve::{self, CurveArgs};
use crate::args::simulate_path::PathArgs;
use crate::args::simulate_plates::PlatesArgs;
use crate::args::simulate_production::ProductionArgs;
use crate::args::simulate_shop::{ShopArgs, errors_help};
use crate::args::simulate_sightings::{Shared, SightingsArgs};
use clap::Args;
use std::path::PathBuf;
use trueline_sim::curves::CurveScan;
use trueline_sim::faults::{FAULT_NAMES, FaultName};
use trueline_sim::{Fault, Joint, Look, Preset, RoundScan, SightingScan};

#[derive(Args)]
#[command(after_help = "Examples:
  trueline simulate --preset paper --out paper-scan
  trueline simulate --preset quick --random-cell --seed 7 --outliers 0.4 --out wild
  trueline simulate --preset quick --fault robot-clock-step --out stepped
  trueline simulate --preset good --fault plane-offset=0.25 --fault wobble=0.1,5 --out real
  trueline simulate --weave-frame sensor --lateral-hz 0.75 --range-hz 0.75 --out alias
  trueline simulate --preset two-lines --noise-free --out exact
  trueline simulate --plan plan --seed 3 --out planned-scan
  trueline simulate --plan stripe-plan --plates --out planned-stripes   # a plan made with --use stripe
  trueline simulate --production 60 --layout box-weave --change timing=0.5@40 --out production
  trueline simulate --preset paper --plates --bow-mm 0.2 --out stripes
  trueline simulate --preset profiler --plates --out profiles
  trueline simulate --images --joint lap --look welding --duration-s 10 --out pictures
  trueline simulate --shop ordinary --seed 7 --out cell        # a whole cell, and a pass that a calibration is judged by
  trueline simulate --shop rough --only rounded-edge,feature-noise --out edge
  trueline simulate --seam pipe --seed 3 --out pipe            # a profiler that goes twice round a pipe
  trueline simulate --seam pipe --plates --out pipe-stripes    # the same with the stripes on both sides of the seam
  trueline simulate --random-cell --axis table=rotary,part,swing:30@0.1 --out table   # the part swings on a table
  trueline simulate --sightings --outliers 0.3 --out marker    # poses of a marker, three of ten wrong
  trueline simulate --sightings --stops --wall --out stops     # a camera beside the robot, which stops
  trueline simulate --target sphere --out ball                 # profiles of a sphere of 20 mm radius
  trueline simulate --boards chessboard:9x6:20 --out bench     # pictures for `sensor` and `calibrate --target board`",
    after_long_help = faults_help())]
pub(crate) struct SimulateArgs {
    /// Folder to write; it must be new or empty, or see --force
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Replace the folder if it has trueline's files alone; it is kept as OUT.replaced-1
    #[arg(long)]
    pub(crate) force: bool,
    /// Which scan
    #[arg(long, value_parser = one_of(&PRESETS), default_value = "quick")]
    pub(crate) preset: Preset,
    /// Follow the plan in this folder instead: hand-eye and line are off its guess by as much as it allows for
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["preset", "random_cell", "duration_s", "robot_period_ms", "frame_period_ms", "images", "faults"])]
    pub(crate) plan: Option<PathBuf>,
    /// With --plan: hand-eye and line are as the plan has them
    #[arg(long, requires = "plan")]
    pub(crate) exact_guess: bool,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Any hand-eye transform, line and offset (±1 s) instead of the preset's
    #[arg(long)]
    pub(crate) random_cell: bool,
    /// No noise except what other options add, and a robot that moves straight between its samples
    #[arg(long)]
    pub(crate) noise_free: bool,
    /// Time offset, ms
    #[arg(long, value_parser = number::simulated_offset_ms)]
    pub(crate) time_offset_ms: Option<f64>,
    /// Duration, s
    #[arg(long, value_parser = number::simulated_s)]
    pub(crate) duration_s: Option<f64>,
    /// Time between robot samples, ms
    #[arg(long, value_parser = number::period_ms)]
    pub(crate) robot_period_ms: Option<f64>,
    /// Standard deviation of a feature, px
    #[arg(long, value_parser = number::zero_or_more)]
    pub(crate) feature_noise_px: Option<f64>,
    /// Standard deviation of a feature of a profiler or of points, mm
    #[arg(long, value_parser = number::zero_or_more)]
    pub(crate) feature_noise_mm: Option<f64>,
    /// Standard deviation of the robot's position, mm
    #[arg(long, value_parser = number::zero_or_more)]
    pub(crate) robot_noise_mm: Option<f64>,
    /// Standard deviation of image stamps, ms
    #[arg(long, value_parser = number::up_to_a_second_ms)]
    pub(crate) stamp_jitter_ms: Option<f64>,
    /// Drift of the camera clock against the robot's, ppm
    #[arg(long, value_parser = number::drift_ppm)]
    pub(crate) clock_drift_ppm: Option<f64>,
    /// Fraction of outliers, anywhere in the field of view, 0 to 1
    #[arg(long, value_parser = number::share)]
    pub(crate) outliers: Option<f64>,
    /// Fraction of lost frames, 0 to 1
    #[arg(long, value_parser = number::share)]
    pub(crate) drops: Option<f64>,
    /// Number of sensors on one tool: sensors/a, sensors/b, … beside one robot.csv
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(2..=8), conflicts_with_all = ["plan", "images", "plates", "production", "boards", "shop", "seam", "sightings", "faults", "axes"])]
    pub(crate) sensors: Option<u32>,
    /// Inject a fault of a given size, e.g. plane-offset=0.25 (may be given several times; --help lists all)
    #[arg(long = "fault", value_name = "NAME[=SIZE[,SIZE]]")]
    pub(crate) faults: Vec<Fault>,
    #[command(flatten)]
    pub(crate) path: PathArgs,
    #[command(flatten)]
    pub(crate) plates: PlatesArgs,
    #[command(flatten)]
    pub(crate) production: ProductionArgs,
    #[command(flatten)]
    pub(crate) boards: BoardsArgs,
    #[command(flatten)]
    pub(crate) shop: ShopArgs,
    #[command(flatten)]
    pub(crate) curve: CurveArgs,
    #[command(flatten)]
    pub(crate) sightings: SightingsArgs,
    #[command(flatten)]
    pub(crate) axes: AxesArgs,
    /// Time between images, ms
    #[arg(long, value_parser = number::period_ms)]
    pub(crate) frame_period_ms: Option<f64>,
    /// Write pictures instead of features, and the true seam to truth_features.csv
    #[arg(long)]
    pub(crate) images: bool,
    /// Joint in the pictures [default: fillet]
    #[arg(long, value_parser = one_of(&JOINTS_OF_PICTURES), requires = "images")]
    pub(crate) joint: Option<fn() -> Joint>,
    /// How the pictures look [default: speckle]
    #[arg(long, value_parser = one_of(&LOOKS), requires = "images")]
    pub(crate) look: Option<fn() -> Look>,
    /// Exposure time, ms
    #[arg(long, requires = "images", value_parser = number::up_to_a_second_ms)]
    pub(crate) exposure_ms: Option<f64>,
    /// Angle between a fillet's plates, degrees [default: 90]
    #[arg(long, requires = "images", value_parser = number::opening_deg)]
    pub(crate) opening_deg: Option<f64>,
    /// Rotation of a fillet about its seam, degrees [default: 0]
    #[arg(long, requires = "images", value_parser = number::turn_deg)]
    pub(crate) roll_deg: Option<f64>,
    /// Length of each plate missing at a fillet's corner, mm
    #[arg(long, requires = "images", value_parser = number::zero_or_more)]
    pub(crate) corner_gap_mm: Option<f64>,
    /// Bits of a pixel, 8 or 16 [default: 8]
    #[arg(long, value_parser = bits, requires = "images")]
    pub(crate) bits: Option<u8>,
    /// Print nothing but errors
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl SimulateArgs {
    /// The scan over a curve that is asked for, if one is.
    pub(crate) fn curve_scan(&self) -> Option<CurveScan> {
        self.curve.scan(&simulate_curve::Shared {
            noise_free: self.noise_free,
            duration_s: self.duration_s,
            outliers: self.outliers,
            feature_noise_m: self.feature_noise_mm.map(|mm| mm * 1e-3),
            robot_noise_m: self.robot_noise_mm.map(|mm| mm * 1e-3),
            has_plates: self.plates.plates,
        })
    }

    /// The sightings of a target that are asked for, if they are.
    pub(crate) fn sighting_scan(&self) -> Option<SightingScan> {
        self.sightings.scan(&self.shared())
    }

    /// The profiles of a round target that are asked for, if they are.
    pub(crate) fn round_scan(&self) -> Option<RoundScan> {
        self.sightings.round_scan(&self.shared())
    }

    fn shared(&self) -> Shared {
        Shared {
            seed: self.seed,
            noise_free: self.noise_free,
            time_offset_s: self.time_offset_ms.map(|ms| ms * 1e-3),
            outliers: self.outliers,
            robot_noise_m: self.robot_noise_mm.map(|mm| mm * 1e-3),
            jitter_s: self.stamp_jitter_ms.map(|ms| ms * 1e-3),
        }
    }
}

static PRESETS: [Choice<Preset>; 8] = [
    ("paper", "The paper's scan: 60 s, ±10 mm, ±5°, 33 Hz, 17.73 ms", Preset::Paper),
    ("quick", "20 s, well excited", Preset::Quick),
    ("good", "20 s, 200 mm, ±20 mm, ±25°, ±25 mm stand-off", Preset::Good),
    ("weak", "20 s, almost no tilt", Preset::Weak),
    ("two-lines", "Two lines beside each other", Preset::TwoLines),
    ("profiler", "A laser profiler instead of a camera", Preset::Profiler),
    (
        "constant-attitude",
        "S-path without rotation: the translation cannot be determined",
        Preset::ConstantAttitude,
    ),
    ("along-line", "Straight along the line: almost nothing can be determined", Preset::AlongLine),
];

/// Joints in pictures.
pub(crate) static JOINTS_OF_PICTURES: [Choice<fn() -> Joint>; 11] = [
    ("fillet", "Two plates at 90°", Joint::fillet),
    ("lap", "A plate of 3 mm on another", || Joint::Lap { step_m: 3e-3 }),
    ("v-groove", "Bevelled plates, 90°, 5 mm deep", || Joint::VGroove {
        depth_m: 5e-3,
        opening_rad: 90_f64.to_radians(),
    }),
    ("butt", "Two plates 1.5 mm apart", || Joint::Butt { gap_m: 1.5e-3, mismatch_m: 0.0 }),
    ("step", "A step of 5 mm whose riser leans by 45°: two lines", || Joint::Step {
        height_m: 5e-3,
        lean_rad: 45_f64.to_radians(),
    }),
    ("groove", "A groove 14 mm wide with a flat root, 6 mm deep: two lines, its shoulders", || {
        Joint::Groove { width_m: 14e-3, root_m: 4e-3, depth_m: 6e-3 }
    }),
    ("v-block", "A V-block of 90° with a relief slot of 8 mm", || Joint::VBlock {
        depth_m: 0.1,
        opening_rad: 90_f64.to_radians(),
        slot_m: 8e-3,
    }),
    ("corner", "The outside corner of a block, 90°", || Joint::Corner { opening_rad: 90_f64.to_radians() }),
    ("edge", "A plate over nothing", || Joint::Edge),
    ("plate", "One plate, no joint", || Joint::Plate),
    ("nothing", "No stripe at all", || Joint::Nothing),
];

/// How pictures look.
pub(crate) static LOOKS: [Choice<fn() -> Look>; 4] = [
    ("clean", "The bare stripe in whole grey levels", Look::clean),
    ("speckle", "Full speckle, shot and read noise", Look::speckled),
    ("shiny", "The same, and each plate mirrors in the other", Look::shiny),
    ("welding", "The same, with spatter, the arc's glow and missing pieces", Look::welding),
];

fn bits(text: &str) -> Result<u8, String> {
    match text {
        "8" => Ok(8),
        "16" => Ok(16),
        _ => Err("expected 8 or 16".to_owned()),
    }
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
    format!("Faults, with their default sizes and units:\n{rows}\n{}", errors_help())
}
