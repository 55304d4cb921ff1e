//! An external axis: a table, a positioner, a track, a gantry.
//!
//! A rotary axis rotates its load about a line, a linear one shifts it along a direction. With direction d, point c and
//! value v in units of the axis (rad or m), its motion takes a carried point from its place at v = 0 to
//!
//! ```text
//! rotary: p' = Exp(s v d) (p − c) + c        linear: p' = p + s v d
//! ```

use crate::{Pose, se3, so3};
use nalgebra::{Matrix3x2, SMatrix, SVector, UnitVector3, Vector3};

/// How an axis moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisKind {
    /// Rotation. Values are angles.
    Rotary,
    /// Translation. Values are lengths.
    Linear,
}

impl AxisKind {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Rotary, Self::Linear];

    /// Its name in files and options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Rotary => "rotary",
            Self::Linear => "linear",
        }
    }

    /// The kind with a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

/// Place of an axis and meaning of its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Rotary or linear.
    pub kind: AxisKind,
    /// Direction d, in base.
    pub direction: UnitVector3<f64>,
    /// A point c of a rotary axis, in base, m. Unused for a linear axis.
    pub point_m: Vector3<f64>,
    /// Scale s: motion for a value of one.
    pub scale: f64,
    /// Delay of its stamps, s. A value stamped t belongs to t − offset.
    pub time_offset_s: f64,
}

/// Numbers of an axis: direction 2 (rad), point 2 (m), scale 1, time offset 1 (s).
pub const AXIS: usize = 6;
/// First number of the point.
pub const AXIS_POINT: usize = 2;
/// The scale.
pub const AXIS_SCALE: usize = 4;
/// The time offset.
pub const AXIS_TIME_OFFSET: usize = 5;

impl Axis {
    /// An axis of unit scale without a time offset.
    #[must_use]
    pub fn new(kind: AxisKind, direction: UnitVector3<f64>, point_m: Vector3<f64>) -> Self {
        Self { kind, direction, point_m, scale: 1.0, time_offset_s: 0.0 }
    }

    /// The motion of its load from the value zero to this one (rad or m).
    #[must_use]
    pub fn motion(&self, value: f64) -> Pose {
        let moved = self.scale * value;
        match self.kind {
            AxisKind::Rotary => {
                let turn = so3::exp(&(self.direction.as_ref() * moved));
                se3::from_parts(turn, self.point_m - turn * self.point_m)
            }
            AxisKind::Linear => Pose::translation(
                self.direction.x * moved,
                self.direction.y * moved,
                self.direction.z * moved,
            ),
        }
    }

    /// Two directions perpendicular to the axis and to each other, for the uncertainties of direction and point.
    #[must_use]
    pub fn across(&self) -> Matrix3x2<f64> {
        let d = self.direction.as_ref();
        let least = d.iamin();
        let first = d.cross(&Vector3::ith(least, 1.0)).normalize();
        Matrix3x2::from_columns(&[first, d.cross(&first)])
    }

    /// Moves its numbers by a step. See [`AXIS`].
    #[must_use]
    pub fn retract(&self, step: &SVector<f64, AXIS>) -> Self {
        let across = self.across();
        let lean = across * step.fixed_rows::<2>(0);
        // The rotation that leans the direction by that amount.
        let turn = so3::exp(&self.direction.cross(&lean));
        Self {
            kind: self.kind,
            direction: UnitVector3::new_normalize(turn * self.direction.as_ref()),
            point_m: self.point_m + across * step.fixed_rows::<2>(AXIS_POINT),
            scale: self.scale + step[AXIS_SCALE],
            time_offset_s: self.time_offset_s + step[AXIS_TIME_OFFSET],
        }
    }

    /// Jacobian of a carried point by the numbers of the axis, at a value (rad or m) that changes at a rate (1/s). `moved` is the point after the
    /// motion of the axis.
    #[must_use]
    pub fn d_moved(&self, value: f64, rate: f64, moved: &Vector3<f64>) -> SMatrix<f64, 3, AXIS> {
        let d = self.direction.as_ref();
        let across = self.across();
        let mut by = SMatrix::<f64, 3, AXIS>::zeros();
        let along = match self.kind {
            AxisKind::Rotary => {
                let angle = self.scale * value;
                let (sin, cos) = angle.sin_cos();
                let from_axis = moved - self.point_m;
                for k in 0..2 {
                    let lean: Vector3<f64> = across.column(k).into();
                    // J_l(s v d) s v ε for a lean ε orthogonal to d.
                    let turned = lean * sin + d.cross(&lean) * (1.0 - cos);
                    by.set_column(k, &turned.cross(&from_axis));
                    by.set_column(AXIS_POINT + k, &(lean - so3::exp(&(d * angle)) * lean));
                }
                d.cross(&from_axis)
            }
            AxisKind::Linear => {
                by.fixed_columns_mut::<2>(0).copy_from(&(across * (self.scale * value)));
                *d
            }
        };
        by.set_column(AXIS_SCALE, &(along * value));
        by.set_column(AXIS_TIME_OFFSET, &(along * (self.scale * rate)));
        by
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes() -> [Axis; 2] {
        let direction = UnitVector3::new_normalize(Vector3::new(0.2, -0.7, 1.1));
        [AxisKind::Rotary, AxisKind::Linear].map(|kind| Axis {
            scale: 1.02,
            time_offset_s: 0.01,
            ..Axis::new(kind, direction, Vector3::new(0.8, -0.3, 0.1))
        })
    }

    #[test]
    fn a_rotary_axis_leaves_its_own_points_where_they_are() {
        let [rotary, linear] = axes();
        let own = rotary.point_m + rotary.direction.as_ref() * 0.7;
        assert!((rotary.motion(0.9) * nalgebra::Point3::from(own) - own).coords.norm() < 1e-15);
        // Its rotation is right-handed about its direction.
        let beside = rotary.point_m + rotary.across().column(0);
        let moved = (rotary.motion(0.01) * nalgebra::Point3::from(beside)).coords - beside;
        assert!(moved.dot(&rotary.across().column(1)) > 0.0);
        assert!((linear.motion(0.5).translation.vector - linear.direction.as_ref() * 0.51).norm() < 1e-15);
    }

    /// Central differences over 1e-6 leave 1e-12 of third derivatives and round to 1e-10.
    #[test]
    fn slopes_are_those_of_the_motion() {
        let point = Vector3::new(0.4, 0.9, -0.2);
        let (value, rate, step) = (0.6, 0.35, 1e-6);
        for axis in axes() {
            let place = |axis: &Axis| {
                // With a later stamp the value is from further along.
                let value = value + rate * (axis.time_offset_s - 0.01);
                (axis.motion(value) * nalgebra::Point3::from(point)).coords
            };
            let by = axis.d_moved(value, rate, &place(&axis));
            for k in 0..AXIS {
                let moved = |sign: f64| {
                    let mut delta = SVector::<f64, AXIS>::zeros();
                    delta[k] = sign * step;
                    place(&axis.retract(&delta))
                };
                let slope = (moved(1.0) - moved(-1.0)) / (2.0 * step);
                assert!(
                    (slope - by.column(k)).norm() < 1e-9,
                    "{:?} {k}: {slope} {}",
                    axis.kind,
                    by.column(k)
                );
            }
        }
    }
}
