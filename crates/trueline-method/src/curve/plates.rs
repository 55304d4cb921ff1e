//! The plates beside a seam: two surfaces that are straight across it, at angles that vary along it.
//!
//! c(u) is the seam and x = X − c(u) a point beside it, with c′·x = 0. A plate is where φ = n·x vanishes:
//!
//! ```text
//! d = cos ψ e₁ + sin ψ e₂,  n = −sin ψ e₁ + cos ψ e₂,  e₁ ∥ E − t (t·E),  e₂ = t × e₁,  t = c′/|c′|
//! ```
//!
//! E(u) is a field of vectors that is fixed before the fit. ψ(u) is a cubic B-spline for each plate. A bow across that is the same all along the
//! seam moves the seam and turns the plate evenly, so it needs no unknown.

use crate::curve::arrow::{Arrow, CUBIC};
use crate::curve::spline::{Basis, Spline, THIRD};
use nalgebra::{Rotation3, UnitVector3, Vector3};
use std::f64::consts::PI;
use std::sync::Arc;

/// Distance of the knots of the angles, m.
const KNOTS_M: f64 = 10e-3;
/// Third differences of the angles at knots of [`KNOTS_M`], rad: a plate may turn by this much over a few knots. They are proportional to a power of
/// the spacing, as those of the curve.
const BENDS_RAD: (f64, f64) = (0.1, 2.5);
/// Noise of the angle of a stripe, rad, in the first fit …
const NOISE_RAD: f64 = 0.01;
/// … and its rounds of weights.
const ROUNDS: usize = 10;
/// Maximum number of control points of the angles.
const MOST_CONTROL: usize = 80;

/// The plates.
#[derive(Clone, Debug)]
pub(crate) struct Plates {
    /// E at each control point of the seam.
    reference: Arc<Vec<Vector3<f64>>>,
    /// ψ of both plates, as the first two coordinates, rad.
    angles: Spline,
    /// Neighbouring control points of the seam on which a reading depends, at most.
    pub reach: usize,
}

/// A stripe that shows the direction of its plate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Direction {
    /// Its place on the seam, m.
    pub u_m: f64,
    /// From the seam along each plate, in base.
    pub along: [Vector3<f64>; 2],
}

/// A plate at a place of the seam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Across {
    /// d, unit, away from the seam.
    pub outward: Vector3<f64>,
    /// n, unit.
    pub normal: Vector3<f64>,
    /// (dn/du)·d with its sign changed: the plate's turn about the seam, rad/m.
    pub twist: f64,
    /// Turn of e₁ about t by a change of c′: −(this · δc′), rad.
    pub by_slope: Vector3<f64>,
    /// Weights of the angles.
    pub angles: Basis,
}

impl Plates {
    /// From the directions of stripes; `None` if they are too few for the seam.
    #[must_use]
    pub(crate) fn through(seam: &Spline, directions: &[Direction], reach: usize) -> Option<Self> {
        let count = Spline::segments(seam.span_m(), KNOTS_M, seam.closed).min(MOST_CONTROL);
        let control = if seam.closed { count } else { count + CUBIC - 1 };
        let (spacing_m, closed) = (seam.span_m() / count as f64, seam.closed);
        let angles =
            Spline { control: vec![Vector3::zeros(); control], spacing_m, closed, breaks: Vec::new() };
        let mut plates = Self { reference: Arc::new(reference(seam)), angles, reach };
        let measured: Vec<(f64, [f64; 2])> = directions
            .iter()
            .map(|direction| {
                let of_plate = |plate: usize| plates.angle(seam, direction.u_m, &direction.along[plate]);
                (direction.u_m, [of_plate(0), of_plate(1)])
            })
            .collect();
        let middle = [0, 1].map(|plate| mean_angle(measured.iter().map(|(_, angles)| angles[plate])));
        let about = |plate: usize, angle: f64| middle[plate] + wrapped(angle - middle[plate]);
        let mut samples: Vec<(f64, Vector3<f64>, f64)> = measured
            .iter()
            .map(|(u_m, angles)| (*u_m, Vector3::new(about(0, angles[0]), about(1, angles[1]), 0.0), 1.0))
            .collect();
        for _ in 0..ROUNDS {
            let most = control;
            plates.angles = Spline::through(&samples, seam.span_m(), spacing_m, closed, most)?;
            for (u_m, angles, weight) in &mut samples {
                // The least sum of distances, which a minority of wrong stripes does not move.
                *weight = 1.0 / ((plates.angles.point(*u_m) - *angles).amax() + NOISE_RAD);
            }
        }
        Some(plates)
    }

    /// Number of unknowns.
    #[must_use]
    pub(crate) fn unknowns(&self) -> usize {
        2 * self.angles.control.len()
    }

    /// Index of an angle among the unknowns, by the number of its weight.
    #[must_use]
    #[inline]
    pub(crate) fn unknown(&self, angles: &Basis, m: usize, plate: usize) -> usize {
        2 * self.angles.index(angles.first + m) + plate
    }

    /// The same with all angles changed by a step, rad.
    #[must_use]
    pub(crate) fn moved(&self, step: &[f64]) -> Self {
        let mut moved = self.clone();
        for (control, step) in moved.angles.control.iter_mut().zip(step.chunks_exact(2)) {
            *control += Vector3::new(step[0], step[1], 0.0);
        }
        moved
    }

    /// A plate at a place u (m) of the seam, with its weights there, dc/du and d²c/du².
    #[must_use]
    pub(crate) fn across(
        &self,
        (seam, basis): (&Spline, &Basis),
        u_m: f64,
        (slope, second): (&Vector3<f64>, &Vector3<f64>),
        plate: usize,
    ) -> Across {
        let (field, field_slope) = self.field(seam, basis);
        let speed = slope.norm();
        let tangent = slope / speed;
        let turning = (second - tangent * tangent.dot(second)) / speed;
        let along = field.dot(&tangent);
        let square = field - tangent * along;
        let length = square.norm();
        let one = square / length;
        let other = tangent.cross(&one);
        let angles = self.angles.basis(u_m);
        let (angle, angle_slope) = self.angles.at(&angles);
        let (sin, cos) = angle[plate].sin_cos();
        let frame_turn = (field_slope.dot(&other) - along * turning.dot(&other)) / length;
        Across {
            outward: one * cos + other * sin,
            normal: other * cos - one * sin,
            twist: angle_slope[plate] + frame_turn,
            by_slope: other * (along / (length * speed)),
            angles,
        }
    }

    /// E and dE/du.
    fn field(&self, seam: &Spline, basis: &Basis) -> (Vector3<f64>, Vector3<f64>) {
        let (mut field, mut slope) = (Vector3::zeros(), Vector3::zeros());
        for m in 0..CUBIC {
            let own = self.reference[seam.index(basis.first + m)];
            field += own * basis.value[m];
            slope += own * basis.slope[m];
        }
        (field, slope)
    }

    /// Angle of a direction about the seam at a place, from e₁, rad.
    fn angle(&self, seam: &Spline, u_m: f64, direction: &Vector3<f64>) -> f64 {
        let basis = seam.basis(u_m);
        let tangent = seam.at(&basis).1.normalize();
        let field = self.field(seam, &basis).0;
        let one = (field - tangent * field.dot(&tangent)).normalize();
        tangent.cross(&one).dot(direction).atan2(one.dot(direction))
    }

    /// Number of third differences of both angles.
    #[must_use]
    pub(crate) fn priors(&self) -> usize {
        2 * self.angles.third_differences().len()
    }

    /// Squares of the third differences, in standard deviations of their prior.
    #[must_use]
    pub(crate) fn squares(&self) -> f64 {
        let own = |m: usize| (self.third(m) / self.bends_rad()).norm_squared();
        self.angles.third_differences().into_iter().map(own).sum()
    }

    /// Adds the prior of the third differences, for angles whose first unknown is `first`.
    pub(crate) fn add_prior(&self, equations: &mut Arrow, first: usize) {
        for m in self.angles.third_differences() {
            let bend = self.third(m);
            for plate in 0..2 {
                let entry = |i: usize| (first + 2 * self.angles.index(m + i) + plate, THIRD[i]);
                let entries: [(usize, f64); CUBIC] = std::array::from_fn(entry);
                equations.add_row(&entries, -bend[plate], self.bends_rad().powi(-2));
            }
        }
    }

    /// Standard deviation of a third difference, rad.
    fn bends_rad(&self) -> f64 {
        BENDS_RAD.0 * (self.angles.spacing_m / KNOTS_M).powf(BENDS_RAD.1)
    }

    fn third(&self, m: usize) -> Vector3<f64> {
        (0..CUBIC).map(|i| self.angles.control[self.angles.index(m + i)] * THIRD[i]).sum()
    }
}

/// A normal of each control point, which turns as little as it can along the seam. On a closed seam it comes back to itself: what is missing is spread
/// evenly.
fn reference(seam: &Spline) -> Vec<Vector3<f64>> {
    let normals = seam.normals();
    let first: Vec<Vector3<f64>> = normals.iter().map(|[one, _]| *one).collect();
    if !seam.closed {
        return first;
    }
    let count = normals.len();
    let tangent = |k: usize| {
        let chord = seam.control[(k + 1) % count] - seam.control[(k + count - 1) % count];
        UnitVector3::new_normalize(chord)
    };
    let [one, other] = normals[0];
    // The last normal, carried on to the first control point.
    let carried = crate::curve::spline::square_to(&tangent(0), Some(&normals[count - 1]))[0];
    let missing = -other.dot(&carried).atan2(one.dot(&carried));
    let turned = |(k, normal): (usize, &Vector3<f64>)| {
        Rotation3::from_axis_angle(&tangent(k), missing * k as f64 / count as f64) * normal
    };
    first.iter().enumerate().map(turned).collect()
}

/// An angle within ±π.
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(2.0 * PI) - PI
}

fn mean_angle(angles: impl Iterator<Item = f64>) -> f64 {
    let (sin, cos) = angles.fold((0.0, 0.0), |(sin, cos), angle| (sin + angle.sin(), cos + angle.cos()));
    sin.atan2(cos)
}
