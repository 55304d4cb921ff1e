//! Readings of a standing robot: each has one pose, and there is no time offset to estimate.
//!
//! A recording over time is converted to this form by the pose that the robot holds around the stamp of each reading. Stamps then only pair readings
//! with poses.

use crate::config::{Config, HeldSigma, Hold, Stamps};
use crate::error::Error;
use nalgebra::Vector3;
use std::borrow::Cow;
use trueline_dataset::{Guess, Recording, RobotSample};
use trueline_geometry::trajectory::TrajectoryError;
use trueline_geometry::{Pose, Trajectory, se3, so3};

/// Time before and after a stamp during which a standing robot holds its pose, s. Images arrive with less delay.
const HELD_S: f64 = 0.15;
/// Least motion of a moving robot within twice [`HELD_S`], m. The poses of a standing robot scatter by a tenth of it, and a scan at 1 mm/s moves
/// further.
const SHIFT_M: f64 = 0.2e-3;
/// The same for rotations, rad.
const TURN_RAD: f64 = 5e-4;
/// A pose logged once a stop belongs to the reading whose stamp is within this fraction of the time between poses.
const NEAR: f64 = 0.25;
/// A stamp belongs to a logged pose if they differ by at most this, s, from writing with other digits.
const SAME_S: f64 = 1e-3;
/// Duration of a stop as a fraction of the shortest time between two of them, if only its stamp is known.
const STOP_PART: f64 = 1e-3;

/// Reason that a recording is calibrated at stops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stops {
    /// The user states it, the recording pairs readings with poses, or the time offset of a standing robot is held.
    Stated,
    /// The robot was detected to stand at each reading, without --at-stops.
    Recognised,
}

/// The recording by stops, with the reason. `None` if the robot moves.
///
/// # Errors
/// A reading stated to be at a stop has no pose, or the robot moves there.
pub fn of<'a>(
    recording: &'a Recording,
    config: &Config,
) -> Result<Option<(Cow<'a, Recording>, Stops)>, Error> {
    if recording.at_stops {
        return Ok(Some((Cow::Borrowed(recording), Stops::Stated)));
    }
    if config.at_stops {
        return Ok(Some((Cow::Owned(paired(recording)?), Stops::Stated)));
    }
    if !stand_at_readings(recording) {
        return Ok(None);
    }
    let is_held = config.hold.contains(&Hold::TimeOffset);
    let stops = if is_held { Stops::Stated } else { Stops::Recognised };
    Ok(Some((Cow::Owned(paired(recording)?), stops)))
}

/// The same options for stops: there is no time offset, and stamps are ignored.
#[must_use]
pub(crate) fn options(config: &Config) -> Config {
    let mut hold = config.hold.clone();
    hold.retain(|held| *held != Hold::TimeOffset);
    hold.push(Hold::TimeOffset);
    Config {
        at_stops: true,
        hold,
        held_sigma: HeldSigma { time_s: None, ..config.held_sigma },
        stamps: Stamps::Raw,
        offset_search_s: 0.0,
        ..config.clone()
    }
}

/// Whether the robot stands at every reading of a recording over time, and moves between some of them.
#[must_use]
pub fn stand_at_readings(recording: &Recording) -> bool {
    let stamps_ns = reading_stamps_ns(recording);
    let poses = stamps_ns.iter().map(|stamp| held_pose(recording, *stamp));
    let Ok(poses) = poses.collect::<Result<Vec<Pose>, Error>>() else { return false };
    poses.iter().any(|pose| !is_same(&poses[0], pose))
}

/// The same recording with one pose for each reading, that of its stop.
///
/// # Errors
/// A reading without a pose, or at which the robot moves.
pub fn paired(recording: &Recording) -> Result<Recording, Error> {
    let mut robot = Vec::new();
    for stamp_ns in reading_stamps_ns(recording) {
        let base_from_tool = held_pose(recording, stamp_ns)?;
        robot.push(RobotSample { stamp_ns, device_ns: None, base_from_tool });
    }
    Ok(Recording { robot, at_stops: true, ..recording.clone() })
}

/// The guess without a time offset, which stops do not have.
pub(crate) fn guess(guess: &Guess) -> Guess {
    Guess { time_offset_s: 0.0, ..*guess }
}

/// Distinct stamps of all readings, rising, ns.
fn reading_stamps_ns(recording: &Recording) -> Vec<i64> {
    let stripes = recording.stripes.iter().map(|stripe| stripe.stamp_ns);
    let mut stamps: Vec<i64> = recording.features.iter().map(|f| f.stamp_ns).chain(stripes).collect();
    stamps.sort_unstable();
    stamps.dedup();
    stamps
}

/// The pose that the robot holds around a stamp.
fn held_pose(recording: &Recording, stamp_ns: i64) -> Result<Pose, Error> {
    let all = &recording.robot;
    let held_ns = (HELD_S * 1e9) as i64;
    let from = all.partition_point(|sample| sample.stamp_ns < stamp_ns - held_ns);
    let until = all.partition_point(|sample| sample.stamp_ns <= stamp_ns + held_ns);
    let stamp_s = stamp_ns as f64 * 1e-9;
    if until - from < 2 {
        return logged_pose(all, stamp_ns).ok_or(Error::NoPoseAtStop { stamp_s });
    }
    let about: Vec<Pose> = all[from..until].iter().map(|sample| sample.base_from_tool).collect();
    let (shift_m, turn_rad) = about.iter().map(|pose| apart(&about[0], pose)).fold((0.0, 0.0), largest);
    if shift_m > SHIFT_M || turn_rad > TURN_RAD {
        return Err(Error::MovesAtStop { stamp_s, shift_mm: shift_m * 1e3, turn_deg: turn_rad.to_degrees() });
    }
    Ok(mean(&about))
}

/// The pose at a stamp among sparsely logged poses: both neighbours are equal, or one is by far the nearest.
fn logged_pose(all: &[RobotSample], stamp_ns: i64) -> Option<Pose> {
    let after = all.partition_point(|sample| sample.stamp_ns < stamp_ns);
    let neighbours: Vec<&RobotSample> =
        after.checked_sub(1).into_iter().chain([after]).filter_map(|k| all.get(k)).collect();
    if let [before, after] = neighbours[..]
        && is_same(&before.base_from_tool, &after.base_from_tool)
    {
        return Some(before.base_from_tool);
    }
    let distance_s = |sample: &RobotSample| (sample.stamp_ns - stamp_ns).abs() as f64 * 1e-9;
    let nearest = neighbours.into_iter().min_by(|a, b| distance_s(a).total_cmp(&distance_s(b)))?;
    let steps = all.windows(2).map(|pair| (pair[1].stamp_ns - pair[0].stamp_ns) as f64 * 1e-9);
    let apart_s = steps.filter(|step_s| *step_s > 0.0).fold(f64::INFINITY, f64::min);
    let near_s = if apart_s.is_finite() { NEAR * apart_s } else { SAME_S };
    (distance_s(nearest) <= near_s).then_some(nearest.base_from_tool)
}

fn apart(one: &Pose, other: &Pose) -> (f64, f64) {
    ((one.translation.vector - other.translation.vector).norm(), one.rotation.angle_to(&other.rotation))
}

fn largest(one: (f64, f64), other: (f64, f64)) -> (f64, f64) {
    (one.0.max(other.0), one.1.max(other.1))
}

fn is_same(one: &Pose, other: &Pose) -> bool {
    let (shift_m, turn_rad) = apart(one, other);
    shift_m <= SHIFT_M && turn_rad <= TURN_RAD
}

/// The mean of nearly equal poses.
fn mean(poses: &[Pose]) -> Pose {
    let first = poses[0];
    let count = poses.len() as f64;
    let shift: Vector3<f64> =
        poses.iter().map(|pose| pose.translation.vector - first.translation.vector).sum();
    let turn: Vector3<f64> =
        poses.iter().map(|pose| so3::log(&(first.rotation.inverse() * pose.rotation))).sum();
    se3::from_parts(first.rotation * so3::exp(&(turn / count)), first.translation.vector + shift / count)
}

/// A path that stands at each of these times (s, rising) and has gaps between them.
///
/// # Errors
/// Fewer than two stops, or times that do not rise.
pub(crate) fn path(times_s: &[f64], poses: &[Pose]) -> Result<Trajectory, TrajectoryError> {
    let shortest_s = times_s.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    if times_s.len() < 2 {
        return Err(TrajectoryError::TooFewSamples);
    }
    let half_s = 0.5 * STOP_PART * shortest_s;
    let times = times_s.iter().flat_map(|time_s| [time_s - half_s, time_s + half_s]).collect();
    let poses: Vec<Pose> = poses.iter().flat_map(|pose| [*pose, *pose]).collect();
    Trajectory::new(times, &poses)
}
