//! A dataset of profiles, or points, of a sphere or a cylinder: time offset, hand-eye transform and target, with a sensor on the robot or
//! beside it.

use crate::board_files::axis_start;
use crate::board_files::error::BoardError;
use crate::board_files::moving_scan::{at_stops_noise, stamped};
use crate::board_files::pose_scan::{Moved, SightingOptions, carried, of_robot, poses_at};
use crate::board_hand_eye::poses::REACH_S;
use crate::board_hand_eye::unknowns;
use crate::board_hand_eye::{ErrorModel, RobotPath};
use crate::error::Error;
use crate::round::model::SheetFrame;
use crate::round::problem::FEWEST;
use crate::round::{Cut, RoundFit, RoundOptions, RoundTarget, arc, calibrate as fitted};
use nalgebra::{SMatrix, Vector2, Vector3};
use std::path::Path;
use trueline_dataset::{Measured, Profile, Recording, Sensor};
use trueline_geometry::{Pose, fit};
use trueline_method::assess::robot_field::RobotSigmas;
use trueline_method::config::ASSUMED_ROBOT_ACCURACY_M;
use trueline_method::input::shape_knowledge::ShapeKnowledge;
use trueline_method::input::stops::{self, Stops};
use trueline_method::{Config, Hold, SensorMode};
use trueline_model::{LaserSheet, SheetShape};

/// Prior knowledge and settings for a scan of a round target.
#[derive(Clone, Copy, Debug, Default)]
pub struct RoundCalibrationOptions {
    /// Scanned target.
    pub target: RoundTarget,
    /// Options as for sightings.
    pub scan: SightingOptions,
    /// Radius of the target, m; `None` estimates it.
    pub radius_m: Option<f64>,
    /// Treatment of the sensor's own calibration.
    pub sensor: SensorMode,
}

/// A calibration from a sphere or a cylinder.
#[derive(Clone, Debug)]
pub struct RoundCalibration {
    /// Result of the fit.
    pub round: RoundFit,
    /// Covariance of all modelled errors: noise, and position errors of the robot.
    pub covariance: SMatrix<f64, { unknowns::SIZE }, { unknowns::SIZE }>,
    /// Noise of a recorded position of the robot, per axis, m.
    pub robot_noise_m: f64,
    /// Whether the robot stood still at each profile, and the source of that.
    pub stops: Option<Stops>,
    /// Whether the time offset is estimated.
    pub estimates_offset: bool,
    /// Total number of profiles.
    pub profiles: usize,
}

/// Profiles with an arc.
pub(super) struct Arcs {
    pub(super) stamps_ns: Vec<i64>,
    pub(super) cuts: Vec<Cut>,
    pub(super) sheet: SheetFrame,
    profiles: usize,
}

/// Calibrates from whole profiles, or else from the points of a recording; `dataset` names it in errors.
///
/// # Errors
/// Streams that cannot be used, profiles without arcs, and cuts that determine too little.
pub fn calibrate(
    dataset: &Path,
    recording: &Recording,
    profiles: &[Profile],
    options: &RoundCalibrationOptions,
) -> Result<RoundCalibration, BoardError> {
    let failed = |error| BoardError::Calibration { dataset: dataset.to_owned(), error, why: String::new() };
    let arcs = Arcs::of(recording, profiles, options).map_err(failed)?;
    let scan = Recording {
        at_stops: recording.at_stops,
        setup: recording.setup.clone(),
        ..stamped(recording.robot.clone(), &arcs.stamps_ns)
    };
    let config = Config {
        at_stops: options.scan.at_stops,
        hold: if options.scan.holds_offset { vec![Hold::TimeOffset] } else { Vec::new() },
        // A scan that the sensor's file is based on is not counted twice.
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
            RoundTarget::Cylinder => axis_start::starts(scan, &arcs, options, stops)?,
        };
        Ok(RoundOptions { starts, ..sought(recording, options, &config) })
    };
    let concluded = |path: RobotPath<'_>,
                     noise: &ErrorModel,
                     robot_noise_m: f64,
                     (stops, sought): (Option<Stops>, RoundOptions)|
     -> Result<RoundCalibration, BoardError> {
        let round = fitted(&arcs.cuts, &arcs.sheet, path, noise, &sought).map_err(failed)?;
        Ok(RoundCalibration {
            // The residuals contain independent noise of readings, without the part that neighbours share.
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

/// Options of the fit, except the starts of a cylinder.
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

impl Arcs {
    fn of(
        recording: &Recording,
        profiles: &[Profile],
        options: &RoundCalibrationOptions,
    ) -> Result<Self, Error> {
        let (target, radius_m) = (options.target, options.radius_m);
        let (sheet, stamped) = if profiles.is_empty() {
            points_of_features(recording, target)?
        } else {
            let of = |profile: &Profile| {
                (profile.stamp_ns, profile.points.iter().map(|p| Vector2::new(p.x_m, p.z_m)).collect())
            };
            (LaserSheet::of_profiler(), profiles.iter().map(of).collect())
        };
        let corrected = |point: &Vector2<f64>| match &recording.setup.shape {
            Some(shape) => shape.corrected(point).0,
            None => *point,
        };
        let arcs: Vec<(i64, Vec<Vector2<f64>>)> = stamped
            .iter()
            .filter_map(|(stamp_ns, points)| {
                let points: Vec<Vector2<f64>> = points.iter().map(corrected).collect();
                Some((*stamp_ns, arc::arc(&points, target, radius_m)?))
            })
            .collect();
        if arcs.len() < FEWEST {
            let (found, profiles) = (arcs.len(), stamped.len());
            return Err(Error::TooFewArcs { target: target.row().name, found, profiles, needed: FEWEST });
        }
        let all = || arcs.iter().flat_map(|(_, points)| points);
        let middle = all().sum::<Vector2<f64>>() / all().count() as f64;
        let shape = SheetShape::exact_about(&middle);
        let cuts =
            arcs.iter().filter_map(|(stamp_ns, points)| Some((*stamp_ns, Cut::of(target, points, &shape)?)));
        let (stamps_ns, cuts) = cuts.unzip();
        Ok(Self { stamps_ns, cuts, sheet: SheetFrame::of(&sheet), profiles: stamped.len() })
    }
}

/// Points of one stamp each, in the sheet's coordinates, m.
type Stamped = Vec<(i64, Vec<Vector2<f64>>)>;

/// The sheet and the points of a recording whose readings are points of a target, several of each stamp.
fn points_of_features(recording: &Recording, target: RoundTarget) -> Result<(LaserSheet, Stamped), Error> {
    let points: Vec<(i64, Vector3<f64>)> = recording
        .features
        .iter()
        .filter_map(|feature| match feature.measured {
            Measured::Point(point) => Some((feature.stamp_ns, Vector3::from(point))),
            _ => None,
        })
        .collect();
    let stated = match &recording.sensor {
        Sensor::Points { laser_plane_in_camera } => *laser_plane_in_camera,
        _ => None,
    };
    let all: Vec<Vector3<f64>> = points.iter().map(|(_, point)| *point).collect();
    let plane = stated.or_else(|| Some(fit::plane(&all)?.plane));
    let no_points =
        Error::TooFewArcs { target: target.row().name, found: 0, profiles: points.len(), needed: FEWEST };
    let sheet = LaserSheet::from_plane(plane.ok_or(no_points)?);
    let mut stamped: Stamped = Vec::new();
    for (stamp_ns, point) in points {
        let at = sheet.coordinates(&point);
        match stamped.last_mut() {
            Some((last, points)) if *last == stamp_ns => points.push(at),
            _ => stamped.push((stamp_ns, vec![at])),
        }
    }
    Ok((sheet, stamped))
}
