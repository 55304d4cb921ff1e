//! Points measured at standstill as ground truth for a moving scan \[Yang2025, Fig. 9\].
//!
//! The robot stops at points along the seam. There the time offset has no effect, and the mean over a stop has little noise. The seam is straight
//! between two stops, so a point of the moving scan is compared with the nearest place along the seam. An error of the hand-eye transform is common
//! to both scans. It is visible only as far as attitudes differ.

use crate::config::Config;
use crate::error::Error;
use crate::evaluate::seam_points::{self, SeamPoint};
use crate::input::observations;
use nalgebra::Vector3;
use trueline_dataset::{Guess, Recording, RobotSample};
use trueline_geometry::Polyline;

/// Largest shift of a standing robot, m: ten times the noise of a good one.
const REST_M: f64 = 0.3e-3;
/// Largest rotation of a standing robot, rad.
const REST_RAD: f64 = 1e-3;
/// Time after the robot has stopped, and before it moves on, without used images, s. It exceeds any error of the time offset and any swinging.
const MARGIN_S: f64 = 0.15;
/// Minimum images of a stop.
const FEWEST_IMAGES: usize = 3;
/// Minimum stops of a seam.
pub(crate) const FEWEST_STOPS: usize = 3;
/// Stops closer than this are one place of the seam, m.
const SAME_PLACE_M: f64 = 1e-3;

/// A point of a seam, measured at standstill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Its seam.
    pub line: u32,
    /// Mean of its points in base, m.
    pub point_in_base: Vector3<f64>,
    /// Number of images.
    pub images: usize,
    /// Standard deviation of that mean over all three axes, from the scatter of its points, m.
    pub sigma_m: f64,
}

/// Reason that a scan is no ground truth for another.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StandstillError {
    /// The scan cannot be placed.
    #[error(transparent)]
    Unplaced(#[from] Error),
    /// Too few stops.
    #[error("seam {line} has {found} stops with a feature; {FEWEST_STOPS} are needed")]
    TooFewStops {
        /// The seam.
        line: u32,
        /// Places found.
        found: usize,
    },
    /// The stops are not in order along the seam.
    #[error("the stops on seam {line} run back and forth: after stop {stop} the robot turned back")]
    BackAndForth {
        /// The seam.
        line: u32,
        /// The stop at which the order reversed, from 1.
        stop: usize,
    },
}

impl StandstillError {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Unplaced(_) => {
                "the static scan is a dataset like any other: robot.csv, sensor.toml, and features or pictures"
            }
            Self::TooFewStops { .. } => {
                "stop for a second at several points along the seam, within 0.3 mm, with the sensor on the seam"
            }
            Self::BackAndForth { .. } => {
                "stop at one point after the other, from one end of the seam to the other"
            }
        }
    }
}

/// The stops of a scan in their order, seam by seam.
///
/// # Errors
/// A scan that cannot be placed.
pub fn stops(recording: &Recording, by: &Guess) -> Result<Vec<Stop>, StandstillError> {
    let points = seam_points::place(recording, by, &Config::default())?.list;
    let origin_ns = observations::origin_ns(recording);
    let mut stops = Vec::new();
    let seams = points.iter().map(|p| p.line + 1).max().unwrap_or(0);
    for [from_s, until_s] in rests(&recording.robot, origin_ns) {
        for line in 0..seams {
            let within = |p: &&SeamPoint| {
                let exposed_s = p.stamp_s - by.time_offset_s;
                p.line == line && exposed_s >= from_s + MARGIN_S && exposed_s <= until_s - MARGIN_S
            };
            let own: Vec<Vector3<f64>> = points.iter().filter(within).map(|p| p.point_in_base).collect();
            stops.extend(stop(line, &own));
        }
    }
    stops.sort_by_key(|stop: &Stop| stop.line);
    Ok(stops)
}

/// The seams through stops.
///
/// # Errors
/// Too few stops, or stops that do not follow one another.
pub fn curves(stops: &[Stop]) -> Result<Vec<Polyline>, StandstillError> {
    let seams = stops.iter().map(|stop| stop.line + 1).max().unwrap_or(1);
    (0..seams).map(|line| curve(line, stops)).collect()
}

fn curve(line: u32, stops: &[Stop]) -> Result<Polyline, StandstillError> {
    let mut points: Vec<Vector3<f64>> = Vec::new();
    for stop in stops.iter().filter(|stop| stop.line == line) {
        let same = points.last().is_some_and(|last| (stop.point_in_base - last).norm() < SAME_PLACE_M);
        if !same {
            points.push(stop.point_in_base);
        }
    }
    let turned = points.windows(3).position(|p| (p[1] - p[0]).dot(&(p[2] - p[1])) <= 0.0);
    if let Some(k) = turned {
        return Err(StandstillError::BackAndForth { line, stop: k + 2 });
    }
    let found = points.len();
    let enough = (found >= FEWEST_STOPS).then_some(points);
    enough.and_then(Polyline::new).ok_or(StandstillError::TooFewStops { line, found })
}

/// The median of a stop's points along each axis, which is robust against a bad image.
fn stop(line: u32, points: &[Vector3<f64>]) -> Option<Stop> {
    if points.len() < FEWEST_IMAGES {
        return None;
    }
    let axis = |k: usize| crate::order_statistics::median(points.iter().map(move |p| p[k]));
    let middle = Vector3::new(axis(0)?, axis(1)?, axis(2)?);
    let distance = crate::order_statistics::median(points.iter().map(|p| (p - middle).norm()))?;
    // The median length of three equal normal deviates is 1.538 σ of one. The median of n deviates has the standard deviation σ √(π / 2n).
    let of_axis = distance / 1.538 * (std::f64::consts::FRAC_PI_2 / points.len() as f64).sqrt();
    Some(Stop { line, point_in_base: middle, images: points.len(), sigma_m: of_axis * 3.0_f64.sqrt() })
}

/// Intervals in which the robot stands, s since the first robot sample.
fn rests(robot: &[RobotSample], origin_ns: i64) -> Vec<[f64; 2]> {
    let time_s = |k: usize| (robot[k].stamp_ns - origin_ns) as f64 * 1e-9;
    let near = |a: usize, b: usize| {
        let (a, b) = (&robot[a].base_from_tool, &robot[b].base_from_tool);
        (a.translation.vector - b.translation.vector).norm() <= REST_M
            && a.rotation.angle_to(&b.rotation) <= REST_RAD
    };
    let mut rests = Vec::new();
    let mut first = 0;
    while first < robot.len() {
        let mut last = first;
        while last + 1 < robot.len() && near(first, last + 1) {
            last += 1;
        }
        if time_s(last) - time_s(first) > 2.0 * MARGIN_S {
            rests.push([time_s(first), time_s(last)]);
            first = last + 1;
        } else {
            first += 1;
        }
    }
    rests
}
