//! A known curve, placed in base, and the distance of the seam from it: c(u) = P(ξ) S(ς)·c_CAD(u) + N a.
//!
//! P is the pose of the part in base, with six unknowns. a is the seam's distance from the drawing in the two normals of each
//! control point, which turn with the part. The tolerance is the standard deviation of a. S is the size of the part; its standard
//! deviation is the tolerance over the curve's radius. Without S the mean of many control points would determine the size far
//! beyond the tolerance.

use crate::curve::arrow::Arrow;
use crate::curve::spline::Spline;
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use std::sync::Arc;
use trueline_geometry::{Pose, se3};

/// Unknowns of a place: shift, turn, and size about the middle of the curve.
pub(crate) const PLACE: usize = 7;
/// Number of them that are a pose.
const POSE: usize = 6;
/// Prior of a part's place, m and rad: directions that a straight or round curve leaves open get a finite value.
const LOOSE: (f64, f64) = (0.1, 1.0);
/// Damping of a step of the place, as a prior of this size, m and rad.
const DAMPED: (f64, f64) = (1e-3, 10e-3);

/// A known curve at a place.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    /// The curve in the part's frame, with its normals.
    drawn: Arc<(Spline, Vec<[Vector3<f64>; 2]>)>,
    /// Pose of the part.
    pub base_from_part: Pose,
    /// Relative excess of the part's size over the drawing.
    pub larger: f64,
    /// Root mean square distance of the drawn curve from its middle, m.
    pub radius_m: f64,
    /// Distance of the seam from the curve in both normals of each control point, m.
    pub off_m: Vec<Vector2<f64>>,
}

impl Placed {
    /// A curve in a part, at any pose.
    #[must_use]
    pub(crate) fn new(drawn: Spline, base_from_part: Pose) -> Self {
        let off_m = vec![Vector2::zeros(); drawn.control.len()];
        let normals = drawn.normals();
        let middle = middle_of(&drawn);
        let squares: f64 = drawn.control.iter().map(|c| (c - middle).norm_squared()).sum();
        let radius_m = (squares / drawn.control.len() as f64).sqrt();
        Self { drawn: Arc::new((drawn, normals)), base_from_part, larger: 0.0, radius_m, off_m }
    }

    /// The curve in base.
    #[must_use]
    pub(crate) fn spline(&self) -> Spline {
        let (drawn, normals) = &*self.drawn;
        let pose = self.base_from_part;
        let off = |k: usize| normals[k][0] * self.off_m[k].x + normals[k][1] * self.off_m[k].y;
        let middle = middle_of(drawn);
        let sized = |k: usize| drawn.control[k] + (drawn.control[k] - middle) * self.larger;
        let place = |k: usize| pose.rotation * (sized(k) + off(k)) + pose.translation.vector;
        Spline { control: (0..drawn.control.len()).map(place).collect(), ..drawn.clone() }
    }

    /// Two unit normals of each control point in base.
    #[must_use]
    pub(crate) fn normals(&self) -> Vec<[Vector3<f64>; 2]> {
        let turned = |pair: &[Vector3<f64>; 2]| pair.map(|normal| self.base_from_part.rotation * normal);
        self.drawn.1.iter().map(turned).collect()
    }

    /// The point about which the part turns: the middle of its curve in base, m.
    #[must_use]
    pub(crate) fn middle(&self) -> Vector3<f64> {
        self.base_from_part.rotation * middle_of(&self.drawn.0) + self.base_from_part.translation.vector
    }

    /// The drawn curve at the part's pose, without the distances of the seam from it.
    #[must_use]
    pub(crate) fn as_drawn(&self) -> Spline {
        let off_m = vec![Vector2::zeros(); self.off_m.len()];
        Self { larger: 0.0, off_m, ..self.clone() }.spline()
    }

    /// After a step of two unknowns for each control point and those of the place.
    #[must_use]
    pub(crate) fn moved(&self, step: &[f64]) -> Self {
        let (of_form, of_place) = step.split_at(2 * self.off_m.len());
        let off = self.off_m.iter().zip(of_form.chunks_exact(2));
        let off_m = off.map(|(off, step)| off + Vector2::new(step[0], step[1])).collect();
        let shift = Vector3::from_column_slice(&of_place[..3]);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(&of_place[3..POSE]));
        let (middle, pose) = (self.middle(), self.base_from_part);
        let translation = turn * (pose.translation.vector - middle) + middle + shift;
        Self {
            drawn: Arc::clone(&self.drawn),
            base_from_part: se3::from_parts(turn * pose.rotation, translation),
            larger: (1.0 + self.larger) * (1.0 + of_place[POSE]) - 1.0,
            radius_m: self.radius_m,
            off_m,
        }
    }
}

fn middle_of(drawn: &Spline) -> Vector3<f64> {
    drawn.control.iter().sum::<Vector3<f64>>() / drawn.control.len() as f64
}

/// Adds the prior of a part's place behind the unknowns of the control points.
pub(crate) fn add_loose_place(equations: &mut Arrow, control: usize) {
    add_place(equations, control, LOOSE);
}

/// Damps a step of the place, so that a part does not slide along a straight or round curve. This is no information: as a prior
/// it would determine directions of the hand-eye transform that the scan does not.
pub(crate) fn damp_place(equations: &mut Arrow, control: usize) {
    add_place(equations, control, DAMPED);
}

fn add_place(equations: &mut Arrow, control: usize, sizes: (f64, f64)) {
    for axis in 0..POSE {
        let size = if axis < 3 { sizes.0 } else { sizes.1 };
        equations.add(2 * control + axis, 2 * control + axis, size.powi(-2));
    }
}
