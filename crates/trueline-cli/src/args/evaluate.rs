//! `trueline evaluate` and `trueline reproduce`.

use crate::args::choice::{Choice, one_of};
use crate::args::number;
use crate::args::requirement::length_m;
use clap::Args;
use std::path::PathBuf;
use trueline_method::evaluate::evaluation::NEEDED_COVERAGE;
use trueline_method::evaluate::reference_curve::Form;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline evaluate weld-scan --calibration result.json
  trueline evaluate weld-scan --calibration result.json --reference taught.csv --report weld.html
  trueline evaluate weld-scan --calibration result.json --tolerance 0.5mm
  trueline evaluate weld-scan --calibration result.json --static stops
  trueline evaluate scan --calibration initial.toml --reference scan/truth.toml --json -

A reference is a CSV of points along the seam (x_mm,y_mm,z_mm in base), or a TOML with [[lines]] (point_mm, direction) or \
[circle] (centre_mm, axis, radius_mm). --static is a scan of the same seam in which the robot stands still for a second at one \
point after the other: the time offset has no effect there, so every cell can record such a reference. \
    Without either, the best-fit line, circle or plane is used; for a calibration over a curved seam, its \
    curve.

A calibration of another cell, or of a sensor that has moved since, is detected: the scan is calibrated by \
itself and compared.

Exit code: 0 evaluated, 1 beyond the tolerance, or the calibration does not \
belong to this scan or was not accepted, 2 could not run.")]
pub(crate) struct EvaluateArgs {
    /// Dataset folder
    pub(crate) dataset: PathBuf,
    /// Calibration to evaluate: the JSON of `trueline calibrate --json`, or a TOML like initial.toml
    #[arg(long)]
    pub(crate) calibration: PathBuf,
    /// The seam's true form
    #[arg(long)]
    pub(crate) reference: Option<PathBuf>,
    /// Tolerance for a point: 0.5mm; exit 1 unless 95 % of the points are within it. Features without a point count as outside
    #[arg(long, value_name = "LENGTH", value_parser = length_m)]
    pub(crate) tolerance: Option<f64>,
    /// With --tolerance: share of the scan's points that the reference must cover, %; state less for a reference that is short on
    /// purpose
    #[arg(long, value_name = "PERCENT", default_value_t = 100.0 * NEEDED_COVERAGE, value_parser = number::percent, requires = "tolerance")]
    pub(crate) coverage_percent: f64,
    /// A scan of the same seam with stops: the points measured at standstill are the truth
    #[arg(long = "static", value_name = "SCAN", conflicts_with = "reference")]
    pub(crate) static_scan: Option<PathBuf>,
    /// Form to fit without a reference
    #[arg(long, value_parser = one_of(&FORMS), default_value = "auto", conflicts_with_all = ["reference", "static_scan"])]
    pub(crate) fit: Form,
    /// Write the figures as JSON; - is stdout
    #[arg(long)]
    pub(crate) json: Option<PathBuf>,
    /// Write every point with its error as CSV; time_s is the true exposure by the robot's clock, as `apply` writes it
    #[arg(long)]
    pub(crate) csv: Option<PathBuf>,
    /// Write a report that opens in a browser
    #[arg(long)]
    pub(crate) report: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub(crate) quiet: bool,
}

static FORMS: [Choice<Form>; 4] = [
    ("auto", "The simplest that fits the points", Form::Auto),
    ("line", "A straight line", Form::Line),
    ("circle", "A circle", Form::Circle),
    ("plane", "A plane: only the distance from it counts", Form::Plane),
];

#[derive(Args)]
#[command(after_help = "Example:
  trueline reproduce --out paper

Written to the folder: report.html, tables.md, convergence.csv, welds.csv, straight_weld_points.csv, \
c_type_weld_points.csv, speeds.csv. The same seed gives the same numbers. It takes some seconds.")]
pub(crate) struct ReproduceArgs {
    /// Folder to write; it must be new or empty
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// First seed
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Calibrations and weld scans behind every figure
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) repeats: u64,
    /// Print nothing but errors
    #[arg(long)]
    pub(crate) quiet: bool,
}
