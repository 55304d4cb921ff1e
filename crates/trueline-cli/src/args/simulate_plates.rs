//! `trueline simulate --plates`.

use crate::args::number;
use crate::args::simulated_profiles::ProfileLookArgs;
use clap::Args;
use trueline_dataset::ProfileForm;
use trueline_sim::{PlateForm, PlatePair, Plates, ProfileLook};

#[derive(Args)]
#[group(id = "of_plates")]
pub(crate) struct PlatesArgs {
    /// Whole stripes on two plates: a camera gives stripes.csv and features.csv, a profiler profiles.csv. With --production each weld
    /// has them; with --plan they are those of the plan's cell; with --seam the profiler gives stripes.csv and features.csv
    #[arg(long, conflicts_with_all = ["images", "faults"])]
    pub(crate) plates: bool,
    /// Bow of both plates across and along, mm at 25 mm from the seam and 100 mm along it
    #[arg(long, requires = "plates", default_value_t = 0.0, allow_hyphen_values = true, value_parser = number::any)]
    pub(crate) bow_mm: f64,
    /// Twist of both plates, mm likewise
    #[arg(long, requires = "plates", default_value_t = 0.0, allow_hyphen_values = true, value_parser = number::any)]
    pub(crate) twist_mm: f64,
    /// Roughness, one standard deviation, mm
    #[arg(long, requires = "plates", default_value_t = 0.0, value_parser = number::zero_or_more)]
    pub(crate) roughness_mm: f64,
    /// Angle between the plates, degrees [default: 90]
    #[arg(long, requires = "plates", conflicts_with = "plan", value_parser = number::opening_deg)]
    pub(crate) plates_deg: Option<f64>,
    /// A lap: parallel plates, the second lower by this, mm; the seam is the edge of the first
    #[arg(long, requires = "plates", conflicts_with_all = ["plan", "production", "plates_deg"], value_parser = number::above_zero)]
    pub(crate) step_mm: Option<f64>,
    /// One plate alone; the seam is its edge
    #[arg(long, requires = "plates", conflicts_with_all = ["plan", "production", "plates_deg", "step_mm"])]
    pub(crate) one_plate: bool,
    /// Two plates with a gap of this width between them, mm; the seam is its middle
    #[arg(long, requires = "plates", conflicts_with_all = ["plan", "production", "plates_deg", "step_mm", "one_plate"], value_parser = number::above_zero)]
    pub(crate) gap_mm: Option<f64>,
    /// Height step of the second plate beside a gap, mm; the seam is at the mean height
    #[arg(long, requires = "gap_mm", default_value_t = 0.0, allow_hyphen_values = true, value_parser = number::any)]
    pub(crate) mismatch_mm: f64,
    /// Noise of the stripe in one column of a picture, px [default: 0.5; with --plan the cell's feature_px]
    #[arg(long, requires = "plates", value_parser = number::above_zero)]
    pub(crate) column_noise_px: Option<f64>,
    /// A profiler's profiles as profiles.parquet instead of profiles.csv
    #[arg(long, requires = "plates", conflicts_with = "production")]
    pub(crate) parquet: bool,
    #[command(flatten)]
    pub(crate) look: ProfileLookArgs,
}

/// Rest of the stripe's noise if none is wanted, px: the weight of a column is finite.
const NOISE_FREE_PX: f64 = 1e-6;

impl PlatesArgs {
    /// The form in which profiles are written.
    pub(crate) fn profile_form(&self) -> ProfileForm {
        if self.parquet { ProfileForm::Parquet } else { ProfileForm::Csv }
    }

    /// How profiles look with ranges of a noise, m.
    pub(crate) fn profile_look(&self, range_sigma_m: f64, noise_free: bool) -> ProfileLook {
        let usual = ProfileLook::default();
        let usual = if noise_free { usual.without_noise() } else { usual };
        self.look.look(ProfileLook { range_sigma_m, ..usual })
    }

    /// The plates; unstated properties are as in `usual`.
    pub(crate) fn plates(&self, usual: Plates, noise_free: bool) -> Plates {
        let form = PlateForm {
            across: self.bow_mm * 1e-3,
            along: self.bow_mm * 1e-3,
            twist: self.twist_mm * 1e-3,
            ..PlateForm::default()
        };
        Plates {
            pair: self.pair().unwrap_or(usual.pair),
            opening_rad: self.plates_deg.map_or(usual.opening_rad, f64::to_radians),
            forms: [form; 2],
            roughness_m: self.roughness_mm * 1e-3,
            column_sigma_px: self.column_noise_px.unwrap_or(if noise_free {
                NOISE_FREE_PX
            } else {
                usual.column_sigma_px
            }),
            edge_sigma_px: if noise_free { NOISE_FREE_PX } else { usual.edge_sigma_px },
            ..usual
        }
    }

    /// The stated joint of the plates.
    pub(crate) fn pair(&self) -> Option<PlatePair> {
        let lap = self.step_mm.map(|step_mm| PlatePair::Lap { step_m: step_mm * 1e-3 });
        let mismatch_m = self.mismatch_mm * 1e-3;
        let butt = || self.gap_mm.map(|gap_mm| PlatePair::Butt { gap_m: gap_mm * 1e-3, mismatch_m });
        lap.or_else(butt).or_else(|| self.one_plate.then_some(PlatePair::Edge))
    }
}
