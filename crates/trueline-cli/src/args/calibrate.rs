//! `trueline calibrate`.

use crate::args::choice::{Choice, one_of};
use crate::args::drawn_line;
use crate::args::features::{JOINTS, JointChoice};
use crate::args::number::{above_zero, of_a_seam_mm, zero_or_more};
use crate::args::part_moves::part_moves;
use crate::args::requirement;
use crate::args::sensor::board;
use clap::{Args, ValueEnum};
use nalgebra::Vector3;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use trueline_lsq::Loss;
use trueline_method::config::known_of_cell::{KnownOfCell, ToolAxis};
use trueline_method::{
    Config, DrawnLine, HeldSigma, Hold, Measurements, PartMoves, Requirement, ResidualKind, SensorMode,
    Stamps, Target, Use,
};
use trueline_sensor::Board;

/// Bias of the features for each 10° of tilt, px, where none is stated.
const FEATURE_BIAS_PX: f64 = 0.2;
/// Speed at which the seam error is predicted, mm/s, if none is stated.
const SPEED_MM_S: f64 = 50.0;
/// Assumed distance of a seam from its drawing, mm, if none is stated: the deviation of a usual weld.
const CAD_TOLERANCE_MM: f64 = 0.2;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline calibrate scan
  trueline calibrate scan --json - --quiet | jq .time_offset_s
  trueline calibrate monday tuesday --json result.json
  trueline calibrate scan --require translation=0.1mm,time=0.1ms
  trueline calibrate scan --initial guess.toml --accept-partial
  trueline calibrate scan --initial guess.toml --fix time-offset
  trueline calibrate stops --at-stops
  trueline calibrate scan --drawn-line 1150,80,120:1450,80,120 --drawn-line-sigma-mm 0.05
  trueline calibrate pipe --seam-cad pipe.dxf --cad-tolerance-mm 0.1
  trueline calibrate scan --residual point-to-line --report paper.html
  trueline calibrate scan --write-sensor corrected.toml --certificate sensor.html
  trueline calibrate scan --use both --json -
  trueline calibrate scan --sensor fixed --robot-accuracy-mm 0 --feature-bias-px 0
  trueline calibrate board-scan --target board --board chessboard:9x6:25 --json reference.json
  trueline calibrate board-stops --target board --board chessboard:9x6:25 --at-stops
  trueline calibrate marker-scan --json -                      # sightings.csv: poses of a marker
  trueline calibrate ball --target sphere --radius-mm 20 --at-stops

How to use the time offset: true exposure = stamp - time offset. Interpolate the robot's pose at that time \
between the two samples around it, and multiply:

  p_base = base_from_tool(stamp - offset) * tool_from_camera * p_camera

If the sensor's driver or the robot's controller has a setting for the delay, enter it there instead, once. \
Calibrate again when anything changes that delays an image or a pose: exposure time, image size, frame rate, \
which stamp is used, network, filters of the controller. `trueline export result.json --as time-offset` writes the rule with \
programs in Python, C++ and RAPID.")]
pub(crate) struct CalibrateArgs {
    /// Dataset folder, recording.mcap or rosbag2; several of one sensor are calibrated together
    #[arg(required = true)]
    pub(crate) datasets: Vec<PathBuf>,
    /// Target of the scan: a seam, a sphere or cylinder, or a chessboard in pictures without laser (a reference)
    #[arg(long, value_enum, default_value_t = TargetName::Seam, requires_if("board", "board"))]
    pub(crate) target: TargetName,
    /// The board of --target board: chessboard:COLUMNSxROWS:SQUARE_MM
    #[arg(long, value_parser = board, requires = "target", conflicts_with_all = OF_SEAMS)]
    pub(crate) board: Option<Board>,
    /// Radius of the sphere or cylinder of --target, mm; without it the radius is estimated
    #[arg(long, value_name = "MM", value_parser = above_zero, requires = "target")]
    pub(crate) radius_mm: Option<f64>,
    /// Initial guess, instead of the dataset's initial.toml
    #[arg(long)]
    pub(crate) initial: Option<PathBuf>,
    /// Measurement to use; by default whole stripes if present and in agreement with the seam points, else seam points
    #[arg(long = "use", value_name = "WHAT", value_parser = one_of(&MEASUREMENTS))]
    pub(crate) measurements: Option<Measurements>,
    /// Residual to minimise: the point in the laser plane (default), or the paper's distance from the line
    #[arg(long, value_parser = one_of(&RESIDUALS), default_value = "sheet")]
    pub(crate) residual: ResidualKind,
    /// Robust loss; the default is tukey for sheet and huber for point-to-line
    #[arg(long, value_parser = one_of(&LOSSES))]
    pub(crate) loss: Option<Loss>,
    /// The robot stands still at each reading: calibrate without a time offset; poses come from robot.csv, or one per stop from
    /// poses.csv
    #[arg(long)]
    pub(crate) at_stops: bool,
    /// Hold at the initial value (may be given twice)
    #[arg(long, value_parser = one_of(&HOLDS))]
    pub(crate) fix: Vec<Hold>,
    /// Uncertainty of the values held by --fix, one sigma: time=0.1ms,translation=0.1mm,rotation=0.05deg (any of them)
    #[arg(long, value_name = "WHAT=SIGMA,…", value_parser = requirement::parse_held, requires = "fix")]
    pub(crate) fixed_sigma: Option<Requirement>,
    /// Hold the seam at the place of a drawing: two of its points in the robot's base, mm. For several seams give it once
    /// for each, in their order
    #[arg(
        long,
        value_name = "X,Y,Z:X,Y,Z",
        value_parser = drawn_line::points_m,
        allow_hyphen_values = true,
        requires = "drawn_line_sigma_mm"
    )]
    pub(crate) drawn_line: Vec<[Vector3<f64>; 2]>,
    /// Uncertainty of each point of --drawn-line, one sigma in each direction, mm
    #[arg(long, value_name = "MM", value_parser = above_zero, requires = "drawn_line")]
    pub(crate) drawn_line_sigma_mm: Option<f64>,
    /// Drawing of a curved seam, CSV (x_mm,y_mm,z_mm) or DXF, in the part's own frame: the position of the part is estimated
    #[arg(long, value_name = "FILE")]
    pub(crate) seam_cad: Option<PathBuf>,
    /// Deviation of the seam from that drawing, one sigma in each direction, for each 5 mm of seam, mm
    #[arg(long, value_name = "MM", default_value_t = CAD_TOLERANCE_MM, value_parser = above_zero, requires = "seam_cad")]
    pub(crate) cad_tolerance_mm: f64,
    /// Scatter of the part's place, if it was clamped again between passes over its seam: one sigma of the shift along each axis, mm, and of
    /// the turn about it, degrees [default of the turn: 0.1]
    #[arg(long, value_name = "MM[,DEG]", value_parser = part_moves)]
    pub(crate) part_moves: Option<PartMoves>,
    /// Expected noise of a feature in a picture if features.csv does not state it, px
    #[arg(long, value_parser = above_zero)]
    pub(crate) feature_sigma_px: Option<f64>,
    /// Expected noise of a feature of a profiler, or of a point in mm, if features.csv does not state it, mm
    #[arg(long, value_parser = above_zero)]
    pub(crate) feature_sigma_mm: Option<f64>,
    /// Noise of the robot's position, mm; the default measures it
    #[arg(long, value_parser = above_zero)]
    pub(crate) robot_sigma_mm: Option<f64>,
    /// Expected jitter of an image stamp, ms; the default measures it
    #[arg(long, value_parser = above_zero)]
    pub(crate) stamp_sigma_ms: Option<f64>,
    /// How to treat the sensor calibration
    #[arg(long, value_parser = one_of(&SENSORS), default_value = "prior")]
    pub(crate) sensor: SensorMode,
    /// Write the corrected sensor file, if the calibration is accepted
    #[arg(long, value_name = "FILE")]
    pub(crate) write_sensor: Option<PathBuf>,
    /// Write a certificate of the sensor, .json or .html (a page): date, person, figures with their uncertainty, checks
    #[arg(long, value_name = "FILE", value_parser = certificate)]
    pub(crate) certificate: Option<PathBuf>,
    /// Name of the person responsible for the certificate
    #[arg(long, value_name = "NAME", requires = "certificate")]
    pub(crate) operator: Option<String>,
    /// Absolute accuracy of the robot, mm; 0 is an ideal robot. The default is taken from sensor.toml, else 0.5
    #[arg(long, value_name = "MM", value_parser = zero_or_more)]
    pub(crate) robot_accuracy_mm: Option<f64>,
    /// State the ± of the true transform, as another robot needs it: the errors of the scanning robot count 1.5 times. Otherwise the ±
    /// hold for a torch on the same robot
    #[arg(long)]
    pub(crate) strict: bool,
    /// Bias of the features for each 10° of tilt, px; 0 is none
    #[arg(long, value_name = "PX", default_value_t = FEATURE_BIAS_PX, value_parser = zero_or_more)]
    pub(crate) feature_bias_px: f64,
    /// Radius of the seam's edge, mm; the detector reports the outermost point of the rounding. 0 is a sharp edge, or a point
    /// where two lines cross. The default is taken from sensor.toml, else 0.3
    #[arg(long, value_name = "MM", value_parser = of_a_seam_mm)]
    pub(crate) edge_radius_mm: Option<f64>,
    /// Waviness of the seam beyond a bow, RMS, mm; 0 is a perfectly straight seam. The default is taken from sensor.toml, else 0.06,
    /// which the scan refines
    #[arg(long, value_name = "MM", value_parser = of_a_seam_mm)]
    pub(crate) waviness_mm: Option<f64>,
    /// Time stamps to use: those that fit the data better, those recorded, or those of the sender's clock
    #[arg(long, value_parser = one_of(&STAMPS), default_value = "auto")]
    pub(crate) stamps: Stamps,
    /// Required accuracy, one sigma, any of: time=0.1ms,translation=0.1mm,rotation=0.05deg,seam=0.5mm. A scan that misses it
    /// exits with 1. The default for the seam is 1 mm, or 10 mm where robot errors are not estimated: at stops, or with a seam
    /// stated to be exact
    #[arg(long, value_name = "WHAT=LIMIT,…", value_parser = requirement::parse)]
    pub(crate) require: Option<Requirement>,
    /// If the scan alone is ambiguous: the time offset is within ± this, s
    #[arg(long, value_name = "SECONDS", value_parser = above_zero)]
    pub(crate) offset_within: Option<f64>,
    /// If the scan alone is ambiguous: the sensor looks along this axis of the tool, within 60 degrees
    #[arg(long, value_parser = one_of(&AXES), value_name = "AXIS", allow_hyphen_values = true)]
    pub(crate) looks: Option<ToolAxis>,
    /// Hold undetermined unknowns at the initial guess instead of refusing
    #[arg(long)]
    pub(crate) accept_partial: bool,
    /// Speed along the seam at which the seam error is predicted, mm/s
    #[arg(long, default_value_t = SPEED_MM_S, value_parser = zero_or_more)]
    pub(crate) speed_mm_s: f64,
    /// Distance of the seam from the sensor at which the seam error is predicted, mm; the default is the scan's own
    #[arg(long, value_parser = above_zero)]
    pub(crate) stand_off_mm: Option<f64>,
    /// Joint type, for a dataset with pictures and no features
    #[arg(long, value_parser = one_of(&JOINTS), default_value = "auto")]
    pub(crate) joint: JointChoice,
    /// The stamps of robot and images are of unrelated clocks: estimate the shift between them
    #[arg(long)]
    pub(crate) align_clocks: bool,
    /// Threads; by default one per core. The result does not depend on it
    #[arg(long)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Write the result as JSON; - is stdout
    #[arg(long)]
    pub(crate) json: Option<PathBuf>,
    /// Write a report that opens in a browser
    #[arg(long)]
    pub(crate) report: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl CalibrateArgs {
    fn threads(&self) -> NonZeroUsize {
        self.threads.or_else(|| std::thread::available_parallelism().ok()).unwrap_or(NonZeroUsize::MIN)
    }

    /// Settings of a calibration, in SI.
    pub(crate) fn config(&self) -> Config {
        let defaults = Config::default();
        Config {
            target: match self.target {
                TargetName::Line => Target::Line,
                TargetName::Curve => Target::Curve,
                _ => Target::Seam,
            },
            measurements: self.measurements.unwrap_or_default(),
            residual: self.residual,
            loss: self.loss,
            at_stops: self.at_stops,
            hold: self.fix.clone(),
            held_sigma: self.fixed_sigma.map_or_else(HeldSigma::default, |sigma| HeldSigma {
                time_s: sigma.time_s,
                rotation_rad: sigma.rotation_rad,
                translation_m: sigma.translation_m,
            }),
            drawn_lines: self.drawn_lines(),
            part_moves: self.part_moves,
            feature_sigma_px: self.feature_sigma_px,
            feature_sigma_m: self.feature_sigma_mm.map(|mm| mm * 1e-3),
            robot_sigma_m: self.robot_sigma_mm.map(|mm| mm * 1e-3),
            stamp_sigma_s: self.stamp_sigma_ms.map(|ms| ms * 1e-3),
            stamps: self.stamps,
            sensor: self.sensor,
            robot_accuracy_m: self.robot_accuracy_mm.map(|mm| mm * 1e-3),
            feature_bias_px: self.feature_bias_px,
            edge_radius_m: self.edge_radius_mm.map(|mm| mm * 1e-3),
            waviness_m: self.waviness_mm.map(|mm| mm * 1e-3),
            accept_partial: self.accept_partial,
            require: self.require.unwrap_or_default(),
            known: KnownOfCell { offset_within_s: self.offset_within, looks: self.looks },
            used_at: Use {
                speed_m_s: self.speed_mm_s * 1e-3,
                stand_off_m: self.stand_off_mm.map(|mm| mm * 1e-3),
                by_another_robot: self.strict,
            },
            threads: self.threads().get(),
            ..defaults
        }
    }

    /// The options that were given and do not apply to pose sightings.
    pub(crate) fn not_of_poses(&self) -> impl Iterator<Item = &'static str> {
        let defaults = Config::default();
        let given = [
            ("--target board", self.target == TargetName::Board || self.board.is_some()),
            ("--fix hand-eye", self.fix.contains(&Hold::HandEye)),
            ("--use", self.measurements.is_some()),
            ("--residual", self.residual != defaults.residual),
            ("--loss", self.loss.is_some()),
            ("--fixed-sigma", self.fixed_sigma.is_some()),
            ("--drawn-line", !self.drawn_line.is_empty()),
            ("--seam-cad", self.seam_cad.is_some()),
            ("--part-moves", self.part_moves.is_some()),
            ("--feature-sigma-px", self.feature_sigma_px.is_some()),
            ("--feature-sigma-mm", self.feature_sigma_mm.is_some()),
            ("--robot-sigma-mm", self.robot_sigma_mm.is_some()),
            ("--stamp-sigma-ms", self.stamp_sigma_ms.is_some()),
            ("--sensor", self.sensor != SensorMode::Prior),
            ("--write-sensor", self.write_sensor.is_some()),
            ("--certificate", self.certificate.is_some()),
            ("--feature-bias-px", self.feature_bias_px != FEATURE_BIAS_PX),
            ("--edge-radius-mm", self.edge_radius_mm.is_some()),
            ("--waviness-mm", self.waviness_mm.is_some()),
            ("--stamps", self.stamps != Stamps::Auto),
            ("--require", self.require.is_some()),
            ("--strict", self.strict),
            ("--looks", self.looks.is_some()),
            ("--accept-partial", self.accept_partial),
            ("--speed-mm-s", self.speed_mm_s != SPEED_MM_S),
            ("--stand-off-mm", self.stand_off_mm.is_some()),
            ("--joint", self.joint.is_some()),
            ("--align-clocks", self.align_clocks),
            ("--report", self.report.is_some()),
        ];
        given.into_iter().filter(|(_, is_given)| *is_given).map(|(option, _)| option)
    }

    fn drawn_lines(&self) -> Vec<DrawnLine> {
        let sigma_m = self.drawn_line_sigma_mm.unwrap_or_default() * 1e-3;
        let lines = self.drawn_line.iter().enumerate();
        lines.filter_map(|(line, points)| DrawnLine::through(line, *points, sigma_m)).collect()
    }
}

/// Options that do not apply to a board.
const OF_SEAMS: [&str; 29] = [
    "measurements",
    "residual",
    "loss",
    "fixed_sigma",
    "drawn_line",
    "seam_cad",
    "part_moves",
    "feature_sigma_px",
    "feature_sigma_mm",
    "robot_sigma_mm",
    "stamp_sigma_ms",
    "sensor",
    "write_sensor",
    "certificate",
    "operator",
    "strict",
    "feature_bias_px",
    "edge_radius_mm",
    "waviness_mm",
    "stamps",
    "require",
    "offset_within",
    "looks",
    "accept_partial",
    "speed_mm_s",
    "stand_off_mm",
    "joint",
    "threads",
    "report",
];

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TargetName {
    /// A seam: a straight line, or a curve if no line fits the scan
    Seam,
    /// Always a straight seam
    Line,
    /// Always a curved seam
    Curve,
    /// A chessboard: time offset, hand-eye and board together
    Board,
    /// A marker or another target with poses in sightings.csv; the default if sensor.toml has `kind = "poses"`
    Poses,
    /// A sphere in whole profiles, or in points; see --radius-mm
    Sphere,
    /// A cylinder, likewise: a pipe, a shaft, a pin
    Cylinder,
}

/// Pages and JSON are distinguished by their names.
fn certificate(text: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(text);
    let end = file.extension().and_then(|end| end.to_str()).map(str::to_ascii_lowercase);
    match end.as_deref() {
        Some("json" | "html" | "htm") => Ok(file),
        _ => Err(format!("expected a file that ends in .json or .html, found {text}")),
    }
}

static RESIDUALS: [Choice<ResidualKind>; 2] = [
    (
        "sheet",
        "Measured point minus the line's intersection with the laser plane: maximum likelihood",
        ResidualKind::Sheet,
    ),
    ("point-to-line", "Distance of the point from the line in base (the paper's)", ResidualKind::PointToLine),
];

static MEASUREMENTS: [Choice<Measurements>; 3] = [
    ("seam", "The seam point of each frame", Measurements::Seam),
    ("stripe", "The whole stripes on both plates", Measurements::Stripe),
    ("both", "Whole stripes, and the seam points of frames that do not show both plates", Measurements::Both),
];

static SENSORS: [Choice<SensorMode>; 3] = [
    ("fixed", "Hold the sensor as in its file; its stated uncertainty goes into the ±", SensorMode::Fixed),
    (
        "prior",
        "Estimate its shape from the scan, with the stated uncertainty as the prior",
        SensorMode::Prior,
    ),
    ("free", "Estimate its shape from the scan alone", SensorMode::Free),
];

static STAMPS: [Choice<Stamps>; 3] = [
    ("auto", "The sender's clock if stamps are late or if it clearly fits better", Stamps::Auto),
    ("raw", "As recorded", Stamps::Raw),
    ("regular", "The sender's clock for every stream with a constant period", Stamps::Regular),
];

static LOSSES: [Choice<Loss>; 5] = [
    ("squared", "Ordinary least squares", Loss::Squared),
    ("huber", "Linear beyond 3 sigma", Loss::Huber { scale: 3.0 }),
    ("cauchy", "Logarithmic beyond 3 sigma", Loss::Cauchy { scale: 3.0 }),
    ("geman-mc-clure", "Saturates: a distant point adds a constant", Loss::GemanMcClure { scale: 4.0 }),
    ("tukey", "Ignores points beyond 8 sigma", Loss::Tukey { scale: 8.0 }),
];

static AXES: [Choice<ToolAxis>; 6] = [
    ("+x", "", ToolAxis::PlusX),
    ("-x", "", ToolAxis::MinusX),
    ("+y", "", ToolAxis::PlusY),
    ("-y", "", ToolAxis::MinusY),
    ("+z", "", ToolAxis::PlusZ),
    ("-z", "", ToolAxis::MinusZ),
];

static HOLDS: [Choice<Hold>; 2] = [
    (
        "time-offset",
        "The time offset: the paper's \"without temporal calibration\" with an initial offset of 0",
        Hold::TimeOffset,
    ),
    ("hand-eye", "Hand-eye rotation and translation", Hold::HandEye),
];
