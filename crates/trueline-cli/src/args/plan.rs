//! `trueline plan`.

use crate::args::choice::{Choice, one_of};
use crate::args::requirement::{self, Want};
use clap::Args;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use trueline_method::{Measurements, Requirement};
use trueline_plan::robot_program::Language;
use trueline_plan::{Criterion, Goal, PlanRequest, Shape, cell_toml};

#[derive(Args)]
#[command(after_help = "Examples:
  trueline plan --example --out plan            # the paper's cell; plan/cell.toml is yours to edit
  trueline plan --example=profiler --out plan   # a cell of a profiler
  trueline plan plan/cell.toml --out better --duration-s 30
  trueline plan cell.toml --out quick --want translation=0.05mm,rotation=0.02deg,time=0.1ms
  trueline plan cell.toml --out seam --want seam=0.15mm
  trueline plan --example --use stripe --out stripes && trueline simulate --plan stripes --plates --out stripe-scan
  trueline plan cell.toml --out cell --program krl,ls      # programs for KUKA and FANUC beside path.csv
  trueline plan cell.toml --calibration result.json --out second   # a scan with a good guess shows more
  trueline plan cell.toml --seam-cad ring.csv --out ring           # a scan over a curve
  trueline simulate --plan plan --out scan && trueline calibrate scan

Written to the folder: path.csv (poses of the tool at the robot's rate, to be followed by `trueline scan` or any \
robot program), plan.json, sigma_over_time.csv, report.html, cell.toml and sensor.toml.

Without an [arm] in the cell's file, reach, singularities and collisions are not checked; with one, joints.csv has its joints.

Exit code: 0 planned, 1 planned but a requirement is missed, 2 no plan.")]
pub(crate) struct PlanArgs {
    /// Description of the cell; `--example` writes one with every key explained
    #[arg(required_unless_present = "example")]
    pub(crate) cell: Option<PathBuf>,
    /// Folder to write; it must be new or empty
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Plan in an example's cell: the paper's where none is named
    #[arg(
        long,
        value_name = "SENSOR",
        conflicts_with = "cell",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "camera",
        value_parser = one_of(&EXAMPLES)
    )]
    pub(crate) example: Option<Example>,
    /// Duration of the scan, s; with --want the default is the shortest sufficient one
    #[arg(long)]
    pub(crate) duration_s: Option<f64>,
    /// Longest scan that may be planned for --want, s [default: 60]
    #[arg(long, requires = "want", conflicts_with = "duration_s")]
    pub(crate) longest_s: Option<f64>,
    /// Required accuracy: sigmas of noise alone, translation=0.05mm,rotation=0.02deg,time=0.1ms, and the seam error, which includes
    /// robot, sensor and bias, seam=0.15mm (any of them)
    #[arg(long, value_name = "WHAT=SIGMA,…", value_parser = requirement::parse_want)]
    pub(crate) want: Option<Want>,
    /// Robot programs of the path to write beside it
    #[arg(long, value_delimiter = ',', value_parser = one_of(&PROGRAMS))]
    pub(crate) program: Vec<Language>,
    /// Measurement that `calibrate --use` will use; whole stripes need the plates of the seam, `[[plates]]`, in the cell's file: two that meet, a lap's,
    /// or one that ends in it
    #[arg(long = "use", value_name = "WHAT", value_parser = one_of(&MEASUREMENTS), default_value = "seam")]
    pub(crate) measurements: Measurements,
    /// Criterion: how the sigmas are combined into one number
    #[arg(long, value_parser = one_of(&CRITERIA), default_value = "worst")]
    pub(crate) criterion: Criterion,
    /// Kind of path
    #[arg(long, value_parser = one_of(&SHAPES), default_value = "auto")]
    pub(crate) shape: Shapes,
    /// A calibration whose hand-eye and line replace the cell's guess, with five times their sigma as its error
    #[arg(long)]
    pub(crate) calibration: Option<PathBuf>,
    /// Curve to scan instead of the straight seam of the cell's file: CSV (x_mm,y_mm,z_mm) or DXF in the robot's base frame, such as the result of
    /// `trueline export --as curve-dxf`. The plan takes its form as unknown
    #[arg(long, value_name = "FILE", conflicts_with = "calibration")]
    pub(crate) seam_cad: Option<PathBuf>,
    /// Seed of the search
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Paths to try for each kind of path: a quarter of them anywhere, the rest near the best of those [default: 8000; 5000 with --use stripe]
    #[arg(long)]
    pub(crate) tries: Option<usize>,
    /// Threads; one for each core if not given. The plan does not depend on it
    #[arg(long)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Print nothing but errors
    #[arg(long)]
    pub(crate) quiet: bool,
}

/// A cell's file and its sensor's.
pub(crate) type Example = (&'static str, &'static str);

/// Paths that are tried for each kind of path where stripes are measured: each costs more, and more of them find no better path.
const STRIPE_TRIES: usize = 5_000;
/// Longest scan for a requirement if the user states none, s.
const LONGEST_S: f64 = 60.0;

impl PlanArgs {
    /// Whether the duration is the stated one, not the one that the requirement needs.
    #[must_use]
    pub(crate) fn has_fixed_duration(&self) -> bool {
        self.duration_s.is_some() || self.want.is_none()
    }

    /// The request without a seam error, which depends on the cell.
    #[must_use]
    pub(crate) fn request(&self) -> PlanRequest {
        let sigmas = self.want.map(|want| want.sigmas).filter(|sigmas| *sigmas != Requirement::default());
        let usual = PlanRequest::default();
        let longest_s =
            if self.has_fixed_duration() { usual.duration_s } else { self.longest_s.unwrap_or(LONGEST_S) };
        let tries = match self.measurements {
            Measurements::Seam => usual.evaluations,
            _ => STRIPE_TRIES,
        };
        let cores = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        PlanRequest {
            duration_s: self.duration_s.unwrap_or(longest_s),
            seam: None,
            measurements: self.measurements,
            goal: Goal { want: sigmas.unwrap_or(Goal::default().want), criterion: self.criterion },
            shapes: self.shape.to_vec(),
            seed: self.seed,
            evaluations: self.tries.unwrap_or(tries),
            threads: self.threads.unwrap_or(cores).get(),
        }
    }
}

static EXAMPLES: [Choice<Example>; 2] = [
    ("camera", "The paper's: a camera and a laser", (cell_toml::EXAMPLE, cell_toml::EXAMPLE_SENSOR)),
    ("profiler", "A profiler", (cell_toml::PROFILER_EXAMPLE, cell_toml::PROFILER_EXAMPLE_SENSOR)),
];

static PROGRAMS: [Choice<Language>; 5] = [
    ("rapid", "ABB: a RAPID module (with EGM: `trueline robot-program abb`)", Language::Rapid),
    ("krl", "KUKA: a SPLINE block with times", Language::Krl),
    ("urscript", "Universal Robots: servoj along the path", Language::UrScript),
    ("ls", "FANUC: linear moves with times", Language::Ls),
    ("csv", "Waypoints and times, for any other", Language::Csv),
];

static MEASUREMENTS: [Choice<Measurements>; 2] = [
    ("seam", "The seam point of each frame", Measurements::Seam),
    ("stripe", "The whole stripes on the plates", Measurements::Stripe),
];

static CRITERIA: [Choice<Criterion>; 3] = [
    ("worst", "The largest sigma, in units of the required one", Criterion::Worst),
    ("mean", "Their root mean square (A-optimal)", Criterion::Mean),
    ("volume", "The volume of the ellipsoid of confidence (D-optimal)", Criterion::Volume),
];

/// Kinds of paths.
pub(crate) type Shapes = &'static [Shape];

static SHAPES: [Choice<Shapes>; 6] = [
    ("auto", "Whichever is best", &Shape::ALL),
    ("s", "Once along the seam, weaving", &[Shape::S]),
    ("c", "Once along the seam in one bow", &[Shape::C]),
    ("two-passes", "There and back", &[Shape::TwoPasses]),
    ("three-passes", "There, back, and there again", &[Shape::ThreePasses]),
    (
        "spun",
        "There, then back with the sensor spun by half a turn: against a bias of the feature, and worse against noise",
        &[Shape::Spun],
    ),
];
