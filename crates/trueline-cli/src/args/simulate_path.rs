//! The path of `trueline simulate`, where it is not the preset's.

use crate::args::choice::{Choice, one_of};
use crate::args::number;
use clap::Args;
use trueline_sim::{Progress, TrackedIn};

#[derive(Args)]
#[command(next_help_heading = "Path (instead of the preset's)")]
pub(crate) struct PathArgs {
    /// Frame in which the weave is laid out
    #[arg(long, value_parser = one_of(&FRAMES), conflicts_with = "plan")]
    pub(crate) weave_frame: Option<TrackedIn>,
    /// Weave along the stripe: amplitude, mm
    #[arg(long, conflicts_with = "plan", value_parser = number::travel_mm)]
    pub(crate) lateral_mm: Option<f64>,
    /// The same: frequency, Hz
    #[arg(long, conflicts_with = "plan", value_parser = number::weave_hz)]
    pub(crate) lateral_hz: Option<f64>,
    /// Change of stand-off: amplitude, mm
    #[arg(long, conflicts_with = "plan", value_parser = number::travel_mm)]
    pub(crate) range_mm: Option<f64>,
    /// The same: frequency, Hz
    #[arg(long, conflicts_with = "plan", value_parser = number::weave_hz)]
    pub(crate) range_hz: Option<f64>,
    /// Tilts: amplitude of all three, degrees
    #[arg(long, conflicts_with = "plan", value_parser = number::tilt_deg)]
    pub(crate) tilt_deg: Option<f64>,
    /// The same: frequency of all, or of work angle, travel angle and spin, Hz
    #[arg(long, value_delimiter = ',', num_args = 1..=3, value_name = "HZ[,HZ,HZ]", conflicts_with = "plan", value_parser = number::weave_hz)]
    pub(crate) tilt_hz: Vec<f64>,
    /// Length of line that is passed over, mm
    #[arg(long, conflicts_with = "plan", value_parser = number::travel_mm)]
    pub(crate) length_mm: Option<f64>,
    /// Speed along the line: constant, or at rest at the ends of each pass
    #[arg(long, value_parser = one_of(&PROGRESS), conflicts_with = "plan")]
    pub(crate) progress: Option<Progress>,
    /// Passes over the line, there and back
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=100), conflicts_with = "plan")]
    pub(crate) passes: Option<u32>,
    /// Spin of the sensor about its view from pass to pass, degrees
    #[arg(long, conflicts_with = "plan", value_parser = number::turn_deg)]
    pub(crate) spin_by_pass_deg: Option<f64>,
}

static FRAMES: [Choice<TrackedIn>; 2] = [
    (
        "sensor",
        "The weave is in the laser plane: tilts do not change the path of the seam in the view",
        TrackedIn::Sensor,
    ),
    ("base", "The weave is in base, and the tilts turn the sensor in place", TrackedIn::Base),
];

static PROGRESS: [Choice<Progress>; 2] = [
    ("even", "Constant speed", Progress::Even),
    ("eased", "Each pass starts and ends at rest", Progress::Eased),
];
