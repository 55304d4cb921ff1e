//! An external axis as the placer needs it.

use nalgebra::SMatrix;
use trueline_geometry::Axis;
use trueline_geometry::axis::{AXIS, AXIS_POINT, AXIS_SCALE, AXIS_TIME_OFFSET};

/// Covariance of the numbers of an axis, in the order of [`trueline_geometry::axis::AXIS`]: direction (2, rad), point (2, m), scale, time
/// offset (s).
pub type AxisCovariance = SMatrix<f64, AXIS, AXIS>;

/// The body that an axis moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisCarries {
    /// The part: a table, a positioner. Points come out in the frame of the part, as it lies with the axis at zero.
    Part,
    /// The whole robot: a track, a gantry.
    Robot,
    /// The sensor, on the tool.
    Sensor,
}

/// An axis at a known place. The order of the axes is that of the chain, from the base outward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExternalAxis {
    /// Its pose in base, or in the tool if it carries the sensor.
    pub axis: Axis,
    /// The body that it moves.
    pub carries: AxisCarries,
    /// The axis as the controller has it, where the poses that the controller reports contain its motion already.
    pub in_pose: Option<Axis>,
    /// Uncertainty of its numbers.
    pub covariance: AxisCovariance,
}

/// Most axes of a cell.
pub(crate) const MOST_AXES: usize = 12;
/// No axis is later than this, s.
const LONGEST_OFFSET_S: f64 = 10.0;
/// No axis is further from the origin than this, m.
const FURTHEST_M: f64 = 1e5;

impl ExternalAxis {
    /// Covariance of independent errors: standard deviations of the direction (rad) and of the point (m) in either direction square to the
    /// axis, of the scale, and of the time offset (s).
    #[must_use]
    pub fn covariance_of(direction_rad: f64, point_m: f64, scale: f64, time_s: f64) -> AxisCovariance {
        let mut covariance = AxisCovariance::zeros();
        for k in 0..2 {
            covariance[(k, k)] = direction_rad * direction_rad;
            covariance[(AXIS_POINT + k, AXIS_POINT + k)] = point_m * point_m;
        }
        covariance[(AXIS_SCALE, AXIS_SCALE)] = scale * scale;
        covariance[(AXIS_TIME_OFFSET, AXIS_TIME_OFFSET)] = time_s * time_s;
        covariance
    }

    /// Whether all its numbers are possible for an axis.
    #[must_use]
    pub(crate) fn is_good(&self) -> bool {
        let is_axis = |axis: &Axis| {
            axis.point_m.iter().all(|number| number.abs() <= FURTHEST_M)
                && axis.direction.iter().all(|number| number.is_finite())
                && axis.scale.is_finite()
                && axis.scale != 0.0
                && axis.time_offset_s.abs() <= LONGEST_OFFSET_S
        };
        is_axis(&self.axis)
            && self.in_pose.as_ref().is_none_or(is_axis)
            && self.covariance.iter().all(|number| number.is_finite())
            && (0..AXIS).all(|k| self.covariance[(k, k)] >= 0.0)
    }
}
