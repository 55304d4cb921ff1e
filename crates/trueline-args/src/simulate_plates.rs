//! `trueline simulate --plates`.

use crate::number;
use clap::Args;
use trueline_sim::{PlateForm, Plates};

#[derive(Args)]
#[group(id = "of_plates")]
pub struct PlatesArgs {
    /// Whole stripes on two plates: a camera gives stripes.csv and features.csv, a profiler profiles.csv. With --production each weld
    /// has them
    #[arg(long, conflicts_with_all = ["images", "plan", "faults"])]
    pub plates: bool,
    /// Bow of both plates across and along, mm at 25 mm from the seam and 100 mm along it
    #[arg(long, requires = "plates", default_value_t = 0.0, allow_hyphen_values = true, value_parser = number::any)]
    pub bow_mm: f64,
    /// Twist of both plates, mm likewise
    #[arg(long, requires = "plates", default_value_t = 0.0, allow_hyphen_values = true, value_parser = number::any)]
    pub twist_mm: f64,
    /// Roughness, one standard deviation, mm
    #[arg(long, requires = "plates", default_value_t = 0.0, value_parser = number::zero_or_more)]
    pub roughness_mm: f64,
    /// Angle between the plates, degrees
    #[arg(long, requires = "plates", default_value_t = 90.0, value_parser = number::opening_deg)]
    pub plates_deg: f64,
    /// Noise of the stripe in one column of a picture, px
    #[arg(long, requires = "plates", default_value_t = 0.5, value_parser = number::above_zero)]
    pub column_noise_px: f64,
}

/// What is left of the stripe's noise where there is to be none, px: the weight of a column is finite.
const NOISE_FREE_PX: f64 = 1e-6;

impl PlatesArgs {
    /// The plates.
    pub fn plates(&self, noise_free: bool) -> Plates {
        let form = PlateForm {
            across: self.bow_mm * 1e-3,
            along: self.bow_mm * 1e-3,
            twist: self.twist_mm * 1e-3,
            ..PlateForm::default()
        };
        Plates {
            opening_rad: self.plates_deg.to_radians(),
            forms: [form; 2],
            roughness_m: self.roughness_mm * 1e-3,
            column_sigma_px: if noise_free { NOISE_FREE_PX } else { self.column_noise_px },
            ..Plates::default()
        }
    }
}
