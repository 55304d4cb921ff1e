//! The normal equations of a curve and the unknowns that all readings share, linear in the number of readings.

use crate::curve::arrow::{Arrow, SHARED};
use crate::curve::readings::Readings;
use crate::curve::sight::{Sight, sight};
use crate::curve::spline::{Spline, THIRD};
use nalgebra::{Matrix2, SMatrix, Vector2, Vector3};
use trueline_dataset::Guess;

/// A state: clock, hand-eye transform, curve, and where on it each reading was.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// Clock and hand-eye transform.
    pub at: Guess,
    /// The curve.
    pub spline: Spline,
    /// u of each reading, m.
    pub u_m: Vec<f64>,
}

/// Directions of the shared unknowns that are known beforehand, or held.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    /// Where.
    pub centre: Guess,
    /// How well: information about t_d (1/s²), φ (1/rad²), t (1/m²).
    pub information: SMatrix<f64, SHARED, SHARED>,
}

/// No sensor is mounted further from the tool's origin than about this, m.
const MOUNTED_WITHIN_M: f64 = 0.3;

impl Known {
    /// That a sensor is mounted within arm's reach of the tool's origin.
    #[must_use]
    pub(crate) fn of_any_sensor(at: &Guess) -> Self {
        let mut information = SMatrix::zeros();
        for k in 4..SHARED {
            information[(k, k)] = MOUNTED_WITHIN_M.powi(-2);
        }
        let mut centre = *at;
        centre.tool_from_camera.translation.vector = Vector3::zeros();
        Self { centre, information }
    }
}

/// The sights of all readings at a state.
#[must_use]
pub(crate) fn sights(readings: &Readings, state: &State) -> Vec<Option<Sight>> {
    let of = |(reading, u_m): (_, &f64)| sight(readings, reading, &state.at, &state.spline, *u_m);
    readings.list.iter().zip(&state.u_m).map(of).collect()
}

/// The whitener of each reading at a state: noise of feature, robot and stamp.
#[must_use]
pub(crate) fn whiteners(readings: &Readings, sights: &[Option<Sight>]) -> Vec<Matrix2<f64>> {
    let of = |(reading, sight): (&crate::curve::readings::Reading, &Option<Sight>)| {
        let across = |seen: &Sight| (seen.by_point, seen.by_shared.column(0).into_owned());
        let (by_point, by_time) = sight.as_ref().map_or_else(|| (SMatrix::zeros(), Vector2::zeros()), across);
        let covariance = readings.noise.covariance(reading.covariance, &by_point, &by_time);
        crate::input::noise_levels::Whitener::of(&covariance)
            .unwrap_or_else(|| readings.noise.coarse_whitener(reading.covariance))
            .matrix()
    };
    readings.list.iter().zip(sights).map(of).collect()
}

/// Adds the rows of all sights that carry weight.
pub(crate) fn add_sights(
    equations: &mut Arrow,
    spline: &Spline,
    sights: &[Option<Sight>],
    whiteners: &[Matrix2<f64>],
    weights: &[f64],
) {
    let (normals, shared) = (spline.normals(), equations.shared());
    let mut entries = [(0, 0.0); 8 + SHARED];
    for ((sight, whitener), weight) in sights.iter().zip(whiteners).zip(weights) {
        let Some(seen) = sight.as_ref().filter(|_| *weight > 0.0) else { continue };
        let (by_shared, by_point) = (whitener * seen.by_shared, whitener * seen.by_point);
        let residual = whitener * seen.residual;
        for row in 0..2 {
            for m in 0..4 {
                let k = spline.index(seen.basis.first + m);
                for side in 0..2 {
                    let along = (by_point.row(row) * normals[k][side])[0];
                    entries[2 * m + side] = (2 * k + side, along * seen.basis.value[m]);
                }
            }
            for k in 0..SHARED {
                entries[8 + k] = (shared + k, by_shared[(row, k)]);
            }
            equations.add_row(&entries, residual[row], *weight);
        }
    }
}

/// The normal parts of the third differences of the control points, m: what the prior expects to be small.
#[must_use]
pub(crate) fn bends(spline: &Spline) -> Vec<Vector2<f64>> {
    let normals = spline.normals();
    let bend = |m: usize| {
        let third = third_difference(spline, m);
        let [one, other] = middle_normals(spline, &normals, m);
        Vector2::new(one.dot(&third), other.dot(&third))
    };
    (0..spline.third_differences()).map(bend).collect()
}

fn third_difference(spline: &Spline, m: usize) -> Vector3<f64> {
    THIRD.iter().enumerate().map(|(i, part)| spline.control[spline.index(m + i)] * *part).sum()
}

/// Those of the second of four control points.
fn middle_normals(spline: &Spline, normals: &[[Vector3<f64>; 2]], m: usize) -> [Vector3<f64>; 2] {
    normals[spline.index(m + 1)]
}

/// Adds the prior of a curve whose third differences are of 1 m: multiplied by 1/s3² it is that of s3.
pub(crate) fn add_prior(equations: &mut Arrow, spline: &Spline) {
    let normals = spline.normals();
    let mut entries = [(0, 0.0); 8];
    for (m, bend) in bends(spline).iter().enumerate() {
        for (row, normal) in middle_normals(spline, &normals, m).iter().enumerate() {
            for (i, part) in THIRD.iter().enumerate() {
                let k = spline.index(m + i);
                for side in 0..2 {
                    entries[2 * i + side] = (2 * k + side, part * normal.dot(&normals[k][side]));
                }
            }
            equations.add_row(&entries, -bend[row], 1.0);
        }
    }
}

/// Adds what is known beforehand.
pub(crate) fn add_known(equations: &mut Arrow, at: &Guess, known: &Known) {
    let (shared, step) = (equations.shared(), crate::curve::sight::step_between(at, &known.centre));
    let pull = known.information * step;
    for i in 0..SHARED {
        equations.gradient[shared + i] += pull[i];
        for j in 0..=i {
            equations.add(shared + i, shared + j, known.information[(i, j)]);
        }
    }
}

/// The state after a step of all unknowns; u stays where it was until the curve is looked at again.
#[must_use]
pub(crate) fn stepped(state: &State, step: &nalgebra::DVector<f64>) -> State {
    let shared = step.len() - SHARED;
    let mut spline = state.spline.clone();
    for (k, [one, other]) in state.spline.normals().iter().enumerate() {
        spline.control[k] += one * step[2 * k] + other * step[2 * k + 1];
    }
    let own: SMatrix<f64, SHARED, 1> = step.fixed_rows::<SHARED>(shared).into();
    State { at: crate::curve::sight::moved(&state.at, &own), spline, u_m: state.u_m.clone() }
}
