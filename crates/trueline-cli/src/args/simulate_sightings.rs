//! `trueline simulate --sightings`.

use crate::args::choice::{Choice, one_of};
use crate::args::seam_scan_options::SEAM_SCAN_OPTIONS;
use clap::Args;
use trueline_dataset::sensor_setup::Mounted;
use trueline_sim::{PoseMotion, RoundScan, RoundTarget, SightingNoise, SightingScan};

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
        conflicts_with_all = not_of_sightings(),
        group = "readings"
    )]
    pub(crate) sightings: Option<PoseMotion>,
    /// Write robot.csv and profiles.csv of a sphere or a cylinder on a table instead
    #[arg(long, value_parser = one_of(&TARGETS), conflicts_with_all = not_of_sightings(), group = "readings")]
    pub(crate) target: Option<RoundTarget>,
    /// Its radius, mm
    #[arg(long, value_name = "MM", default_value_t = 20.0, value_parser = radius_mm, requires = "target")]
    pub(crate) radius_mm: f64,
    /// How the robot moves before it
    #[arg(long, value_parser = one_of(&MOTIONS), default_value = "full", requires = "target")]
    pub(crate) motion: PoseMotion,
    /// Number of sightings, or of profiles of a target [default: 300, at stops 24]
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(4..=20_000), requires = "readings")]
    pub(crate) sighting_count: Option<u32>,
    /// The robot stands at each sighting or profile: poses.csv in the place of robot.csv, and no time offset
    #[arg(long, requires = "readings", conflicts_with = "time_offset_ms")]
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

/// Radii of targets that fit into a profiler's view.
fn radius_mm(text: &str) -> Result<f64, String> {
    let within = |mm: &f64| (5.0..=30.0).contains(mm);
    text.parse().ok().filter(within).ok_or_else(|| "expected a radius from 5 to 30 mm".to_owned())
}

static TARGETS: [Choice<RoundTarget>; 2] =
    [("sphere", "A sphere", RoundTarget::Sphere), ("cylinder", "A cylinder", RoundTarget::Cylinder)];

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
    /// The recording of sightings that is asked for, if one is.
    pub(crate) fn scan(&self, shared: &Shared) -> Option<SightingScan> {
        let motion = self.sightings?;
        let seed = shared.seed;
        let usual = if self.stops { SightingScan::at_stops(seed) } else { SightingScan::usual(seed) };
        let noise = match (shared.noise_free, self.state_noise) {
            (true, _) => SightingNoise::NONE,
            (false, true) => SightingNoise::even(STATED[0], STATED[1]),
            (false, false) => usual.noise,
        };
        let states_noise = self.state_noise && !shared.noise_free;
        Some(self.with_shared(shared, SightingScan { motion, noise, states_noise, ..usual }))
    }

    /// The recording of profiles of a round target that is asked for, if one is.
    pub(crate) fn round_scan(&self, shared: &Shared) -> Option<RoundScan> {
        let radius_m = self.radius_mm * 1e-3;
        let mut scan = RoundScan::usual(self.target?, radius_m, self.stops, shared.seed).moving(self.motion);
        if shared.noise_free {
            scan.noise_m = 0.0;
        }
        scan.sighted = self.with_shared(shared, scan.sighted);
        Some(scan)
    }

    /// What both have in common.
    fn with_shared(&self, shared: &Shared, usual: SightingScan) -> SightingScan {
        let [position_m, attitude_rad] = if shared.noise_free { [0.0; 2] } else { usual.robot_noise };
        SightingScan {
            robot_noise: [shared.robot_noise_m.unwrap_or(position_m), attitude_rad],
            time_offset_s: shared.time_offset_s.unwrap_or(usual.time_offset_s),
            count: self.sighting_count.unwrap_or(usual.count),
            mounted: if self.wall { Mounted::Fixed } else { Mounted::Tool },
            outliers: shared.outliers.unwrap_or(usual.outliers),
            jitter_s: shared.jitter_s.unwrap_or(usual.jitter_s),
            ..usual
        }
    }
}
