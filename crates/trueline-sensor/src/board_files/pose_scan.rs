//! A dataset of pose sightings: time offset, hand-eye transform and target, with a camera on the robot or beside it.

use crate::board_files::error::BoardError;
use crate::board_files::moving_scan::{at_stops_noise, stamped};
use crate::board_hand_eye::joint::SIZE;
use crate::board_hand_eye::pose_stops;
use crate::board_hand_eye::poses::{self, PoseOptions};
use crate::board_hand_eye::{Carried, ErrorModel, PoseFit, ReportedPose, RobotPath};
use nalgebra::{DMatrix, SMatrix, SVector, Vector6};
use std::path::Path;
use trueline_dataset::pose_folder::PoseDataset;
use trueline_dataset::sensor_setup::Mounted;
use trueline_dataset::{Guess, Recording};
use trueline_geometry::{Pose, smooth};
use trueline_method::assess::robot_field::{RobotField, RobotSigmas};
use trueline_method::config::ASSUMED_ROBOT_ACCURACY_M;
use trueline_method::input::observations::origin_ns;
use trueline_method::input::robot_motion::RobotMotion;
use trueline_method::input::stops::{self, Stops};
use trueline_method::input::timestamps::{Dejittered, Sampling};
use trueline_method::{Config, Hold};

/// Prior knowledge of a scan.
#[derive(Clone, Copy, Debug, Default)]
pub struct SightingOptions {
    /// Whether the robot stood at each sighting.
    pub at_stops: bool,
    /// The start.
    pub guess: Option<Guess>,
    /// Whether the time offset is held there.
    pub holds_offset: bool,
    /// The time offset is within plus and minus this, s; `None` looks as far as usual.
    pub offset_within_s: Option<f64>,
    /// Absolute accuracy of the robot, m; `None` is the value in the sensor's file, or [`ASSUMED_ROBOT_ACCURACY_M`].
    pub robot_accuracy_m: Option<f64>,
}

/// A calibration from pose sightings.
#[derive(Clone, Debug)]
pub struct PoseScan {
    /// Result of the fit.
    pub fit: PoseFit,
    /// Covariance of all modelled errors: noise, and position errors of the robot.
    pub covariance: SMatrix<f64, SIZE, SIZE>,
    /// Noise of a recorded position of the robot, per axis, m.
    pub robot_noise_m: f64,
    /// Whether the robot stood still at each sighting, and the source of that.
    pub stops: Option<Stops>,
    /// Whether the time offset was estimated.
    pub estimates_offset: bool,
}

/// Calibrates from a folder of sightings; errors name it `dataset`.
///
/// # Errors
/// Streams that cannot be used, and sightings that show too little.
pub fn calibrate(
    dataset: &Path,
    read: &PoseDataset,
    options: &SightingOptions,
) -> Result<PoseScan, BoardError> {
    let stamps_ns: Vec<i64> = read.sightings.iter().map(|sighting| sighting.stamp_ns).collect();
    let scan = Recording {
        at_stops: read.robot.at_stops,
        setup: read.setup.clone(),
        ..stamped(read.robot.samples.clone(), &stamps_ns)
    };
    let config = Config {
        at_stops: options.at_stops,
        hold: if options.holds_offset { vec![Hold::TimeOffset] } else { Vec::new() },
        ..Config::default()
    };
    let reported: Vec<ReportedPose> = read
        .sightings
        .iter()
        .map(|s| ReportedPose { camera_from_target: s.camera_from_target, sigma: s.sigma })
        .collect();
    let sought = PoseOptions {
        reach_s: options.offset_within_s.unwrap_or(poses::REACH_S),
        guess: options.guess.map(|guess| (guess.time_offset_s, guess.tool_from_camera)),
    };
    let accuracy_m = options.robot_accuracy_m.or(read.setup.robot_accuracy_m);
    let accuracy_m = accuracy_m.unwrap_or(ASSUMED_ROBOT_ACCURACY_M);
    let carries = carried(read.setup.mounted);
    let failed = |error| BoardError::Calibration { dataset: dataset.to_owned(), error, why: String::new() };
    let field = RobotSigmas::of_accuracy(accuracy_m);
    if let Some((scan, stops)) = stops::of(&scan, &config)? {
        let poses = poses_at(&scan, &stamps_ns);
        let noise = ErrorModel { carries, ..at_stops_noise(accuracy_m) };
        let path = RobotPath::Stops(&poses);
        let found = pose_stops::calibrate_at_stops(&reported, &poses, &noise, &sought).map_err(failed)?;
        // The residuals contain the differences from stop to stop, but not the common error of neighbouring stops.
        let robot_noise_m = found.stop_noise_part * noise.position_m;
        let field = field.beside(robot_noise_m);
        let fit = with_robot_on_scale(found.fit, path, field);
        let covariance = fit.covariance + of_robot(&fit, path, field);
        return Ok(PoseScan { fit, covariance, robot_noise_m, stops: Some(stops), estimates_offset: false });
    }
    let moved = Moved::of(&scan, &stamps_ns, carries)?;
    let path = moved.path(options.holds_offset);
    let fit = poses::calibrate(&reported, path, &moved.noise, &sought).map_err(failed)?;
    let fit = with_robot_on_scale(fit, path, field);
    Ok(PoseScan {
        covariance: fit.covariance + of_robot(&fit, path, field),
        fit,
        robot_noise_m: moved.motion.recorded_noise_m,
        stops: None,
        estimates_offset: !options.holds_offset,
    })
}

pub(super) fn carried(mounted: Mounted) -> Carried {
    match mounted {
        Mounted::Tool => Carried::Camera,
        Mounted::Fixed => Carried::Target,
    }
}

/// The pose of the camera's carrier at each sighting of a scan at stops.
pub(super) fn poses_at(scan: &Recording, stamps_ns: &[i64]) -> Vec<Pose> {
    let at = |stamp_ns: &i64| scan.robot.partition_point(|sample| sample.stamp_ns < *stamp_ns);
    stamps_ns.iter().filter_map(|stamp| Some(scan.lines_from_carrier(scan.robot.get(at(stamp))?))).collect()
}

/// Effect on the estimate of a robot error that changes slowly with the pose.
pub(super) fn of_robot(fit: &PoseFit, path: RobotPath<'_>, sigmas: RobotSigmas) -> SMatrix<f64, SIZE, SIZE> {
    of_robot_on(&fit.d_robot, fit.unknowns.time_offset_s, path, sigmas)
}

/// The fit with the same effect on its scale.
fn with_robot_on_scale(mut fit: PoseFit, path: RobotPath<'_>, sigmas: RobotSigmas) -> PoseFit {
    if let Some(scale) = &mut fit.scale {
        let of_robot = of_robot_on(&scale.d_robot, fit.unknowns.time_offset_s, path, sigmas);
        scale.sigma = scale.sigma.hypot(of_robot[(0, 0)].sqrt());
    }
    fit
}

/// The same on any numbers, by their derivatives by an error at each sighting.
fn of_robot_on<const N: usize>(
    derivatives: &[Option<SMatrix<f64, N, 6>>],
    time_offset_s: f64,
    path: RobotPath<'_>,
    sigmas: RobotSigmas,
) -> SMatrix<f64, N, N> {
    let pose = |k: usize| Some(path.at(k, time_offset_s)?.base_from_tool);
    let placed: Vec<(Pose, &SMatrix<f64, N, 6>)> =
        derivatives.iter().enumerate().filter_map(|(k, d)| Some((pose(k)?, d.as_ref()?))).collect();
    let poses: Vec<Pose> = placed.iter().map(|(pose, _)| *pose).collect();
    let Some(field) = RobotField::new(sigmas, &poses) else { return SMatrix::zeros() };
    let (turn, shift) = (sigmas.attitude_rad, sigmas.position_m);
    let sizes = Vector6::new(turn, turn, turn, shift, shift, shift);
    let mut columns: Vec<DMatrix<f64>> = Vec::new();
    for (pose, d_robot) in &placed {
        let modes = field.at(pose);
        for component in 0..6 {
            let column: SVector<f64, N> = d_robot.column(component) * sizes[component];
            let of_modes = DMatrix::from_column_slice(N, 1, column.as_slice()) * modes.transpose();
            match columns.get_mut(component) {
                Some(sum) => *sum += of_modes,
                None => columns.push(of_modes),
            }
        }
    }
    let sum = columns.iter().fold(DMatrix::zeros(N, N), |sum, c| sum + c * c.transpose());
    SMatrix::<f64, N, N>::from_fn(|i, j| sum[(i, j)])
}

/// A robot that moved while its target was seen.
pub(super) struct Moved {
    pub(super) motion: RobotMotion,
    stamps_s: Vec<f64>,
    pub(super) noise: ErrorModel,
}

impl Moved {
    pub(super) fn of(scan: &Recording, stamps_ns: &[i64], carries: Carried) -> Result<Self, BoardError> {
        let origin_ns = origin_ns(scan);
        let sampling = Sampling::of(scan, origin_ns);
        let (config, as_recorded) = (Config::default(), Dejittered::default());
        let times_s = sampling.robot_times_s(as_recorded);
        let motion = RobotMotion::of(scan, times_s, &config)?;
        let (position_m, rotation_rad) = tool_noise(scan, times_s, &motion);
        let stamp_s = sampling.stamp_sigma_s(&config, as_recorded);
        let noise = ErrorModel { position_m, rotation_rad, stamp_s, carries };
        let stamps_s = stamps_ns.iter().map(|ns| (ns - origin_ns) as f64 * 1e-9).collect();
        Ok(Self { motion, stamps_s, noise })
    }

    pub(super) fn path(&self, offset_is_known: bool) -> RobotPath<'_> {
        let (trajectory, stamps_s) = (&self.motion.trajectory, &self.stamps_s[..]);
        if offset_is_known {
            RobotPath::MovingAtKnownOffset { trajectory, stamps_s }
        } else {
            RobotPath::Moving { trajectory, stamps_s }
        }
    }
}

/// Noise of the tool's position (m) and attitude (rad) that is left in the path. It is measured on base_from_tool also where the path is
/// its inverse: there a turn of the tool would count as a shift at the end of the arm.
fn tool_noise(scan: &Recording, times_s: &[f64], motion: &RobotMotion) -> (f64, f64) {
    let poses: Vec<Pose> = scan.robot.iter().map(|sample| sample.base_from_tool).collect();
    let gap_limit_s = motion.trajectory.gap_limit().max(4.0 * motion.period_s);
    let left = if motion.recorded_noise_m > 0.0 { motion.noise_m / motion.recorded_noise_m } else { 1.0 };
    let position_m = smooth::position_noise(times_s, &poses, motion.period_s, gap_limit_s);
    let rotation_rad = smooth::rotation_noise(times_s, &poses, motion.period_s, gap_limit_s);
    (position_m * left, rotation_rad * left)
}
