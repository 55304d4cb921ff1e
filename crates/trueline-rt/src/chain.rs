//! The external axes as links from the points to the sensor's carrier.
//!
//! With axes A that carry the part, B that carry the robot and C that carry the sensor, each from the base outward,
//!
//! ```text
//! lines_from_carrier(t) = (A₁ … Aₙ)⁻¹ B₁ … Bₘ base_from_tool(t) C₁ … Cₗ,
//! ```
//!
//! and if the sensor stands beside the robot, `(A₁ … Aₙ)⁻¹ tool_from_base(t) (B₁ … Bₘ)⁻¹ C₁ … Cₗ`. Axes that the
//! controller's poses contain already are removed at the controller's places, and put in at their true ones. So does the
//! estimate.

use crate::axis_stream::{AxisAt, AxisStream};
use crate::calibration::Carrier;
use crate::error::PlaceError;
use crate::external_axis::{AxisCarries, AxisCovariance, ExternalAxis, MOST_AXES};
use crate::located::Located;
use crate::settings::Settings;
use crate::stamps::seconds;
use nalgebra::{Matrix3x4, Matrix4, Point3, SMatrix, Vector3};
use trueline_geometry::axis::{AXIS, AXIS_TIME_OFFSET};
use trueline_geometry::{Axis, Pose, se3, so3};

/// The motion of the whole chain is that over so long, s: short for a robot, long for double precision.
const STEP_S: f64 = 1e-4;

/// An axis with its values.
#[derive(Debug)]
struct Link {
    axis: ExternalAxis,
    stream: AxisStream,
}

/// A link on its way from the points to the sensor.
#[derive(Clone, Copy, Debug)]
struct Factor {
    link: usize,
    /// Whether it is the inverse of its motion.
    is_inverse: bool,
}

/// All axes.
#[derive(Debug)]
pub(crate) struct Chain {
    links: Vec<Link>,
    before: Vec<Factor>,
    behind: Vec<Factor>,
}

/// Values of all links at one time: the true values of the axes, and the controller's.
#[derive(Clone, Copy, Debug)]
struct Values {
    own: [AxisAt; MOST_AXES],
    in_pose: [AxisAt; MOST_AXES],
}

/// Pose of the sensor's carrier among the axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Carried {
    /// The carrier in the frame of the points, and its motion; the uncertainties are those of the robot alone.
    pub located: Located,
    /// From the carrier to the tool: the motion of the axes that carry the sensor.
    pub tool_from_carrier: Pose,
    /// The variance of a point of the carrier by the axes, m², by (p, 1).
    pub by_axes: Matrix4<f64>,
}

impl Chain {
    pub(crate) fn new(axes: &[ExternalAxis], carrier: Carrier, settings: &Settings) -> Self {
        let links =
            axes.iter().map(|axis| Link { axis: *axis, stream: AxisStream::new(settings, axis.axis.kind) });
        let of = |carries: AxisCarries, is_inverse: bool| {
            let numbers = axes.iter().enumerate().filter(move |(_, axis)| axis.carries == carries);
            let mut factors: Vec<Factor> = numbers.map(|(link, _)| Factor { link, is_inverse }).collect();
            if is_inverse {
                factors.reverse();
            }
            factors
        };
        let (mut before, mut behind) = (of(AxisCarries::Part, true), Vec::new());
        match carrier {
            Carrier::Tool => before.extend(of(AxisCarries::Robot, false)),
            Carrier::Fixed => behind.extend(of(AxisCarries::Robot, true)),
        }
        behind.extend(of(AxisCarries::Sensor, false));
        Self { links: links.collect(), before, behind }
    }

    /// Whether there are no axes.
    pub(crate) fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// Their number.
    pub(crate) fn count(&self) -> usize {
        self.links.len()
    }

    /// The values of an axis, by its number.
    pub(crate) fn stream(&self, axis: usize) -> Option<&AxisStream> {
        self.links.get(axis).map(|link| &link.stream)
    }

    /// The same, to add some.
    pub(crate) fn stream_mut(&mut self, axis: usize) -> Option<&mut AxisStream> {
        self.links.get_mut(axis).map(|link| &mut link.stream)
    }

    /// Whether all axes have values enough.
    pub(crate) fn is_settled(&self) -> bool {
        self.links.iter().all(|link| {
            link.stream.is_settled() && link.stream.clock().is_none_or(|clock| clock.is_settled())
        })
    }

    /// Puts the axes around the robot, at a time after an origin, s.
    pub(crate) fn carried(
        &self,
        robot: &Located,
        origin_ns: i64,
        time_s: f64,
    ) -> Result<Carried, PlaceError> {
        let values = self.values(origin_ns, time_s)?;
        let (at, behind) = self.whole(&values, &robot.base_from_tool, 0.0);
        let moved = se3::from_parts(
            so3::exp(&(robot.angular_velocity * STEP_S)) * robot.base_from_tool.rotation,
            robot.base_from_tool.translation.vector + robot.velocity * STEP_S,
        );
        let (next, _) = self.whole(&values, &moved, STEP_S);
        let velocity = (next.translation.vector - at.translation.vector) / STEP_S;
        let angular_velocity = so3::log(&(next.rotation * at.rotation.inverse())) / STEP_S;
        let ages_s = values.own[..self.links.len()].iter().map(|value| value.age_s);
        let located = Located {
            base_from_tool: at,
            velocity,
            angular_velocity,
            age_s: ages_s.fold(robot.age_s, f64::min),
            ..*robot
        };
        let by_axes = self.by_axes(&values, &robot.base_from_tool);
        Ok(Carried { located, tool_from_carrier: behind, by_axes })
    }

    fn values(&self, origin_ns: i64, time_s: f64) -> Result<Values, PlaceError> {
        let mut values =
            Values { own: [AxisAt::default(); MOST_AXES], in_pose: [AxisAt::default(); MOST_AXES] };
        for (k, link) in self.links.iter().enumerate() {
            let since_s = time_s + seconds(origin_ns, link.stream.origin_ns);
            let at = |axis: &Axis| {
                let at = link.stream.at(since_s + axis.time_offset_s);
                at.map_err(|problem| PlaceError::Axis { axis: k, problem })
            };
            values.own[k] = at(&link.axis.axis)?;
            if let Some(nominal) = &link.axis.in_pose {
                values.in_pose[k] = at(nominal)?;
            }
        }
        Ok(values)
    }

    /// The whole chain with a pose of the robot, and the links behind the robot, a little later than the values.
    fn whole(&self, values: &Values, robot: &Pose, later_s: f64) -> (Pose, Pose) {
        let product = |factors: &[Factor]| {
            let motions = factors.iter().map(|factor| self.motion(*factor, values, later_s));
            motions.fold(Pose::identity(), |product, motion| product * motion)
        };
        let behind = product(&self.behind);
        (product(&self.before) * self.robot_alone(values, robot, later_s) * behind, behind)
    }

    fn motion(&self, factor: Factor, values: &Values, later_s: f64) -> Pose {
        let at = &values.own[factor.link];
        let moved = self.links[factor.link].axis.axis.motion(at.value + at.rate * later_s);
        if factor.is_inverse { moved.inverse() } else { moved }
    }

    /// Variance of a point of the carrier from the uncertainty of each axis.
    fn by_axes(&self, values: &Values, robot: &Pose) -> Matrix4<f64> {
        let mut form = Matrix4::zeros();
        // From the carrier to where each link has taken it, from the sensor toward the points.
        let mut from_carrier = Pose::identity();
        for factor in self.behind.iter().rev() {
            from_carrier = self.add_axis(&mut form, *factor, values, &from_carrier);
        }
        from_carrier = self.robot_alone(values, robot, 0.0) * from_carrier;
        for factor in self.before.iter().rev() {
            from_carrier = self.add_axis(&mut form, *factor, values, &from_carrier);
        }
        form
    }

    /// The robot's pose without the axes that it contains.
    fn robot_alone(&self, values: &Values, robot: &Pose, later_s: f64) -> Pose {
        let product = |factors: &[Factor]| {
            factors.iter().fold(Pose::identity(), |product, factor| {
                let Some(nominal) = &self.links[factor.link].axis.in_pose else { return product };
                let at = &values.in_pose[factor.link];
                let moved = nominal.motion(at.value + at.rate * later_s);
                product * if factor.is_inverse { moved.inverse() } else { moved }
            })
        };
        product(&self.before).inverse() * robot * product(&self.behind).inverse()
    }

    /// Adds the variance by one link; returns the pose of the carrier behind it.
    fn add_axis(
        &self,
        form: &mut Matrix4<f64>,
        factor: Factor,
        values: &Values,
        from_carrier: &Pose,
    ) -> Pose {
        let ExternalAxis { axis, covariance, .. } = &self.links[factor.link].axis;
        let at = &values.own[factor.link];
        let behind = self.motion(factor, values, 0.0) * from_carrier;
        // Of an inverse x = A⁻¹ y the point that the axis has moved is y, and dx = −A⁻¹ dA x is as long as dA x.
        let moved = if factor.is_inverse { from_carrier } else { &behind };
        *form += variance(axis, covariance, at, moved);
        behind
    }
}

/// The variance of a point of the carrier by one axis that has taken the carrier to `moved`.
fn variance(axis: &Axis, covariance: &AxisCovariance, at: &AxisAt, moved: &Pose) -> Matrix4<f64> {
    // At a rate of 1 the column of the time offset is that of the value.
    let slopes = |point: Vector3<f64>| axis.d_moved(at.value, 1.0, &(moved * Point3::from(point)).coords);
    let origin = slopes(Vector3::zeros());
    let along: [SMatrix<f64, 3, AXIS>; 3] = std::array::from_fn(|k| slopes(Vector3::ith(k, 1.0)) - origin);
    let by: [Matrix3x4<f64>; AXIS] = std::array::from_fn(|k| {
        Matrix3x4::from_columns(&[
            along[0].column(k).into_owned(),
            along[1].column(k).into_owned(),
            along[2].column(k).into_owned(),
            origin.column(k).into_owned(),
        ])
    });
    let mut form = by[AXIS_TIME_OFFSET].transpose()
        * by[AXIS_TIME_OFFSET]
        * (at.sigma * at.sigma + (at.rate * at.sigma_s).powi(2));
    let times = |k: usize| if k == AXIS_TIME_OFFSET { at.rate } else { 1.0 };
    for i in 0..AXIS {
        for j in 0..AXIS {
            let shared = covariance[(i, j)] * times(i) * times(j);
            if shared != 0.0 {
                form += by[i].transpose() * by[j] * shared;
            }
        }
    }
    form
}
