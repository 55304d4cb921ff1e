//! `trueline simulate --sightings`.

use crate::args::choice::{Choice, one_of};
use crate::args::seam_scan_options::SEAM_SCAN_OPTIONS;
use clap::Args;
use trueline_dataset::sensor_setup::Mounted;
use trueline_sim::{PoseMotion, SightingNoise, SightingScan};

#[derive(Args)]
#[group(id = "of_sightings")]
#[command(next_help_heading = "Sightings of a target's pose (instead of a scan of a seam)")]
pub(crate) struct SightingsArgs {
    /// Write robot.csv and the poses of a marker as a camera reports them, sightings.csv, from a robot that moves like this
    #[arg(
        long,
        value_name = "MOTION",
        num_args = 0..=1,
        default_missing_value = "full",
        value_parser = one_of(&MOTIONS),
        conflicts_with_all = not_of_sightings()
    )]
    pub(crate) sightings: Option<PoseMotion>,
    /// Number of sightings [default: 300, at stops 24]
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(4..=20_000), requires = "sightings")]
    pub(crate) sighting_count: Option<u32>,
    /// The robot stands at each sighting: poses.csv in the place of robot.csv, and no time offset
    #[arg(long, requires = "sightings", conflicts_with = "time_offset_ms")]
    pub(crate) stops: bool,
    /// The sensor stands beside the robot, which carries the marker, or the part with its seam
    #[arg(long, conflicts_with_all = ["plan", "images", "plates", "production", "boards", "shop", "seam", "axes", "sensors"])]
    pub(crate) wall: bool,
    /// State the noise of each sighting: sigma_mm and sigma_deg, the same for all axes
    #[arg(long, requires = "sightings")]
    pub(crate) state_noise: bool,
}

/// Noise of a sighting that is stated, per axis: m and rad.
const STATED: [f64; 2] = [0.3e-3, 2e-3];

static MOTIONS: [Choice<PoseMotion>; 4] = [
    ("full", "Turns and shifts about all axes", PoseMotion::Full),
    ("one-axis", "Turns about one axis: the translation along it cannot be determined", PoseMotion::OneAxis),
    ("shifts", "Shifts without a turn: no translation can be determined", PoseMotion::Shifts),
    ("even", "Turns and shifts evenly: the time offset cannot be determined", PoseMotion::Even),
];

/// Options of scans of a seam that do not apply to sightings.
fn not_of_sightings() -> Vec<&'static str> {
    let shared = ["noise_free", "robot_noise_mm", "stamp_jitter_ms", "outliers"];
    let of_seams = SEAM_SCAN_OPTIONS.into_iter().filter(|option| !shared.contains(option));
    of_seams.chain(["plates", "production", "boards", "shop", "images", "column_noise_px"]).collect()
}

/// Other options of `simulate` about sightings, in SI.
pub(crate) struct Shared {
    pub(crate) seed: u64,
    pub(crate) noise_free: bool,
    pub(crate) time_offset_s: Option<f64>,
    pub(crate) outliers: Option<f64>,
    pub(crate) robot_noise_m: Option<f64>,
    pub(crate) jitter_s: Option<f64>,
}

impl SightingsArgs {
    /// The recording that is asked for, if one is.
    pub(crate) fn scan(&self, shared: &Shared) -> Option<SightingScan> {
        let motion = self.sightings?;
        let seed = shared.seed;
        let usual = if self.stops { SightingScan::at_stops(seed) } else { SightingScan::usual(seed) };
        let noise = match (shared.noise_free, self.state_noise) {
            (true, _) => SightingNoise::NONE,
            (false, true) => SightingNoise::even(STATED[0], STATED[1]),
            (false, false) => usual.noise,
        };
        let [position_m, attitude_rad] = if shared.noise_free { [0.0; 2] } else { usual.robot_noise };
        Some(SightingScan {
            motion,
            noise,
            states_noise: self.state_noise && !shared.noise_free,
            robot_noise: [shared.robot_noise_m.unwrap_or(position_m), attitude_rad],
            time_offset_s: shared.time_offset_s.unwrap_or(usual.time_offset_s),
            count: self.sighting_count.unwrap_or(usual.count),
            mounted: if self.wall { Mounted::Fixed } else { Mounted::Tool },
            outliers: shared.outliers.unwrap_or(usual.outliers),
            jitter_s: shared.jitter_s.unwrap_or(usual.jitter_s),
            ..usual
        })
    }
}
