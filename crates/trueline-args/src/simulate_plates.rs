//! `trueline simulate --plates`.

use crate::number;
use clap::Args;

#[derive(Args)]
#[group(id = "of_plates")]
pub struct PlatesArgs {
    /// Whole stripes on two plates: a camera gives stripes.csv and features.csv, a profiler profiles.csv
    #[arg(long, conflicts_with_all = ["images", "plan", "faults", "production"])]
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
