//! Calibration of a planned scan before it is made, by the estimator itself with all its error sources.
//!
//! The scan is cast at the guess, from the same sights as the prediction, with the expected noise. For a right guess it is
//! the future recording. This does not test the estimator, but gives results that a sum over frames cannot: the seam error
//! with robot, sensor and bias, and whether another time offset or a turned sensor would explain the scan as well.

use crate::cell::Cell;
use crate::design::{DIMENSION, from_unit_box};
use crate::joint::Joint;
use crate::motion::Motion;
use crate::predicted_frames::{PredictedFrame, PredictedFrames};
use crate::shape::Shape;
use crate::stripes_ahead::stripes_of;
use crate::truth::Truth;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use trueline_dataset::{Feature, Measured, Recording, RobotSample, Sensor, SensorSetup};
use trueline_geometry::so3;
use trueline_method::assess::robot_field::RobotSigmas;
use trueline_method::assess::seam_error::SeamError;
use trueline_method::config::ASSUMED_ROBOT_ACCURACY_M;
use trueline_method::hypotheses::ambiguity::RunnerUp;
use trueline_method::input::observations;
use trueline_method::input::shape_knowledge::{ShapeCovariance, ShapeKnowledge};
use trueline_method::input::timestamps::Sampling;
use trueline_method::problem::parameters::LINES;
use trueline_method::{Config, Measurements, Status, calibrate};

/// Result of a calibration of the planned scan.
#[derive(Clone, Debug)]
pub struct Rehearsal {
    /// Whether it would be accepted.
    pub accepted: bool,
    /// Whether its answer would be made of whole stripes.
    pub by_stripes: bool,
    /// Error of a seam point that is measured later.
    pub seam_error: Option<SeamError>,
    /// Standard deviation of time offset and hand-eye with robot, sensor and bias, in SI units.
    pub sigma: [Option<f64>; LINES],
    /// The most dangerous other answer.
    pub runner_up: Option<RunnerUp>,
}

/// An alias explains at least this part of the features.
const ALIAS: f64 = 0.2;

impl Rehearsal {
    /// Whether a rival explains enough to be confused with the answer in a scan with some outliers.
    #[must_use]
    pub fn has_alias(&self) -> bool {
        self.runner_up.is_some_and(|rival| rival.test.explains >= ALIAS)
    }
}

/// Time between values of an external axis, s, and how long they are recorded before and after the scan, s: as in the simulation.
const AXIS_PERIOD_S: f64 = 8e-3;
/// See [`AXIS_PERIOD_S`].
const BESIDE_SCAN_S: f64 = 1.0;

/// Seed of the noise.
const SEED: u64 = 1;

/// Calibrates a motion's scan at the guess; `None` if the scan is too short for it, a sensor's features cannot be made, or
/// stripes are requested without named plates.
#[must_use]
pub fn rehearse(
    cell: &Cell,
    setup: &SensorSetup,
    measurements: Measurements,
    motion: &Motion,
) -> Option<Rehearsal> {
    let recording = cast(cell, setup, measurements, motion)?;
    let found = calibrate(&recording, None, &Config { measurements, ..Config::default() }).ok()?;
    let checks = &found.findings.checks;
    Some(Rehearsal {
        accepted: found.status() == Status::Accepted,
        by_stripes: found.findings.stripes.as_ref().is_some_and(|s| s.used != Measurements::Seam),
        seam_error: checks.seam_error,
        sigma: std::array::from_fn(|component| found.sigma(component)),
        runner_up: checks.ambiguity.runner_up,
    })
}

/// Duration of a middling scan, s.
const MIDDLING_S: f64 = 20.0;

/// A calibration's prior knowledge of the sensor's shape and of the errors that are not noise, and the speed of its seam
/// error. The points of a path have little effect on it: those of an average one represent all.
pub(crate) fn knowledge(
    cell: &Cell,
    setup: &SensorSetup,
) -> Option<(ShapeCovariance, RobotSigmas, f64, f64)> {
    let config = Config::default();
    let middling = from_unit_box(cell, Shape::TwoPasses, MIDDLING_S, &[0.5; DIMENSION]);
    let recording = cast(cell, setup, Measurements::Seam, &Motion::new(cell, middling))?;
    let sampling = Sampling::of(&recording, observations::origin_ns(&recording));
    let observed = observations::observe(&recording, &sampling, &config).ok()?;
    let shape = ShapeKnowledge::of(&recording, &observed).covariance;
    let accuracy_m = setup.robot_accuracy_m.unwrap_or(ASSUMED_ROBOT_ACCURACY_M);
    let robot = RobotSigmas::of_accuracy(accuracy_m);
    Some((shape, robot, config.feature_bias_px, config.used_at.speed_m_s))
}

/// The recording of a motion at the guess, with the expected noise.
pub(crate) fn cast(
    cell: &Cell,
    setup: &SensorSetup,
    measurements: Measurements,
    motion: &Motion,
) -> Option<Recording> {
    let joint = match measurements {
        Measurements::Seam => None,
        Measurements::Auto | Measurements::Stripe | Measurements::Both => Some(Joint::of(cell).ok()?),
    };
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let (truth, along) = (Truth::guessed(cell)?, cell.seam.direction()?);
    let sights = PredictedFrames::of(cell, motion, &truth, 1)?;
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
    let (mut features, mut stripes) = (Vec::with_capacity(sights.list.len()), Vec::new());
    for sight in &sights.list {
        let measured = measured(cell, sight, [normal(), normal()])?;
        let stamp_ns = nanoseconds(sight.time_s + normal() * cell.noise.stamp_s);
        features.push(Feature {
            stamp_ns,
            line: 0,
            frame: None,
            device_ns: None,
            measured,
            sigma: None,
            correlation: 0.0,
        });
        if let Some(joint) = &joint {
            stripes.extend(stripes_of(cell, (joint, &along), sight, stamp_ns, &mut normal));
        }
    }
    features.sort_by_key(|feature| feature.stamp_ns);
    stripes.sort_by_key(|stripe| stripe.stamp_ns);
    let axes = motion.axis_records(cell, AXIS_PERIOD_S, BESIDE_SCAN_S);
    Some(Recording { stripes, axes, ..Recording::new(cell.sensor.clone(), setup.clone(), robot, features) })
}

/// The sensor's report of a sight; `None` if its camera does not see the point.
fn measured(cell: &Cell, sight: &PredictedFrame, normal: [f64; 2]) -> Option<Measured> {
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
