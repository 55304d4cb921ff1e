//! Every feature with the sensor's place at its exposure, by a calibration that is known: what a test of that calibration
//! is made of.

use crate::assess::residuals::why_not_placed;
use crate::config::Config;
use crate::error::Error;
use crate::input::noise_levels::{NoiseLevels, symmetric};
use crate::input::observations::{self, observe};
use crate::input::robot_motion::RobotMotion;
use crate::input::skip::Skip;
use crate::input::timestamps::{Dejittered, Sampling};
use nalgebra::{Matrix2, Vector3};
use std::collections::BTreeMap;
use trueline_dataset::{Guess, Recording};
use trueline_geometry::smoothed_velocity::smoothed_velocity;
use trueline_model::{LaserSheet, Placement};

/// One feature and where the sensor was.
#[derive(Clone, Copy, Debug)]
pub struct PlacedFeature {
    /// Stamp of its image since the first robot sample, s.
    pub stamp_s: f64,
    /// Index of its image among those with a stamp of their own.
    pub frame: u32,
    /// Which seam.
    pub line: u32,
    /// Where the sensor was at the exposure, and how it moved: velocities of many samples, so that their noise does not pass
    /// for motion.
    pub placement: Placement,
    /// The point in the camera frame, m.
    pub point_in_camera: Vector3<f64>,
    /// Covariance of the measurement in the sheet, m².
    pub covariance: Matrix2<f64>,
}

/// All features of a recording that can be placed.
#[derive(Clone, Debug)]
pub struct PlacedFeatures {
    /// By rising stamp.
    pub list: Vec<PlacedFeature>,
    /// The sheet they lie in.
    pub sheet: LaserSheet,
    /// Noise that features of one image share.
    pub noise: NoiseLevels,
    /// Whether the stamps could be treated as asked.
    pub dejittered: Dejittered,
    /// How many are missing, and why.
    pub skipped: BTreeMap<Skip, usize>,
}

/// Places every feature of a recording, with the stamps of those streams taken from their clocks that the calibration
/// took from them; a stream that does not tick evenly keeps its recorded stamps, as [`PlacedFeatures::dejittered`] tells.
///
/// # Errors
/// A recording that cannot be lifted onto the sheet: see [`observe`].
pub fn place(
    recording: &Recording,
    by: &Guess,
    wanted: Dejittered,
    config: &Config,
) -> Result<PlacedFeatures, Error> {
    let sampling = Sampling::of(recording, observations::origin_ns(recording));
    let mut observations = observe(recording, &sampling, config)?;
    let (images, robot) = (sampling.images.clock.as_ref(), sampling.robot.clock.as_ref());
    let dejittered =
        Dejittered { images: wanted.images && images.is_some(), robot: wanted.robot && robot.is_some() };
    if let Some(clock) = images.filter(|_| dejittered.images) {
        for o in &mut observations.list {
            o.stamp_s = clock.regular_s[o.frame as usize];
        }
    }
    if let Some(clock) = robot.filter(|_| dejittered.robot) {
        observations.robot = RobotMotion::of(recording, &clock.regular_s, config)?;
    }
    let noise = NoiseLevels {
        robot_sigma_m: config.robot_sigma_m.unwrap_or(observations.robot.noise_m),
        stamp_sigma_s: sampling.stamp_sigma_s(config, dejittered),
        factor: 1.0,
    };
    let mut skipped = observations.skipped.clone();
    let mut list = Vec::with_capacity(observations.list.len());
    let trajectory = &observations.robot.trajectory;
    let mut hint = 0;
    for o in &observations.list {
        let exposure_s = o.stamp_s - by.time_offset_s;
        let index = trajectory.bracket(exposure_s, hint);
        let Some(segment) = index.and_then(|index| trajectory.segment(index)) else {
            *skipped.entry(why_not_placed(&observations, exposure_s)).or_insert(0) += 1;
            continue;
        };
        hint = index.unwrap_or(hint);
        let mut placement = Placement::new(segment, exposure_s, &by.tool_from_camera);
        if let Some(smooth) = smoothed_velocity(trajectory, hint, exposure_s) {
            placement.velocity = smooth.velocity;
            placement.angular_velocity = smooth.angular_velocity;
        }
        list.push(PlacedFeature {
            stamp_s: o.stamp_s,
            frame: o.frame,
            line: o.line,
            placement,
            point_in_camera: o.point_in_camera,
            covariance: symmetric(o.covariance),
        });
    }
    Ok(PlacedFeatures { list, sheet: observations.sheet, noise, dejittered, skipped })
}
