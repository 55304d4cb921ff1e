//! The normal equations of a curve and the unknowns that all readings share, linear in the number of readings.

use crate::curve::arrow::{Arrow, SHARED};
use crate::curve::placed::{PLACE, Placed};
use crate::curve::readings::Readings;
use crate::curve::sight::{Sight, sight};
use crate::curve::spline::{Spline, THIRD};
use nalgebra::{Matrix2, SMatrix, Vector2, Vector3};
use trueline_dataset::Guess;
use trueline_geometry::so3;

/// A state: clock, hand-eye transform, curve, and the place of each reading on it.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// Clock and hand-eye transform.
    pub at: Guess,
    /// The curve.
    pub spline: Spline,
    /// u of each reading, m.
    pub u_m: Vec<f64>,
    /// The known curve that this one follows, and its place; `None` if its form is unknown.
    pub placed: Option<Placed>,
}

impl State {
    /// Two unit normals of each control point, in which it is free.
    #[must_use]
    pub(crate) fn normals(&self) -> Vec<[Vector3<f64>; 2]> {
        self.placed.as_ref().map_or_else(|| self.spline.normals(), Placed::normals)
    }

    /// Length of the curve where readings see it, m: between readings that are far apart it may lead anywhere.
    #[must_use]
    pub(crate) fn seen_length_m(&self) -> f64 {
        /// Two knots of the first stage of the search.
        const UNSEEN_M: f64 = 32e-3;
        let mut u_m = self.u_m.clone();
        u_m.sort_by(f64::total_cmp);
        let chord_m = |pair: &[f64]| (self.spline.point(pair[1]) - self.spline.point(pair[0])).norm();
        u_m.windows(2).filter(|pair| pair[1] - pair[0] < UNSEEN_M).map(chord_m).sum()
    }

    /// Number of unknowns of the place.
    #[must_use]
    pub(crate) fn of_place(&self) -> usize {
        if self.placed.is_some() { PLACE } else { 0 }
    }

    /// Zero equations of all unknowns.
    #[must_use]
    pub(crate) fn arrow(&self) -> Arrow {
        Arrow::new(2 * self.spline.control.len(), self.spline.closed, self.of_place())
    }

    /// Quantities that the prior expects to be small, m: third differences, or distances from a known curve.
    #[must_use]
    pub(crate) fn bends(&self) -> Vec<Vector2<f64>> {
        let of_placed = |placed: &Placed| {
            let mut off = placed.off_m.clone();
            off.push(Vector2::new(placed.radius_m * placed.larger, 0.0));
            off
        };
        self.placed.as_ref().map_or_else(|| bends(&self.spline), of_placed)
    }
}

/// Columns of a reading at most: eight of its control points, the place, and the shared ones.
pub(crate) const COLUMNS: usize = 8 + PLACE + SHARED;

/// Derivatives of a whitened sight by all unknowns: index and column of each, up to the returned number.
pub(crate) fn columns(
    state: &State,
    normals: &[[Vector3<f64>; 2]],
    (seen, whitener): (&Sight, &Matrix2<f64>),
    columns: &mut [(usize, Vector2<f64>); COLUMNS],
) -> usize {
    let by_point = whitener * seen.by_point;
    for m in 0..4 {
        let k = state.spline.index(seen.basis.first + m);
        for side in 0..2 {
            columns[2 * m + side] = (2 * k + side, by_point * normals[k][side] * seen.basis.value[m]);
        }
    }
    let (mut next, mut index) = (8, 2 * state.spline.control.len());
    if let Some(placed) = &state.placed {
        let lever = state.spline.at(&seen.basis).0 - placed.middle();
        let by_turn = by_point * -so3::hat(&lever);
        for axis in 0..3 {
            columns[next + axis] = (index + axis, by_point.column(axis).into_owned());
            columns[next + 3 + axis] = (index + 3 + axis, by_turn.column(axis).into_owned());
        }
        columns[next + PLACE - 1] = (index + PLACE - 1, by_point * lever);
        (next, index) = (next + PLACE, index + PLACE);
    }
    let by_shared = whitener * seen.by_shared;
    for k in 0..SHARED {
        columns[next + k] = (index + k, by_shared.column(k).into_owned());
    }
    next + SHARED
}

/// Directions of the shared unknowns that have a prior or are held.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    /// Their value.
    pub centre: Guess,
    /// Their information: t_d (1/s²), φ (1/rad²), t (1/m²).
    pub information: SMatrix<f64, SHARED, SHARED>,
}

/// Largest usual distance of a sensor from the tool's origin, m.
const MOUNTED_WITHIN_M: f64 = 0.3;

impl Known {
    /// Prior that the sensor is mounted within arm's reach of the tool's origin.
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

/// Adds the rows of all sights with a weight.
pub(crate) fn add_sights(
    equations: &mut Arrow,
    state: &State,
    sights: &[Option<Sight>],
    whiteners: &[Matrix2<f64>],
    weights: &[f64],
) {
    let normals = state.normals();
    let mut found = [(0, Vector2::zeros()); COLUMNS];
    let mut entries = [(0, 0.0); COLUMNS];
    for ((sight, whitener), weight) in sights.iter().zip(whiteners).zip(weights) {
        let Some(seen) = sight.as_ref().filter(|_| *weight > 0.0) else { continue };
        let count = columns(state, &normals, (seen, whitener), &mut found);
        let residual = whitener * seen.residual;
        for row in 0..2 {
            for (entry, (index, column)) in entries.iter_mut().zip(&found[..count]) {
                *entry = (*index, column[row]);
            }
            equations.add_row(&entries[..count], residual[row], *weight);
        }
    }
}

/// Normal components of the third differences of the control points, m: the prior expects them to be small.
#[must_use]
pub(crate) fn bends(spline: &Spline) -> Vec<Vector2<f64>> {
    let normals = spline.normals();
    let bend = |m: usize| {
        let third = third_difference(spline, m);
        let [one, other] = middle_normals(spline, &normals, m);
        Vector2::new(one.dot(&third), other.dot(&third))
    };
    spline.third_differences().into_iter().map(bend).collect()
}

fn third_difference(spline: &Spline, m: usize) -> Vector3<f64> {
    THIRD.iter().enumerate().map(|(i, part)| spline.control[spline.index(m + i)] * *part).sum()
}

/// Those of the second of four control points.
fn middle_normals(spline: &Spline, normals: &[[Vector3<f64>; 2]], m: usize) -> [Vector3<f64>; 2] {
    normals[spline.index(m + 1)]
}

/// Adds the prior of a curve with third differences of 1 m; times 1/s3² it is that of s3. For a known curve it is that of a
/// distance of 1 m.
pub(crate) fn add_prior(equations: &mut Arrow, state: &State) {
    let spline = &state.spline;
    if let Some(placed) = &state.placed {
        for (k, off) in placed.off_m.iter().enumerate() {
            equations.add_row(&[(2 * k, 1.0)], -off.x, 1.0);
            equations.add_row(&[(2 * k + 1, 1.0)], -off.y, 1.0);
        }
        let size = 2 * placed.off_m.len() + PLACE - 1;
        equations.add_row(&[(size, placed.radius_m)], -placed.radius_m * placed.larger, 1.0);
        return;
    }
    let normals = spline.normals();
    let mut entries = [(0, 0.0); 8];
    for (m, bend) in spline.third_differences().into_iter().zip(&bends(spline)) {
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

/// Adds the prior.
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

/// The state after a step of all unknowns; u stays until the curve is sighted again.
#[must_use]
pub(crate) fn stepped(state: &State, step: &nalgebra::DVector<f64>) -> State {
    let shared = step.len() - SHARED;
    let own: SMatrix<f64, SHARED, 1> = step.fixed_rows::<SHARED>(shared).into();
    let at = crate::curve::sight::moved(&state.at, &own);
    if let Some(placed) = &state.placed {
        let placed = placed.moved(&step.as_slice()[..shared]);
        return State { at, spline: placed.spline(), u_m: state.u_m.clone(), placed: Some(placed) };
    }
    let mut spline = state.spline.clone();
    for (k, [one, other]) in state.spline.normals().iter().enumerate() {
        spline.control[k] += one * step[2 * k] + other * step[2 * k + 1];
    }
    State { at, spline, u_m: state.u_m.clone(), placed: None }
}
