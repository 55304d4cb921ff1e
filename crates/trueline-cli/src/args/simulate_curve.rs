//! `trueline simulate --seam`.

use crate::args::choice::{Choice, one_of};
use crate::args::number;
use crate::args::part_moves::part_moves;
use crate::args::seam_scan_options::SEAM_SCAN_OPTIONS;
use crate::args::simulate_shop::DRAWN_PLATES;
use clap::Args;
use trueline_method::PartMoves;
use trueline_sim::curves::{BesideCurve, CurveKind, CurveScan};

#[derive(Args)]
#[group(id = "of_curves")]
#[command(next_help_heading = "Curved seams (a profiler follows the seam)")]
pub(crate) struct CurveArgs {
    /// Write a scan over this seam and points of the true curve, truth_curve.csv
    #[arg(long, value_name = "FORM", value_parser = one_of(&FORMS), conflicts_with_all = not_of_curves())]
    pub(crate) seam: Option<CurveKind>,
    /// Number of passes over the seam [default: 3, over a closed seam 2]
    #[arg(long, value_parser = number::passes, requires = "seam")]
    pub(crate) seam_passes: Option<f64>,
    /// Amplitude of the tilts about three axes, degrees [default: 18]
    #[arg(long, value_name = "DEG", value_parser = number::tilt_deg, requires = "seam")]
    pub(crate) seam_tilt_deg: Option<f64>,
    /// Frequency of a weave of ±3 mm across the seam, Hz
    #[arg(long, value_name = "HZ", value_parser = number::weave_hz, requires = "seam")]
    pub(crate) seam_weave_hz: Option<f64>,
    /// Scatter of the part's place between passes: one sigma of the shift along each axis, mm, and of the turn about it, degrees
    /// [default of the turn: 0.1]
    #[arg(long, value_name = "MM[,DEG]", value_parser = part_moves, requires = "seam")]
    pub(crate) seam_part_moves: Option<PartMoves>,
}

static FORMS: [Choice<CurveKind>; 8] = [
    ("straight", "A line, 220 mm long", CurveKind::Straight),
    ("arc", "An arc of 60°, radius 280 mm", CurveKind::Arc),
    ("pipe", "A whole pipe, radius 50 mm", CurveKind::Pipe),
    ("saddle", "A pipe on a pipe, radius 45 mm", CurveKind::Saddle),
    ("corner", "Two lines and a corner of radius 12 mm", CurveKind::Corner),
    ("wavy", "A line with waves of 6 mm", CurveKind::Wavy),
    ("free", "A curve in space", CurveKind::Free),
    ("eight", "A closed figure eight that crosses itself", CurveKind::Eight),
];

/// Options of scans of a straight seam that do not apply to a curve.
fn not_of_curves() -> Vec<&'static str> {
    let shared = ["noise_free", "robot_noise_mm", "feature_noise_mm", "outliers", "duration_s"];
    let of_seams = SEAM_SCAN_OPTIONS.into_iter().filter(|option| !shared.contains(option));
    let of_others = ["production", "boards", "shop", "images", "sightings", "time_offset_ms"];
    of_seams.chain(of_others).chain(DRAWN_PLATES).collect()
}

/// Other options of `simulate` about the scan, in SI.
pub(crate) struct Shared {
    pub(crate) noise_free: bool,
    pub(crate) duration_s: Option<f64>,
    pub(crate) outliers: Option<f64>,
    pub(crate) feature_noise_m: Option<f64>,
    pub(crate) robot_noise_m: Option<f64>,
    pub(crate) has_plates: bool,
}

impl CurveArgs {
    /// The scan that is asked for, if one is.
    pub(crate) fn scan(&self, shared: &Shared) -> Option<CurveScan> {
        let good = CurveScan::good(self.seam?);
        let usual = if shared.noise_free { good.exact() } else { good };
        Some(CurveScan {
            passes: self.seam_passes.unwrap_or(usual.passes),
            tilt_rad: self.seam_tilt_deg.map_or(usual.tilt_rad, f64::to_radians),
            weave_hz: self.seam_weave_hz.unwrap_or(usual.weave_hz),
            part_moves: self
                .seam_part_moves
                .map_or(usual.part_moves, |moves| [moves.shift_m, moves.turn_rad]),
            lasts_s: shared.duration_s.unwrap_or(usual.lasts_s),
            outliers: shared.outliers.unwrap_or(usual.outliers),
            noise_m: shared.feature_noise_m.unwrap_or(usual.noise_m),
            robot_noise_m: shared.robot_noise_m.unwrap_or(usual.robot_noise_m),
            plates: shared.has_plates.then(BesideCurve::default),
            ..usual
        })
    }
}
