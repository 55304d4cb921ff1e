//! `trueline diff`.

use crate::args::requirement::length_m;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline diff monday.json today.json
  trueline diff monday.json today.json --speed-mm-s 20 --stand-off-mm 180 --json -

Reports whether the difference is within the noise, or what has moved and by how much at the seam: over a \
field of the laser plane around the stand-off, at the working speed.

Exit code: 0 the same, or moved by less than the tolerance, 1 moved, or one was \
not accepted, 2 could not be compared.")]
pub(crate) struct DiffArgs {
    /// The JSON of `trueline calibrate --json`
    pub(crate) first: PathBuf,
    /// The same for the later calibration of the same sensor
    pub(crate) second: PathBuf,
    /// Distance of the seam from the sensor, mm [default: that of the first result]
    #[arg(long)]
    pub(crate) stand_off_mm: Option<f64>,
    /// Width of the field along the stripe, mm
    #[arg(long, default_value_t = 60.0)]
    pub(crate) width_mm: f64,
    /// Depth of the field, mm
    #[arg(long, default_value_t = 40.0)]
    pub(crate) depth_mm: f64,
    /// Speed along the seam, mm/s [default: that of the first result]
    #[arg(long)]
    pub(crate) speed_mm_s: Option<f64>,
    /// Tolerated displacement of the seam: 0.2mm; exit 0 below it
    #[arg(long, value_name = "LENGTH", value_parser = length_m)]
    pub(crate) tolerance: Option<f64>,
    /// Write the difference as JSON; - is stdout
    #[arg(long)]
    pub(crate) json: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub(crate) quiet: bool,
}
