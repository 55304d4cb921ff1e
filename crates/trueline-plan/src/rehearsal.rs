//! A planned scan, calibrated before it is made: what the estimator itself says of it, with everything that it accounts for.
//!
//! The scan is cast at the guess, from the same sights that the prediction is made of, with the noise expected; where the guess
//! is right it is what will be recorded. That is no test of the estimator, but an answer to what no sum over frames tells: the
//! seam error with robot, sensor and bias, and whether another time offset or a turned sensor would explain the scan as well.

use crate::cell::Cell;
use crate::motion::Motion;
use crate::prediction::{Sight, Sights};
use crate::truth::Truth;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::BTreeMap;
use trueline_dataset::{Feature, Measured, Recording, RobotSample, Sensor, SensorSetup};
use trueline_geometry::so3;
use trueline_method::assess::seam_error::SeamError;
use trueline_method::hypotheses::ambiguity::RunnerUp;
use trueline_method::problem::parameters::LINES;
use trueline_method::{Config, Status, calibrate};

/// What a calibration of the planned scan says.
#[derive(Clone, Debug)]
pub struct Rehearsal {
    /// Whether it would be accepted.
    pub accepted: bool,
    /// How far off a seam point will be that is measured later.
    pub seam_error: Option<SeamError>,
    /// Standard deviation of time offset and hand-eye with robot, sensor and bias, in SI units.
    pub sigma: [Option<f64>; LINES],
    /// The most dangerous other answer.
    pub runner_up: Option<RunnerUp>,
}

/// An alias explains at least this part of the features.
const ALIAS: f64 = 0.2;

impl Rehearsal {
    /// Whether another answer explains so much that a scan with some outliers may be taken for it.
    #[must_use]
    pub fn has_alias(&self) -> bool {
        self.runner_up.is_some_and(|rival| rival.test.explains >= ALIAS)
    }
}

/// Seed of the noise.
const SEED: u64 = 1;

/// Calibrates a motion's scan at the guess; `None` if the scan is too short for it, or a sensor's features cannot be made.
#[must_use]
pub fn rehearse(cell: &Cell, setup: &SensorSetup, motion: &Motion) -> Option<Rehearsal> {
    let recording = cast(cell, setup, motion)?;
    let found = calibrate(&recording, None, &Config::default()).ok()?;
    let checks = &found.findings.checks;
    Some(Rehearsal {
        accepted: found.status() == Status::Accepted,
        seam_error: checks.seam_error,
        sigma: std::array::from_fn(|component| found.sigma(component)),
        runner_up: checks.ambiguity.runner_up,
    })
}

fn cast(cell: &Cell, setup: &SensorSetup, motion: &Motion) -> Option<Recording> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let sights = Sights::of(cell, motion, &Truth::guessed(cell)?, 1)?;
    let nanoseconds = |time_s: f64| (time_s * 1e9).round() as i64;
    let robot = motion.sampled(cell.robot_period_s).into_iter().enumerate().map(|(k, mut pose)| {
        let off = Vector3::from_fn(|_, _| normal() * cell.noise.robot_m);
        let turn = Vector3::from_fn(|_, _| normal() * cell.noise.robot_rad);
        pose.translation.vector += off;
        pose.rotation = so3::exp(&turn) * pose.rotation;
        RobotSample {
            stamp_ns: nanoseconds(k as f64 * cell.robot_period_s),
            device_ns: None,
            base_from_tool: pose,
        }
    });
    let robot = robot.collect();
    let mut features = Vec::with_capacity(sights.list.len());
    for sight in &sights.list {
        let measured = measured(cell, sight, [normal(), normal()])?;
        let stamp_ns = nanoseconds(sight.time_s + normal() * cell.noise.stamp_s);
        features.push(Feature { stamp_ns, line: 0, frame: None, device_ns: None, measured, sigma: None });
    }
    features.sort_by_key(|feature| feature.stamp_ns);
    Some(Recording {
        sensor: cell.sensor.clone(),
        setup: setup.clone(),
        robot,
        features,
        stripes: Vec::new(),
        initial: None,
        truth: None,
        inputs: BTreeMap::new(),
    })
}

/// What the sensor reports of a sight; `None` if its camera does not see the point.
fn measured(cell: &Cell, sight: &Sight, normal: [f64; 2]) -> Option<Measured> {
    let at = sight.point_in_camera;
    let in_sheet = at + cell.sheet.axes() * nalgebra::Vector2::from(normal) * cell.noise.feature_m;
    match &cell.sensor {
        Sensor::CameraLaser { camera, .. } => {
            let pixel = camera.project(&at)?;
            Some(Measured::Pixel([0, 1].map(|k| pixel[k] + normal[k] * cell.noise.feature_px)))
        }
        Sensor::Profiler => Some(Measured::Profile([in_sheet.x, in_sheet.z])),
        Sensor::Points { .. } => Some(Measured::Point(in_sheet.into())),
    }
}
