//! A dataset of profiles, or points, of a sphere or a cylinder: time offset, hand-eye transform and target, with a sensor on the robot or
//! beside it.

use crate::board_files::arcs::Arcs;
use crate::board_files::axis_start;
use crate::board_files::error::BoardError;
use crate::board_files::moving_scan::{at_stops_noise, stamped};
use crate::board_files::pose_scan::{Moved, SightingOptions, carried, of_robot, poses_at};
use crate::board_hand_eye::poses::REACH_S;
use crate::board_hand_eye::unknowns;
use crate::board_hand_eye::{ErrorModel, RobotPath};
use crate::round::{RoundFit, RoundOptions, RoundTarget, calibrate as fitted};
use nalgebra::SMatrix;
use std::path::Path;
use trueline_dataset::{Profile, Recording};
use trueline_geometry::Pose;
use trueline_method::assess::robot_field::RobotSigmas;
use trueline_method::config::ASSUMED_ROBOT_ACCURACY_M;
use trueline_method::input::shape_knowledge::ShapeKnowledge;
use trueline_method::input::stops::{self, Stops};
use trueline_method::{Config, Hold, SensorMode};

/// What is known of a scan of a round target beforehand.
#[derive(Clone, Copy, Debug, Default)]
pub struct RoundCalibrationOptions {
    /// What was scanned.
    pub target: RoundTarget,
    /// The same as of sightings.
    pub scan: SightingOptions,
    /// Radius of the target, m; `None` estimates it.
    pub radius_m: Option<f64>,
    /// How the sensor's own calibration is treated.
    pub sensor: SensorMode,
}

/// A calibration from a sphere or a cylinder.
#[derive(Clone, Debug)]
pub struct RoundCalibration {
    /// What was found.
    pub round: RoundFit,
    /// Covariance of all modelled errors: noise, and position errors of the robot.
    pub covariance: SMatrix<f64, { unknowns::SIZE }, { unknowns::SIZE }>,
    /// Noise of a recorded position of the robot, per axis, m.
    pub robot_noise_m: f64,
    /// Whether the robot stood still at each profile, and the source of that.
    pub stops: Option<Stops>,
    /// Whether the time offset is among what was estimated.
    pub estimates_offset: bool,
    /// Profiles in all.
    pub profiles: usize,
}

/// Calibrates from whole profiles, or else from the points of a recording; `dataset` names it in errors.
///
/// # Errors
/// Streams that cannot be used, profiles without arcs, and cuts that show too little.
pub fn calibrate(
    dataset: &Path,
    recording: &Recording,
    profiles: &[Profile],
    options: &RoundCalibrationOptions,
) -> Result<RoundCalibration, BoardError> {
    let failed = |error| BoardError::Calibration { dataset: dataset.to_owned(), error, why: String::new() };
    let arcs = Arcs::of(recording, profiles, options.target, options.radius_m).map_err(failed)?;
    let scan = Recording {
        at_stops: recording.at_stops,
        setup: recording.setup.clone(),
        ..stamped(recording.robot.clone(), &arcs.stamps_ns)
    };
    let config = Config {
        at_stops: options.scan.at_stops,
        hold: if options.scan.holds_offset { vec![Hold::TimeOffset] } else { Vec::new() },
        // A scan that the sensor's file was made from is not counted twice.
        sensor: if recording.is_in_its_sensors_uncertainty() { SensorMode::Fixed } else { options.sensor },
        ..Config::default()
    };
    let accuracy_m = options.scan.robot_accuracy_m.or(recording.setup.robot_accuracy_m);
    let accuracy_m = accuracy_m.unwrap_or(ASSUMED_ROBOT_ACCURACY_M);
    let field = RobotSigmas::of_accuracy(accuracy_m);
    let carries = carried(recording.setup.mounted);
    let start = |scan: &Recording, stops: bool| -> Result<RoundOptions, BoardError> {
        let starts = match options.target {
            RoundTarget::Sphere => Vec::new(),
            RoundTarget::Cylinder => axis_start::starts(scan, &arcs, options.radius_m, &options.scan, stops)?,
        };
        Ok(RoundOptions { starts, ..sought(recording, options, &config) })
    };
    let concluded = |path: RobotPath<'_>,
                     noise: &ErrorModel,
                     robot_noise_m: f64,
                     (stops, sought): (Option<Stops>, RoundOptions)|
     -> Result<RoundCalibration, BoardError> {
        let round = fitted(&arcs.cuts, &arcs.sheet, path, noise, &sought).map_err(failed)?;
        // The residuals contain what differs from reading to reading, but not what neighbours share. At stops both are of the stated accuracy.
        let of_noise = round.stop_noise_part;
        let field = if stops.is_some() { field.beside(of_noise * field.position_m) } else { field };
        let robot_noise_m = of_noise * robot_noise_m;
        Ok(RoundCalibration {
            covariance: round.pose.covariance + round.of_sensor + of_robot(&round.pose, path, field),
            round,
            robot_noise_m,
            stops,
            estimates_offset: path.has_time_offset(),
            profiles: arcs.profiles,
        })
    };
    if let Some((scan, stops)) = stops::of(&scan, &config)? {
        let poses: Vec<Pose> = poses_at(&scan, &arcs.stamps_ns);
        let noise = ErrorModel { carries, ..at_stops_noise(accuracy_m) };
        let sought = start(&scan, true)?;
        return concluded(RobotPath::Stops(&poses), &noise, noise.position_m, (Some(stops), sought));
    }
    let moved = Moved::of(&scan, &arcs.stamps_ns, carries)?;
    let path = moved.path(options.scan.holds_offset);
    concluded(path, &moved.noise, moved.motion.recorded_noise_m, (None, start(&scan, false)?))
}

/// What is sought, but for where a cylinder's fit starts.
fn sought(recording: &Recording, options: &RoundCalibrationOptions, config: &Config) -> RoundOptions {
    let known = ShapeKnowledge::of_profiler(recording.setup.uncertainty.as_ref());
    let is_held = config.sensor == SensorMode::Fixed;
    RoundOptions {
        target: options.target,
        starts: Vec::new(),
        reach_s: options.scan.offset_within_s.unwrap_or(REACH_S),
        guess: options.scan.guess.map(|guess| (guess.time_offset_s, guess.tool_from_camera)),
        radius_m: options.radius_m,
        shape: known.prior(config),
        held_shape: if is_held && known.stated { known.covariance } else { SMatrix::zeros() },
    }
}
