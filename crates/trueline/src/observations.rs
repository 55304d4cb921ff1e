//! Recording → observations: every feature lifted onto the laser sheet, with its covariance there.

use crate::config::Config;
use crate::error::Error;
use crate::held_poses;
use crate::sampling::Sampling;
use nalgebra::{Matrix2, Vector2, Vector3};
use std::collections::BTreeMap;
use trueline_dataset::{Feature, Measured, Recording, Sensor};
use trueline_geometry::trajectory::TrajectoryError;
use trueline_geometry::{Pose, Trajectory, curve, fit, smooth};
use trueline_model::LaserSheet;

/// One seam point on the sheet.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// Stamp of its image since the start of the recording, s.
    pub stamp_s: f64,
    /// Index of its image among those with a stamp of their own.
    pub frame: u32,
    /// Which line.
    pub line: u32,
    /// Row of the feature in the recording, from 0.
    pub row: u32,
    /// The point in the camera frame, m.
    pub point_in_camera: Vector3<f64>,
    /// Covariance of the measurement in the sheet, m²: \[xx, xy, yy\].
    pub covariance: [f64; 3],
}

/// How the robot moved, and how well that is known.
#[derive(Clone, Debug)]
pub struct RobotMotion {
    /// Poses over time since the start of the recording.
    pub trajectory: Trajectory,
    /// Median time between the samples, s.
    pub period_s: f64,
    /// Noise of a recorded position, per axis, as measured on the stream, m.
    pub recorded_noise_m: f64,
    /// What is left of it in the trajectory, m.
    pub noise_m: f64,
    /// Whether the trajectory is a local fit to the recorded poses.
    pub smoothed: bool,
    /// Samples that only repeat the pose of the one before while the robot moves, and are left out.
    pub repeated: usize,
    /// Standard deviation of how late the others are for that, s.
    pub late_sigma_s: f64,
    /// The same motion by every other sample, and by those between: their noise has nothing in common.
    pub halves: Option<Box<[Trajectory; 2]>>,
}

/// Everything the problem is made of.
#[derive(Clone, Debug)]
pub struct Observations {
    /// The robot.
    pub robot: RobotMotion,
    /// The laser sheet.
    pub sheet: LaserSheet,
    /// The observations by rising stamp.
    pub list: Vec<Observation>,
    /// Number of lines.
    pub line_count: usize,
    /// Standard deviation that one pixel of residual stands for; `None` where features are lengths.
    pub sigma_px: Option<f64>,
    /// RMS of the points about the sheet that was fitted to them, m; `None` where the sheet was given.
    pub sheet_fit_rms_m: Option<f64>,
    /// Features that could not be used, by reason.
    pub skipped: BTreeMap<&'static str, usize>,
}

/// Pixels whose ray does not exist or does not meet the sheet.
pub const SKIP_NO_RAY: &str = "pixel outside the image or the lens model";
/// Rays that run along the sheet or meet it behind the camera.
pub const SKIP_NO_SHEET: &str = "ray does not meet the laser sheet";

/// A row that says what another of the same image has said.
pub const SKIP_REPEATED: &str = "row repeats another of its image";

/// Points further than this (RMS) from a plane were not measured in one laser sheet.
const SHEET_RMS_LIMIT_M: f64 = 1e-3;

/// Below this the robot's noise does not matter, and its poses are taken as recorded: a twentieth of what
/// the feature itself contributes.
const SMOOTH_ABOVE_M: f64 = 1e-6;

/// Time 0 of all stamps in seconds: the first robot sample, ns.
#[must_use]
pub fn origin_ns(recording: &Recording) -> i64 {
    recording.robot.first().map_or(0, |sample| sample.stamp_ns)
}

/// The robot's motion over `times_s`, one for each sample with a stamp of its own.
///
/// # Errors
/// A robot stream that is no trajectory.
pub fn robot_motion(recording: &Recording, times_s: &[f64], config: &Config) -> Result<RobotMotion, Error> {
    // Of several samples with one stamp the last counts.
    let last_of_each = |pair: &[trueline_dataset::RobotSample]| pair[0].stamp_ns != pair[1].stamp_ns;
    let mut poses: Vec<Pose> = recording
        .robot
        .windows(2)
        .filter(|pair| last_of_each(pair))
        .map(|pair| pair[0].base_from_tool)
        .collect();
    poses.extend(recording.robot.last().map(|sample| sample.base_from_tool));
    check_motion(&poses)?;
    let updates = held_poses::updates(times_s, &poses);
    let times: Vec<f64> = updates.kept.iter().map(|k| times_s[*k] - updates.late_s).collect();
    let poses: Vec<Pose> = updates.kept.iter().map(|k| poses[*k]).collect();
    let recorded = Trajectory::new(times, &poses).map_err(Error::Trajectory)?;
    let gap_limit_s = recorded.gap_limit();
    let recorded_noise_m =
        smooth::position_noise(recorded.times(), &poses, recorded.median_period(), gap_limit_s);
    let mut motion = RobotMotion {
        period_s: recorded.median_period(),
        trajectory: recorded,
        recorded_noise_m,
        noise_m: recorded_noise_m,
        smoothed: false,
        repeated: updates.repeated,
        late_sigma_s: updates.late_sigma_s,
        halves: None,
    };
    if config.residual != crate::ResidualKind::Sheet {
        // The paper's model: straight between samples as they are.
        return Ok(motion);
    }
    let noise_left = smooth::noise_left(motion.period_s);
    motion.smoothed = recorded_noise_m > SMOOTH_ABOVE_M && noise_left < 1.0;
    motion.noise_m *= if motion.smoothed { noise_left } else { 1.0 };
    let times = motion.trajectory.times();
    let every_other = |first: usize| {
        let (times, poses): (Vec<f64>, Vec<Pose>) =
            times.iter().copied().zip(poses.iter().copied()).skip(first).step_by(2).unzip();
        path(&times, &poses, 2.0 * gap_limit_s, motion.smoothed)
    };
    motion.halves = every_other(0).and_then(|even| Ok(Box::new([even, every_other(1)?]))).ok();
    motion.trajectory = path(times, &poses, gap_limit_s, motion.smoothed).map_err(Error::Trajectory)?;
    Ok(motion)
}

/// The path through samples: their noise taken out, and curved where they are far apart.
fn path(
    times: &[f64],
    poses: &[Pose],
    gap_limit_s: f64,
    smoothed: bool,
) -> Result<Trajectory, TrajectoryError> {
    let poses = if smoothed { smooth::local_quadratic(times, poses, gap_limit_s) } else { poses.to_vec() };
    let (times, poses) = curve::densified(times, &poses, gap_limit_s, STRAIGHT_S);
    Trajectory::new(times, &poses)
}

/// A robot that stays within both of these does not move.
const LEAST_SHIFT_M: f64 = 1e-4;
/// See [`LEAST_SHIFT_M`].
const LEAST_TURN_RAD: f64 = 2e-4;

fn check_motion(poses: &[Pose]) -> Result<(), Error> {
    let Some(first) = poses.first() else { return Ok(()) };
    let (mut shift_m, mut turn_rad) = (0.0_f64, 0.0_f64);
    for pose in poses {
        shift_m = shift_m.max((pose.translation.vector - first.translation.vector).norm());
        turn_rad = turn_rad.max(first.rotation.angle_to(&pose.rotation));
    }
    if shift_m > LEAST_SHIFT_M || turn_rad > LEAST_TURN_RAD {
        return Ok(());
    }
    Err(Error::RobotStandsStill { shift_mm: shift_m * 1e3, turn_deg: turn_rad.to_degrees() })
}

/// For so long a robot's path is straight: at 2 m/s² it then bends by 2 · T²/8 = 7 µm.
const STRAIGHT_S: f64 = 0.005;

/// Lifts the features of a recording onto the sheet, and takes all stamps as recorded.
///
/// # Errors
/// A robot stream that is no trajectory, points without a sheet, lines without features.
pub fn observe(recording: &Recording, sampling: &Sampling, config: &Config) -> Result<Observations, Error> {
    let robot = robot_motion(recording, &sampling.robot.recorded_s, config)?;
    let (sheet, sheet_fit_rms_m) = sheet_of(recording, config)?;
    let mut skipped = BTreeMap::new();
    let mut list = Vec::with_capacity(recording.features.len());
    let mut frame = 0;
    for (row, feature) in recording.features.iter().enumerate() {
        if repeats(&recording.features, row) {
            *skipped.entry(SKIP_REPEATED).or_insert(0) += 1;
            continue;
        }
        frame += u32::from(row > 0 && recording.features[row - 1].stamp_ns != feature.stamp_ns);
        match lift(&recording.sensor, &sheet, feature, config) {
            Ok((point_in_camera, covariance)) => list.push(Observation {
                stamp_s: sampling.images.recorded_s[frame as usize],
                frame,
                line: feature.line,
                row: row as u32,
                point_in_camera,
                covariance: [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]],
            }),
            Err(reason) => *skipped.entry(reason).or_insert(0) += 1,
        }
    }
    let line_count = count_lines(&list)?;
    let sigma_px = matches!(recording.sensor, Sensor::CameraLaser { .. }).then_some(config.feature_sigma_px);
    Ok(Observations { robot, sheet, list, line_count, sigma_px, sheet_fit_rms_m, skipped })
}

/// Whether an earlier row of the same image says the same.
fn repeats(features: &[Feature], row: usize) -> bool {
    let this = &features[row];
    let earlier = features[..row].iter().rev().take_while(|other| other.stamp_ns == this.stamp_ns);
    earlier.into_iter().any(|other| other.line == this.line && other.measured == this.measured)
}

fn sheet_of(recording: &Recording, config: &Config) -> Result<(LaserSheet, Option<f64>), Error> {
    match &recording.sensor {
        Sensor::CameraLaser { laser_plane_in_camera, .. } => {
            Ok((LaserSheet::from_plane(*laser_plane_in_camera), None))
        }
        Sensor::Profiler => Ok((LaserSheet::of_profiler(), None)),
        Sensor::Points { laser_plane_in_camera: Some(plane) } => Ok((LaserSheet::from_plane(*plane), None)),
        Sensor::Points { laser_plane_in_camera: None } => fitted_sheet(recording, config),
    }
}

fn fitted_sheet(recording: &Recording, config: &Config) -> Result<(LaserSheet, Option<f64>), Error> {
    let points: Vec<Vector3<f64>> = recording
        .features
        .iter()
        .filter_map(|f| match f.measured {
            Measured::Point(p) => Some(Vector3::from(p)),
            _ => None,
        })
        .collect();
    let fit = fit::robust_plane(&points).ok_or(Error::SheetUndefined)?;
    if fit.extent < 10.0 * config.feature_sigma_m {
        return Err(Error::SheetUndefined);
    }
    if fit.rms > SHEET_RMS_LIMIT_M && config.residual == crate::ResidualKind::Sheet {
        return Err(Error::PointsNotInSheet { rms_m: fit.rms });
    }
    Ok((LaserSheet::from_plane(fit.plane), Some(fit.rms)))
}

/// The point in the camera frame (m) and its covariance in the sheet (m²), or why there is none.
fn lift(
    sensor: &Sensor,
    sheet: &LaserSheet,
    feature: &Feature,
    config: &Config,
) -> Result<(Vector3<f64>, Matrix2<f64>), &'static str> {
    let squared = |sigma: [f64; 2]| Matrix2::new(sigma[0].powi(2), 0.0, 0.0, sigma[1].powi(2));
    let sigma_m = || feature.sigma.unwrap_or([config.feature_sigma_m; 2]);
    match (feature.measured, sensor) {
        (Measured::Pixel(pixel), Sensor::CameraLaser { camera, .. }) => {
            let (ray, d_ray_d_pixel) = camera.ray(&Vector2::from(pixel)).map_err(|_| SKIP_NO_RAY)?;
            let (point, d_point_d_ray) = sheet.intersect(&ray).ok_or(SKIP_NO_SHEET)?;
            let d_sheet_d_pixel = sheet.axes().transpose() * d_point_d_ray * d_ray_d_pixel;
            let sigma = squared(feature.sigma.unwrap_or([config.feature_sigma_px; 2]));
            Ok((point, d_sheet_d_pixel * sigma * d_sheet_d_pixel.transpose()))
        }
        (Measured::Profile([x, z]), _) => Ok((Vector3::new(x, 0.0, z), squared(sigma_m()))),
        (Measured::Point(point), _) => Ok((Vector3::from(point), squared(sigma_m()))),
        (Measured::Pixel(_), _) => Err(SKIP_NO_RAY),
    }
}

fn count_lines(list: &[Observation]) -> Result<usize, Error> {
    let Some(highest) = list.iter().map(|o| o.line).max() else {
        return Err(Error::TooFewFeatures { line: 0, usable: 0, needed: MIN_FEATURES });
    };
    for line in 0..=highest {
        let usable = list.iter().filter(|o| o.line == line).count();
        if usable == 0 {
            return Err(Error::LineMissing { line, highest });
        }
        if usable < MIN_FEATURES {
            return Err(Error::TooFewFeatures { line, usable, needed: MIN_FEATURES });
        }
    }
    Ok(highest as usize + 1)
}

/// Fewest features of a line: with two numbers each, four are enough for its own unknowns; ten leave
/// something to judge them by.
const MIN_FEATURES: usize = 10;
