//! Profiles of a sphere or a cylinder on a table, before a profiler on the robot, or beside it: cast forward, with truth.
//!
//! The chain is that of sightings: where the target is before the sensor is given, and each column of the profile is a ray to the nearest
//! surface in the sheet.

use crate::noise::Noise;
use crate::sightings::{PoseMotion, Sighted, SightingNoise, SightingScan, ViewSize};
use nalgebra::Vector3;
use std::path::Path;
use trueline_dataset::round_folder;
use trueline_dataset::{Error, Profile, ProfilePoint};
use trueline_geometry::Pose;

/// Half the width of the field of view, and the distance between columns, m.
const HALF_WIDTH_M: f64 = 0.04;
const COLUMN_M: f64 = 0.25e-3;
/// A surface is seen where its normal leans by less than this cosine from the ray.
const LEAST_COSINE: f64 = 0.3;
/// The table is not seen within so many radii of the target.
const SHADOW: f64 = 1.2;
/// Distance of the target from the sensor, m.
const DISTANCE_M: f64 = 0.13;
/// Part of its radius by which a sphere swings across the sheet.
const ACROSS: f64 = 0.55;
/// How far a cylinder swings along its axis, m.
const ALONG_M: f64 = 0.06;

/// What stands on the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoundTarget {
    /// A sphere about the target's origin.
    Sphere,
    /// A cylinder about the target's y axis.
    Cylinder,
}

/// A recording of profiles of a round target.
#[derive(Clone, Debug, PartialEq)]
pub struct RoundScan {
    /// What stands there.
    pub target: RoundTarget,
    /// Its radius, m.
    pub radius_m: f64,
    /// Noise of a point along the range, m.
    pub noise_m: f64,
    /// How the target moves before the sensor, robot, stamps and outliers.
    pub sighted: SightingScan,
}

/// What was cast.
#[derive(Clone, Debug)]
pub struct RoundScanned {
    /// The profiles.
    pub profiles: Vec<Profile>,
    /// Robot, truth and which profiles are wrong.
    pub sighted: Sighted,
}

impl RoundScan {
    /// A target before a profiler at 15 Hz for 20 s, 17.73 ms late; or at 24 stops.
    #[must_use]
    pub fn usual(target: RoundTarget, radius_m: f64, at_stops: bool, seed: u64) -> Self {
        let usual = if at_stops { SightingScan::at_stops(seed) } else { SightingScan::usual(seed) };
        let view = ViewSize {
            distance_m: DISTANCE_M,
            swing_m: [
                0.012,
                match target {
                    RoundTarget::Sphere => ACROSS * radius_m,
                    RoundTarget::Cylinder => ALONG_M,
                },
                0.02,
            ],
            swing_rad: [0.3, 0.3, 0.45],
            even_m_s: [0.0005, 0.0005, 0.001],
            even_rad_s: 0.02,
            wrong: [0.0, 0.3 * radius_m],
        };
        Self {
            target,
            radius_m,
            noise_m: 0.02e-3,
            sighted: SightingScan { view, noise: SightingNoise::NONE, ..usual },
        }
    }

    /// The same with another motion.
    #[must_use]
    pub fn moving(mut self, motion: PoseMotion) -> Self {
        self.sighted.motion = motion;
        self
    }

    /// Casts it.
    #[must_use]
    pub fn cast(&self) -> RoundScanned {
        let sighted = self.sighted.cast();
        let mut noise = Noise::new(self.sighted.seed, 6);
        let profile = |(k, sighting): (usize, &trueline_dataset::Sighting)| Profile {
            stamp_ns: sighting.stamp_ns,
            frame: Some(k as u64),
            points: self.profile(&sighting.camera_from_target, &mut noise),
        };
        let profiles = sighted.sightings.iter().enumerate().map(profile).collect();
        RoundScanned { profiles, sighted }
    }

    fn profile(&self, camera_from_target: &Pose, noise: &mut Noise) -> Vec<ProfilePoint> {
        let columns = (2.0 * HALF_WIDTH_M / COLUMN_M).round() as i32;
        let point = |column: i32| {
            let x_m = f64::from(column) * COLUMN_M - HALF_WIDTH_M;
            let z_m = self.range(camera_from_target, x_m)? + noise.normal(self.noise_m);
            Some(ProfilePoint { x_m, z_m, intensity: None })
        };
        (0..=columns).filter_map(point).collect()
    }

    /// Range of the nearest surface in the sheet y = 0 at a column, m; `None` where it is seen too flatly, or lies in the target's shadow.
    fn range(&self, camera_from_target: &Pose, x_m: f64) -> Option<f64> {
        let axis = match self.target {
            RoundTarget::Sphere => Vector3::zeros(),
            RoundTarget::Cylinder => camera_from_target.rotation * Vector3::y(),
        };
        // Of a point (x, 0, z) from the centre what is square to the axis has the length of the radius.
        let from = Vector3::new(x_m, 0.0, 0.0) - camera_from_target.translation.vector;
        let square = |v: Vector3<f64>| v - axis * axis.dot(&v);
        let (across, along) = (square(from), square(Vector3::z()));
        let (a, b) = (along.norm_squared(), along.dot(&across));
        let reach = b * b - a * (across.norm_squared() - self.radius_m.powi(2));
        if reach > 0.0 {
            let z_m = (-b - reach.sqrt()) / a;
            let normal = (across + along * z_m) / self.radius_m;
            return (-normal.z > LEAST_COSINE).then_some(z_m);
        }
        let beside = (across.norm_squared() - b * b / a).sqrt() > SHADOW * self.radius_m;
        self.table(camera_from_target, x_m).filter(|_| beside)
    }

    /// Range of the table, which the target lies on, m.
    fn table(&self, camera_from_target: &Pose, x_m: f64) -> Option<f64> {
        let normal = camera_from_target.rotation * Vector3::z();
        let from = Vector3::new(x_m, 0.0, 0.0) - camera_from_target.translation.vector;
        (normal.z > LEAST_COSINE).then(|| (self.radius_m - normal.dot(&from)) / normal.z)
    }
}

impl RoundScanned {
    /// Writes the dataset into a folder that exists.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let robot = (&self.sighted.robot[..], self.sighted.at_stops);
        round_folder::write(folder, &self.sighted.setup, robot, &self.profiles, &self.sighted.truth)
    }
}
