//! Places a live stream in base: poses and seam features go in on arrival, points in base come out.

use crate::input::observations::point_in_camera;
use crate::input::skip::Skip;
use nalgebra::{Point3, Vector3};
use std::collections::VecDeque;
use trueline_dataset::{Guess, Measured, RobotSample, Sensor};
use trueline_geometry::{Pose, se3};
use trueline_model::SheetShape;

/// Places the seam points of a running sensor with a calibration.
///
/// A feature is placed at its exposure, stamp − time offset, between the two poses around it. Nothing is extrapolated. If the pose after the
/// exposure has not arrived yet, the answer is [`Placement::TooEarly`], and the same call succeeds later.
///
/// ```
/// use trueline_dataset::{Guess, Measured, RobotSample, Sensor};
/// use trueline_geometry::Pose;
/// use trueline_method::evaluate::live_placement::{LivePlacement, Placement};
///
/// let calibration = Guess { time_offset_s: 0.010, tool_from_camera: Pose::identity() };
/// let mut live = LivePlacement::new(Sensor::Profiler, calibration);
/// for (stamp_ns, x) in [(0, 0.0), (20_000_000, 0.2)] {
///     let base_from_tool = Pose::translation(x, 0.0, 0.0);
///     live.add_pose(RobotSample { stamp_ns, device_ns: None, base_from_tool });
/// }
/// // Exposed at 15 ms, when the tool was at 0.15 m.
/// let Placement::At(point) = live.place(25_000_000, Measured::Profile([0.0, 0.3])) else { panic!("placed") };
/// assert!((point - nalgebra::Vector3::new(0.15, 0.0, 0.3)).norm() < 1e-12);
/// ```
#[derive(Clone, Debug)]
pub struct LivePlacement {
    sensor: Sensor,
    shape: Option<SheetShape>,
    by: Guess,
    poses: VecDeque<RobotSample>,
}

/// Place of a seam point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Placement {
    /// In base, m.
    At(Vector3<f64>),
    /// The pose after the exposure has not arrived yet. Repeat the call later.
    TooEarly,
    /// The poses around the exposure are missing: before the first, discarded, or lost in a gap.
    NoPose,
    /// The feature gives no point on the laser plane.
    NoPoint(Skip),
}

/// Time for which poses are kept, ns.
const KEPT_NS: i64 = 5_000_000_000;
/// Longest time between poses that are interpolated, ns.
const GAP_NS: i64 = 100_000_000;

impl LivePlacement {
    /// For a sensor with its calibration.
    #[must_use]
    pub fn new(sensor: Sensor, by: Guess) -> Self {
        Self { sensor, shape: None, by, poses: VecDeque::new() }
    }

    /// The same with the sensor's shape from its file.
    #[must_use]
    pub fn with_shape(mut self, shape: Option<SheetShape>) -> Self {
        self.shape = shape;
        self
    }

    /// Adds a pose. Returns `false` and changes nothing if it is not newer than the last.
    pub fn add_pose(&mut self, sample: RobotSample) -> bool {
        if self.poses.back().is_some_and(|last| sample.stamp_ns <= last.stamp_ns) {
            return false;
        }
        self.poses.push_back(sample);
        // The last pose before the horizon is kept, so that the rest can be interpolated.
        while self.poses.get(1).is_some_and(|second| sample.stamp_ns - second.stamp_ns > KEPT_NS) {
            self.poses.pop_front();
        }
        true
    }

    /// Place in base of a feature in an image with the stamp `stamp_ns`.
    #[must_use]
    pub fn place(&self, stamp_ns: i64, measured: Measured) -> Placement {
        let point = match point_in_camera(&self.sensor, self.shape.as_ref(), measured) {
            Ok(point) => point,
            Err(reason) => return Placement::NoPoint(reason),
        };
        let exposed_ns = stamp_ns - (self.by.time_offset_s * 1e9).round() as i64;
        match self.pose_at(exposed_ns) {
            Ok(base_from_tool) => {
                let base_from_camera = base_from_tool * self.by.tool_from_camera;
                Placement::At(base_from_camera.transform_point(&Point3::from(point)).coords)
            }
            Err(missing) => missing,
        }
    }

    fn pose_at(&self, at_ns: i64) -> Result<Pose, Placement> {
        let after = self.poses.partition_point(|sample| sample.stamp_ns < at_ns);
        let Some(right) = self.poses.get(after) else { return Err(Placement::TooEarly) };
        if right.stamp_ns == at_ns {
            return Ok(right.base_from_tool);
        }
        let left = after.checked_sub(1).and_then(|before| self.poses.get(before)).ok_or(Placement::NoPose)?;
        let span_ns = right.stamp_ns - left.stamp_ns;
        if span_ns > GAP_NS {
            return Err(Placement::NoPose);
        }
        Ok(between(left, right, (at_ns - left.stamp_ns) as f64 / span_ns as f64))
    }
}

/// Linear in position, and at a constant rate in rotation.
fn between(left: &RobotSample, right: &RobotSample, share: f64) -> Pose {
    let (a, b) = (&left.base_from_tool, &right.base_from_tool);
    let turn = a.rotation.rotation_to(&b.rotation);
    let rotation = turn.powf(share) * a.rotation;
    se3::from_parts(rotation, a.translation.vector.lerp(&b.translation.vector, share))
}
