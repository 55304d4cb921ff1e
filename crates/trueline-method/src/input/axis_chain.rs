//! The external axes of a cell as links of the chain from the lines to the sensor's carrier.
//!
//! With axes A that carry the part, B that carry the robot and C that carry the sensor, each listed from the base outward,
//!
//! ```text
//! lines_from_carrier(t) = (A₁ … Aₙ)⁻¹ B₁ … Bₘ base_from_tool(t) C₁ … Cₗ,
//! ```
//!
//! and for a sensor that stands beside the robot, `(A₁ … Aₙ)⁻¹ tool_from_base(t) (B₁ … Bₘ)⁻¹ C₁ … Cₗ`: then A are on the tool and B, C in base. Axes
//! that the controller's poses already contain are removed with the controller's values, and inserted with the estimated ones.

use crate::error::Error;
use crate::input::clock_model::{self, Ticks};
use nalgebra::{Matrix3xX, Point3, Vector3};
use std::sync::Arc;
use trueline_dataset::sensor_setup::Mounted;
use trueline_dataset::{AxisRecord, Carries, Recording};
use trueline_geometry::axis::AXIS;
use trueline_geometry::{Axis, Pose};

/// Times closer than this are equal, s: stamps count nanoseconds.
const ROUNDING_S: f64 = 1e-9;

/// Values of an axis over time since the start of the recording.
#[derive(Clone, Debug)]
pub(crate) struct Values {
    times_s: Vec<f64>,
    values: Vec<f64>,
}

impl Values {
    /// From a record. Values at regular intervals get the times of their regular clock.
    fn of(record: &AxisRecord, origin_ns: i64) -> Self {
        let mut times_s = Vec::with_capacity(record.values.len());
        let mut values = Vec::with_capacity(record.values.len());
        for value in &record.values {
            let time_s = (value.stamp_ns - origin_ns) as f64 * 1e-9;
            // If several values have one stamp, the last is used.
            if times_s.last().is_some_and(|last| *last >= time_s) {
                values.pop();
                times_s.pop();
            }
            times_s.push(time_s);
            values.push(value.value);
        }
        if let Some(clock) = clock_model::fit(&times_s, Ticks::Counted) {
            times_s = clock.regular_s;
        }
        Self { times_s, values }
    }

    /// Value and rate at a time, s, from cubic pieces through the values. `None` before the first and after the last.
    #[must_use]
    pub(crate) fn at(&self, time_s: f64) -> Option<(f64, f64)> {
        let next = self.times_s.partition_point(|t| *t <= time_s);
        let last = self.times_s.len() - 1;
        if time_s < self.times_s[0] - ROUNDING_S || time_s > self.times_s[last] + ROUNDING_S {
            return None;
        }
        let k = next.saturating_sub(1).min(last - 1);
        let span_s = self.times_s[k + 1] - self.times_s[k];
        let u = (time_s - self.times_s[k]) / span_s;
        let (from, to) = (self.values[k], self.values[k + 1]);
        let [out, into] = [k, k + 1].map(|k| self.slope(k) * span_s);
        let (u2, u3) = (u * u, u * u * u);
        let value = from * (2.0 * u3 - 3.0 * u2 + 1.0)
            + out * (u3 - 2.0 * u2 + u)
            + to * (3.0 * u2 - 2.0 * u3)
            + into * (u3 - u2);
        let rate = (from * (6.0 * u2 - 6.0 * u)
            + out * (3.0 * u2 - 4.0 * u + 1.0)
            + to * (6.0 * u - 6.0 * u2)
            + into * (3.0 * u2 - 2.0 * u))
            / span_s;
        Some((value, rate))
    }

    fn slope(&self, k: usize) -> f64 {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(self.values.len() - 1));
        (self.values[after] - self.values[before]) / (self.times_s[after] - self.times_s[before])
    }
}

/// An axis in the chain.
#[derive(Clone, Debug)]
pub(crate) struct Link {
    /// Its place and direction.
    pub axis: Axis,
    /// The carried part.
    pub carries: Carries,
    /// The controller's own axis, if its poses contain it.
    pub in_pose: Option<Axis>,
    /// Whether it moves during readings, or its place is known. Otherwise it is treated as standing at zero.
    moves: bool,
    /// Its values.
    pub values: Arc<Values>,
    /// Whether its time offset is unobservable and therefore not estimated.
    pub holds_time_offset: bool,
}

impl Link {
    /// Its motion at a time, s, and the rate of its value.
    fn moved(&self, axis: &Axis, time_s: f64) -> Option<Pose> {
        if !self.moves {
            return Some(Pose::identity());
        }
        let (value, _) = self.values.at(time_s + axis.time_offset_s)?;
        Some(axis.motion(value))
    }
}

/// All axes of a cell.
#[derive(Clone, Debug)]
pub struct AxisChain {
    /// In the order of the cell's file.
    pub(crate) links: Vec<Link>,
    mounted: Mounted,
}

/// A link in the chain from the lines to the sensor.
struct Factor<'a> {
    number: usize,
    link: &'a Link,
    /// Whether the inverse of its motion is used.
    is_inverse: bool,
}

impl Factor<'_> {
    /// Its motion at a time, s.
    fn motion(&self, time_s: f64) -> Option<Pose> {
        let moved = self.link.moved(&self.link.axis, time_s)?;
        Some(if self.is_inverse { moved.inverse() } else { moved })
    }
}

/// The motions before and behind one link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around {
    /// From the lines to the link.
    pub before: Pose,
    /// From the link to the sensor's carrier.
    pub behind: Pose,
    /// Its value, negative if the inverse of its motion is used.
    pub value: f64,
}

impl AxisChain {
    /// The known axes of a recording. `None` if there are none.
    ///
    /// # Errors
    /// An axis that moves and is unknown.
    pub(crate) fn of(recording: &Recording) -> Result<Option<Self>, Error> {
        if recording.axes.is_empty() {
            return Ok(None);
        }
        let origin_ns = recording.robot.first().map_or(0, |sample| sample.stamp_ns);
        let link = |(record, moves): (&AxisRecord, bool)| {
            let stated = record.guess.map(|guess| {
                Axis::new(record.kind, guess.direction, guess.point_m.unwrap_or_else(Vector3::zeros))
            });
            let anywhere = Axis::new(record.kind, Vector3::z_axis(), Vector3::zeros());
            let axis = record.known.or((!moves).then_some(anywhere));
            Ok(Link {
                axis: axis.ok_or_else(|| Error::AxisUnknown { name: record.name.clone() })?,
                moves: moves || record.known.is_some(),
                carries: record.carries,
                in_pose: stated.filter(|_| record.in_pose),
                values: Arc::new(Values::of(record, origin_ns)),
                holds_time_offset: record.holds_time_offset,
            })
        };
        let links: Result<Vec<Link>, Error> =
            recording.axes.iter().zip(recording.axes_that_move()).map(link).collect();
        Ok(Some(Self { links: links?, mounted: recording.setup.mounted }))
    }

    /// Axes of a sensor on the tool, with the times (s) and values (rad or m) of their motion.
    #[must_use]
    pub fn planned(axes: Vec<(Axis, Carries, Vec<f64>)>, times_s: &[f64]) -> Self {
        let link = |(axis, carries, values): (Axis, Carries, Vec<f64>)| Link {
            axis,
            carries,
            in_pose: None,
            moves: true,
            values: Arc::new(Values { times_s: times_s.to_vec(), values }),
            holds_time_offset: false,
        };
        Self { links: axes.into_iter().map(link).collect(), mounted: Mounted::Tool }
    }

    /// The same motion of axes at other places.
    #[must_use]
    pub fn at_places(&self, axes: &[Axis]) -> Self {
        let links = self.links.iter().zip(axes).map(|(link, axis)| Link { axis: *axis, ..link.clone() });
        Self { links: links.collect(), mounted: self.mounted }
    }

    /// Whether its axes are at these places.
    #[must_use]
    pub fn is_at(&self, axes: &[Axis]) -> bool {
        self.links.iter().map(|link| &link.axis).eq(axes)
    }

    /// The values of all axes at a time, s; `None` before the first and after the last.
    #[must_use]
    pub fn values_at(&self, time_s: f64) -> Option<Vec<f64>> {
        self.links.iter().map(|link| Some(link.values.at(time_s)?.0)).collect()
    }

    /// The motion of a point of the part at a time, s: where a seam at zero values then is in base. `None` if an axis has no value.
    #[must_use]
    pub fn base_from_part(&self, time_s: f64) -> Option<Pose> {
        let own = self.links.iter().filter(|link| link.carries == Carries::Part);
        own.map(|link| link.moved(&link.axis, time_s)).try_fold(Pose::identity(), |all, own| Some(all * own?))
    }

    /// The pose of the sensor's carrier without the axes, by which it has this pose in the frame of the lines at a time, s. `None` if
    /// an axis has no value.
    #[must_use]
    pub fn without_axes(&self, lines_from_carrier: &Pose, time_s: f64) -> Option<Pose> {
        let [contained_before, contained_behind] = self.taken_out(time_s)?;
        let [before, behind] = self.products(time_s)?;
        Some(contained_before * before.inverse() * lines_from_carrier * behind.inverse() * contained_behind)
    }

    /// The motions of all factors before and behind the robot's pose at a time, s.
    fn products(&self, time_s: f64) -> Option<[Pose; 2]> {
        let [before, behind] = self.factors();
        let product = |factors: Vec<Factor<'_>>| {
            factors
                .into_iter()
                .try_fold(Pose::identity(), |product, factor| Some(product * factor.motion(time_s)?))
        };
        Some([product(before)?, product(behind)?])
    }

    /// The factors before and behind the robot's pose.
    fn factors(&self) -> [Vec<Factor<'_>>; 2] {
        let of = |carries: Carries, is_inverse: bool| {
            let links = self.links.iter().enumerate().filter(move |(_, link)| link.carries == carries);
            let mut factors: Vec<Factor<'_>> =
                links.map(|(number, link)| Factor { number, link, is_inverse }).collect();
            if is_inverse {
                factors.reverse();
            }
            factors
        };
        let (mut before, mut behind) = (of(Carries::Part, true), Vec::new());
        match self.mounted {
            Mounted::Tool => before.extend(of(Carries::Robot, false)),
            Mounted::Fixed => behind.extend(of(Carries::Robot, true)),
        }
        behind.extend(of(Carries::Sensor, false));
        [before, behind]
    }

    /// The motions that the controller's poses contain, before and behind the robot.
    fn taken_out(&self, time_s: f64) -> Option<[Pose; 2]> {
        let mut sides = [Pose::identity(); 2];
        for (side, factors) in sides.iter_mut().zip(self.factors()) {
            for Factor { link, is_inverse, .. } in factors {
                let Some(nominal) = &link.in_pose else { continue };
                let moved = link.moved(nominal, time_s)?;
                *side *= if is_inverse { moved.inverse() } else { moved };
            }
        }
        Some(sides)
    }

    /// The pose of the sensor's carrier in the frame of the lines, from its pose without the axes at a time, s. `None` if an axis has no value.
    #[must_use]
    pub fn lines_from_carrier(&self, without_axes: &Pose, time_s: f64) -> Option<Pose> {
        let [contained_before, contained_behind] = self.taken_out(time_s)?;
        let [before, behind] = self.products(time_s)?;
        let robot = contained_before.inverse() * without_axes * contained_behind.inverse();
        Some(before * robot * behind)
    }

    /// The motions before and behind one link, with its signed value at a time, s.
    #[must_use]
    pub(crate) fn around(&self, number: usize, without_axes: &Pose, time_s: f64) -> Option<Around> {
        let [contained_before, contained_behind] = self.taken_out(time_s)?;
        let robot = contained_before.inverse() * without_axes * contained_behind.inverse();
        let [before, behind] = self.factors();
        let mut sides = [Pose::identity(); 2];
        let (mut side, mut value) = (0, 0.0);
        // The robot's pose is between the two.
        for factor in before.iter().map(Some).chain([None]).chain(behind.iter().map(Some)) {
            let Some(factor) = factor else {
                sides[side] *= robot;
                continue;
            };
            if factor.number == number {
                let (own, _) = factor.link.values.at(time_s + factor.link.axis.time_offset_s)?;
                (side, value) = (1, if factor.is_inverse { -own } else { own });
                continue;
            }
            sides[side] *= factor.motion(time_s)?;
        }
        let [before, behind] = sides;
        Some(Around { before, behind, value })
    }

    /// Jacobian of a measured point in the frame of the lines by the numbers of each axis, 3 × 6 a link. `lines_from_carrier` is the pose with the
    /// axes at that time, s, and `point` the measured point, m.
    #[must_use]
    pub fn d_point(
        &self,
        lines_from_carrier: &Pose,
        point: &Vector3<f64>,
        time_s: f64,
    ) -> Option<Matrix3xX<f64>> {
        let mut by = Matrix3xX::zeros(AXIS * self.links.len());
        let [before, behind] = self.factors();
        let mut prefix = Pose::identity();
        for factor in before {
            prefix = self.one_d_point(&mut by, prefix, &factor, point, time_s)?;
        }
        // Behind the robot's pose the prefix is the whole chain without the following links.
        let after = behind
            .iter()
            .try_fold(Pose::identity(), |product, factor| Some(product * factor.motion(time_s)?))?;
        prefix = lines_from_carrier * after.inverse();
        for factor in behind {
            prefix = self.one_d_point(&mut by, prefix, &factor, point, time_s)?;
        }
        Some(by)
    }

    fn one_d_point(
        &self,
        by: &mut Matrix3xX<f64>,
        prefix: Pose,
        Factor { number, link, is_inverse }: &Factor<'_>,
        point: &Vector3<f64>,
        time_s: f64,
    ) -> Option<Pose> {
        if !link.moves {
            return Some(prefix);
        }
        let (value, rate) = link.values.at(time_s + link.axis.time_offset_s)?;
        let motion = link.axis.motion(value);
        let there = (prefix.inverse() * Point3::from(*point)).coords;
        let slopes = if *is_inverse {
            // x = A⁻¹ y: 0 = dA x + A dx.
            let moved = (motion * Point3::from(there)).coords;
            let own = link.axis.d_moved(value, rate, &moved);
            -(motion.rotation.inverse().to_rotation_matrix().into_inner() * own)
        } else {
            link.axis.d_moved(value, rate, &there)
        };
        let in_lines = prefix.rotation.to_rotation_matrix().into_inner() * slopes;
        by.columns_mut(AXIS * number, AXIS).copy_from(&in_lines);
        Some(prefix * if *is_inverse { motion.inverse() } else { motion })
    }
}

#[cfg(test)]
mod tests;
