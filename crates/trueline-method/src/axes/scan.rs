//! The data for the search of axes: readings, and the robot's path without the axes.

use crate::axes::state::State;
use crate::config::Config;
use crate::error::Error;
use crate::input::axis_chain::AxisChain;
use crate::input::observations::{observe_by, origin_ns};
use crate::input::timestamps::Sampling;
use crate::thinning::stride;
use nalgebra::{Vector2, Vector3};
use std::collections::BTreeMap;
use trueline_dataset::{AxisRecord, Recording};
use trueline_geometry::{AxisKind, Pose, Trajectory};

/// A reading of a seam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    /// Its stamp, s.
    pub stamp_s: f64,
    /// The measured point in the camera frame, m.
    pub point: Vector3<f64>,
}

/// A scan without its axes.
pub(crate) struct AxisScan {
    /// The robot's path, as the controller reports it.
    pub path: Trajectory,
    /// The axes, at their assumed places.
    pub chain: AxisChain,
    /// Readings of the seam with the most of them.
    pub readings: Vec<Reading>,
    /// The direction of each axis, if stated.
    pub directions: Vec<Option<Vector3<f64>>>,
    /// Whether the robot stands at each reading: then there is no delay.
    pub at_stops: bool,
    /// Normal of the laser plane in the camera frame.
    pub normal: Vector3<f64>,
}

/// The line with the most readings, which the search uses.
#[must_use]
pub(crate) fn most_read(recording: &Recording) -> Option<u32> {
    let mut counts = BTreeMap::new();
    recording.features.iter().for_each(|feature| *counts.entry(feature.line).or_insert(0_usize) += 1);
    counts.into_iter().max_by_key(|(_, count)| *count).map(|(line, _)| line)
}

/// An axis runs evenly if its values deviate from a straight course by less than this: rad …
const EVEN_RAD: f64 = 2e-3;
/// … and m.
const EVEN_M: f64 = 1e-3;

/// Whether an axis runs evenly during all readings. A shift of its clock then turns or shifts everything that it carries
/// equally, so nothing determines it.
#[must_use]
pub fn runs_evenly(record: &AxisRecord, recording: &Recording) -> bool {
    let stamps = || recording.features.iter().map(|feature| feature.stamp_ns);
    let (Some(first), Some(last)) = (stamps().min(), stamps().max()) else { return false };
    let read = record.values.iter().filter(|value| (first..=last).contains(&value.stamp_ns));
    let course: Vec<[f64; 2]> =
        read.map(|value| [(value.stamp_ns - first) as f64 * 1e-9, value.value]).collect();
    let count = course.len().max(1) as f64;
    let mean = [0, 1].map(|k| course.iter().map(|at| at[k]).sum::<f64>() / count);
    let product = |k: usize| course.iter().map(|at| (at[0] - mean[0]) * (at[k] - mean[k])).sum::<f64>();
    let rate = product(1) / product(0).max(f64::MIN_POSITIVE);
    let off = |at: &[f64; 2]| (at[1] - mean[1] - rate * (at[0] - mean[0])).abs();
    let even = if record.kind == AxisKind::Rotary { EVEN_RAD } else { EVEN_M };
    course.len() > 2 && course.iter().map(off).fold(0.0, f64::max) < even
}

impl AxisScan {
    /// From a recording.
    ///
    /// # Errors
    /// Streams that are no scan.
    pub(crate) fn of(recording: &Recording, chain: AxisChain, config: &Config) -> Result<Self, Error> {
        let plain = Recording { axes: Vec::new(), ..recording.clone() };
        let sampling = Sampling::of(&plain, origin_ns(&plain));
        let observations = observe_by(sampling.of_arrival(config), &plain, &sampling, config)?;
        let most = most_read(recording).unwrap_or(0);
        let stated = recording.axes.iter().map(|axis| Some(axis.guess?.direction.into_inner()));
        let own = observations.list.iter().filter(|o| o.line == most);
        Ok(Self {
            readings: own.map(|o| Reading { stamp_s: o.stamp_s, point: o.point_in_camera }).collect(),
            directions: stated.collect(),
            at_stops: recording.at_stops,
            normal: observations.sheet.plane().normal().into_inner(),
            path: observations.robot.trajectory,
            chain,
        })
    }

    /// The same scan with other axes.
    #[must_use]
    pub(crate) fn with_chain(&self, chain: AxisChain) -> Self {
        Self {
            chain,
            path: self.path.clone(),
            readings: self.readings.clone(),
            directions: self.directions.clone(),
            ..*self
        }
    }

    /// At most this many of its readings, evenly.
    #[must_use]
    pub(crate) fn some(&self, most: usize) -> Vec<Reading> {
        let step = stride(self.readings.len(), most);
        self.readings.iter().step_by(step).copied().collect()
    }

    /// Distance of a reading from the seam in both directions perpendicular to it, m; `None` if the robot or an axis has no
    /// pose then.
    #[must_use]
    pub(crate) fn off_m(&self, at: &State, reading: &Reading) -> Option<Vector2<f64>> {
        let time_s = reading.stamp_s - at.time_offset_s;
        let lines_from_carrier: Pose = at.chain.lines_from_carrier(&self.path.pose_at(time_s)?, time_s)?;
        let point = lines_from_carrier * (at.tool_from_camera * nalgebra::Point3::from(reading.point));
        Some(at.line.offset_of(&point.coords))
    }
}
