//! Every feature with the sensor's pose at its exposure, from a known calibration: the input for a test of that calibration.

use crate::assess::residuals::why_not_placed;
use crate::config::{Config, Measurements};
use crate::error::Error;
use crate::input::noise_levels::{NoiseLevels, symmetric};
use crate::input::observations::{self, Observations, observe};
use crate::input::skip::Skip;
use crate::input::timestamps::{Dejittered, Sampling};
use crate::problem::placement::placement_at;
use crate::stripe::frames::{Sight, StripeFrame, Support, frames};
use nalgebra::{Matrix2, Vector3};
use std::collections::BTreeMap;
use trueline_dataset::{Guess, Recording};
use trueline_geometry::smoothed_velocity::smoothed_velocity;
use trueline_model::{LaserSheet, Placement};

/// One feature with the pose of the sensor.
#[derive(Clone, Copy, Debug)]
pub struct PlacedFeature {
    /// Stamp of its image since the first robot sample, s.
    pub stamp_s: f64,
    /// Index of its image among those with distinct stamps.
    pub frame: u32,
    /// Its seam.
    pub line: u32,
    /// Pose and motion of the sensor at the exposure. Velocities come from many samples, so that noise is not mistaken for motion.
    pub placement: Placement,
    /// The point in the camera frame, m.
    pub point_in_camera: Vector3<f64>,
    /// Covariance of the measurement in the sheet, m².
    pub covariance: Matrix2<f64>,
}

/// The stripes of both plates of a joint in one image, with the pose of the sensor.
#[derive(Clone, Copy, Debug)]
pub struct PlacedStripes {
    /// Stamp of the image since the first robot sample, s. That of its seam point, if there is one.
    pub stamp_s: f64,
    /// Its joint. Plates with other numbers belong to other seams.
    pub line: u32,
    /// As for [`PlacedFeature`].
    pub placement: Placement,
    /// Two support points of each plate.
    pub plates: [[Support; 2]; 2],
}

/// All features of a recording that can be placed.
#[derive(Clone, Debug)]
pub struct PlacedFeatures {
    /// By rising stamp.
    pub list: Vec<PlacedFeature>,
    /// The stripes of images that show both plates of a joint. Filled by [`place_with_stripes`] only.
    pub stripes: Vec<PlacedStripes>,
    /// The sheet they lie in.
    pub sheet: LaserSheet,
    /// Noise that features of one image share.
    pub noise: NoiseLevels,
    /// The same for the robot's attitude about each axis, rad. Measured together with the stripes.
    pub robot_sigma_rad: f64,
    /// Streams whose stamps were replaced by clock times.
    pub dejittered: Dejittered,
    /// Missing points by reason.
    pub skipped: BTreeMap<Skip, usize>,
}

/// Places every feature of a recording. Streams for which the calibration used clock times use them here too. A stream without a regular tick keeps
/// its recorded stamps, as [`PlacedFeatures::dejittered`] states.
///
/// # Errors
/// A recording that cannot be lifted onto the sheet: see [`observe`].
pub fn place(
    recording: &Recording,
    by: &Guess,
    wanted: Dejittered,
    config: &Config,
) -> Result<PlacedFeatures, Error> {
    Ok(placed(recording, by, wanted, config)?.0)
}

/// The same with the stripes of images that show both plates of a joint.
///
/// # Errors
/// Those of [`place`], and a recording whose stripes and seam points count their images differently.
pub fn place_with_stripes(
    recording: &Recording,
    by: &Guess,
    wanted: Dejittered,
    config: &Config,
) -> Result<PlacedFeatures, Error> {
    let (mut features, observations, robot_times_s) = placed(recording, by, wanted, config)?;
    if !recording.stripes.is_empty() {
        features.stripes = placed_stripes(recording, &observations, by, config)?;
        features.robot_sigma_rad = observations.robot.rotation_noise_rad(recording, &robot_times_s);
    }
    Ok(features)
}

/// The placed features, with their observations and the robot's times, s.
fn placed(
    recording: &Recording,
    by: &Guess,
    wanted: Dejittered,
    config: &Config,
) -> Result<(PlacedFeatures, Observations, Vec<f64>), Error> {
    let sampling = Sampling::of(recording, observations::origin_ns(recording));
    let dejittered = Dejittered {
        images: wanted.images && sampling.images.clock.is_some(),
        robot: wanted.robot && sampling.robot.clock.is_some(),
    };
    let observations = observe(recording, &sampling, config)?.restamped(
        recording,
        &sampling,
        config,
        [Dejittered::default(), dejittered],
    )?;
    let noise = NoiseLevels {
        robot_sigma_m: config.robot_sigma_m.unwrap_or(observations.robot.noise_m),
        stamp_sigma_s: sampling.stamp_sigma_s(config, dejittered),
        factor: 1.0,
    };
    let mut skipped = observations.skipped.clone();
    let mut list = Vec::with_capacity(observations.list.len());
    for o in &observations.list {
        let Some(placement) = placement(&observations, by, o.stamp_s) else {
            *skipped.entry(why_not_placed(&observations, o.stamp_s - by.time_offset_s)).or_insert(0) += 1;
            continue;
        };
        list.push(PlacedFeature {
            stamp_s: o.stamp_s,
            frame: o.frame,
            line: o.line,
            placement,
            point_in_camera: o.point_in_camera,
            covariance: symmetric(o.covariance),
        });
    }
    let (stripes, sheet) = (Vec::new(), observations.sheet);
    let features = PlacedFeatures { list, stripes, sheet, noise, robot_sigma_rad: 0.0, dejittered, skipped };
    Ok((features, observations, sampling.robot_times_s(dejittered).to_vec()))
}

/// Pose and motion of the sensor at the exposure of an image. `None` outside the recording or in a gap.
fn placement(observations: &Observations, by: &Guess, stamp_s: f64) -> Option<Placement> {
    let (trajectory, exposure_s) = (&observations.robot.trajectory, stamp_s - by.time_offset_s);
    let mut placement = placement_at(trajectory, exposure_s, &by.tool_from_camera)?;
    if let Some(smooth) = smoothed_velocity(trajectory, exposure_s) {
        placement.velocity = smooth.velocity;
        placement.angular_velocity = smooth.angular_velocity;
    }
    Some(placement)
}

fn placed_stripes(
    recording: &Recording,
    observations: &Observations,
    by: &Guess,
    config: &Config,
) -> Result<Vec<PlacedStripes>, Error> {
    let frames = frames(recording, observations, Measurements::Stripe, config)?;
    let of = |frame: &StripeFrame| {
        let Sight::Stripes([Some(left), Some(right)]) = frame.sight else { return None };
        let placement = placement(observations, by, frame.stamp_s)?;
        let (stamp_s, line) = (frame.stamp_s, frame.joint as u32);
        Some(PlacedStripes { stamp_s, line, placement, plates: [left, right] })
    };
    Ok(frames.list.iter().filter_map(of).collect())
}
