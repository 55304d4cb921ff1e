//! The normal equations of a curve and the unknowns that all readings share, linear in the number of readings.

use crate::curve::arrow::{Arrow, CUBIC, SHARED};
use crate::curve::placed::{PLACE, Placed};
use crate::curve::plate_sight::plate_sight;
use crate::curve::plates::Plates;
use crate::curve::readings::{Light, Reading, Readings};
use crate::curve::rows::{ROWS, Rows, Whitener, whitener};
use crate::curve::sight::{ByForm, Sight, sight};
use crate::curve::spline::{Spline, THIRD};
use crate::input::noise_levels;
use nalgebra::{SMatrix, Vector2, Vector3};
use trueline_dataset::Guess;

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
    /// The plates beside the curve; `None` if readings are seam points only.
    pub plates: Option<Plates>,
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

    /// Number of unknowns of the curve's form.
    #[must_use]
    pub(crate) fn of_form(&self) -> usize {
        2 * self.spline.control.len()
    }

    /// Number of unknowns of the place.
    #[must_use]
    pub(crate) fn of_place(&self) -> usize {
        if self.placed.is_some() { PLACE } else { 0 }
    }

    /// Number of unknowns of the plates.
    fn of_plates(&self) -> usize {
        self.plates.as_ref().map_or(0, Plates::unknowns)
    }

    /// Number of all unknowns: form, place, plates, and the shared ones.
    #[must_use]
    pub(crate) fn size(&self) -> usize {
        self.of_form() + self.of_place() + self.of_plates() + SHARED
    }

    /// Zero equations of all unknowns.
    #[must_use]
    pub(crate) fn arrow(&self) -> Arrow {
        let reach = self.plates.as_ref().map_or(CUBIC, |plates| plates.reach);
        Arrow::new((self.of_form(), self.spline.closed), reach, self.of_place() + self.of_plates())
    }

    /// Adds the prior of the plates.
    pub(crate) fn add_plates(&self, equations: &mut Arrow) {
        if let Some(plates) = &self.plates {
            plates.add_prior(equations, self.of_form() + self.of_place());
        }
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

/// Columns of a reading at most: of its control points and angles, the place, and the shared ones.
pub(crate) const COLUMNS: usize = ROWS * (2 * CUBIC + CUBIC) + PLACE + SHARED;

/// Derivatives of a whitened reading by the unknowns that it depends on.
pub(crate) struct Columns {
    list: [(usize, Rows); COLUMNS],
    count: usize,
}

impl Columns {
    /// None.
    #[must_use]
    pub(crate) fn new() -> Self {
        Self { list: [(0, Rows::zeros()); COLUMNS], count: 0 }
    }

    /// Index of each unknown, with its column.
    #[must_use]
    #[inline]
    pub(crate) fn found(&self) -> &[(usize, Rows)] {
        &self.list[..self.count]
    }

    #[inline]
    fn push(&mut self, index: usize, column: Rows) {
        self.list[self.count] = (index, column);
        self.count += 1;
    }

    /// Adds to the column of an unknown, which other rows may have.
    fn merge(&mut self, index: usize, column: &Rows) {
        let known = self.list[..self.count].iter_mut().find(|(known, _)| *known == index);
        match known {
            Some((_, sum)) => *sum += column,
            None => self.push(index, *column),
        }
    }

    /// Of a sight.
    pub(crate) fn fill(
        &mut self,
        state: &State,
        normals: &[[Vector3<f64>; 2]],
        (seen, whitener): (&Sight, &Whitener),
    ) {
        self.count = 0;
        let by_shift = whitener * seen.by_shift;
        match &seen.by_form {
            ByForm::Point(basis) => {
                for m in 0..CUBIC {
                    let k = state.spline.index(basis.first + m);
                    for (side, normal) in normals[k].iter().enumerate() {
                        self.push(2 * k + side, by_shift * normal * basis.value[m]);
                    }
                }
            }
            ByForm::Feet(_) => self.fill_feet(state, normals, (seen, whitener)),
        }
        let mut index = state.of_form();
        if let Some(placed) = &state.placed {
            let middle = placed.middle();
            let by_turn = whitener * seen.turn_about(&middle);
            let lever = state.spline.point(seen.u_m) - middle;
            for axis in 0..3 {
                self.push(index + axis, by_shift.column(axis).into_owned());
                self.push(index + 3 + axis, by_turn.column(axis).into_owned());
            }
            self.push(index + PLACE - 1, by_shift * lever);
            index += PLACE;
        }
        index += state.of_plates();
        let by_shared = whitener * seen.by_shared;
        for k in 0..SHARED {
            self.push(index + k, by_shared.column(k).into_owned());
        }
    }

    fn fill_feet(
        &mut self,
        state: &State,
        normals: &[[Vector3<f64>; 2]],
        (seen, whitener): (&Sight, &Whitener),
    ) {
        let (ByForm::Feet(feet), Some(plates)) = (&seen.by_form, &state.plates) else { return };
        let first_angle = state.of_form() + state.of_place();
        for (row, foot) in feet.iter().enumerate() {
            let (whitened, by_shift) = (whitener.column(row), seen.by_shift.row(row).transpose());
            for m in 0..CUBIC {
                let k = state.spline.index(foot.basis.first + m);
                let by_control = by_shift * foot.basis.value[m] + foot.by_slope * foot.basis.slope[m];
                for (side, normal) in normals[k].iter().enumerate() {
                    self.merge(2 * k + side, &(whitened * by_control.dot(normal)));
                }
                let angle = first_angle + plates.unknown(&foot.angles, m, foot.plate);
                self.merge(angle, &(whitened * (foot.by_angle * foot.angles.value[m])));
            }
        }
    }
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
    let of = |(reading, u_m): (&Reading, &f64)| match (&reading.light, &state.plates) {
        (Light::Unused, _) => None,
        (Light::Supports(supports), Some(plates)) => {
            plate_sight((readings, reading, supports), &state.at, (plates, &state.spline), *u_m)
        }
        _ => sight(readings, reading, &state.at, &state.spline, *u_m),
    };
    readings.list.iter().zip(&state.u_m).map(of).collect()
}

/// The whitener of each reading at a state: noise of feature, robot and stamp.
#[must_use]
pub(crate) fn whiteners(readings: &Readings, sights: &[Option<Sight>]) -> Vec<Whitener> {
    let of = |(reading, sight): (&Reading, &Option<Sight>)| match (reading.supports(), sight) {
        (Some(supports), Some(seen)) if seen.rows == ROWS => {
            let own = Whitener::from_diagonal(&Rows::from_fn(|k, _| supports[k].variance));
            let by_time = seen.by_shared.column(0);
            let robot = seen.by_shift * seen.by_shift.transpose() * readings.noise.robot_sigma_m.powi(2);
            let stamp = by_time * by_time.transpose() * readings.noise.stamp_sigma_s.powi(2);
            whitener(&(own + robot + stamp), ROWS).unwrap_or_else(Whitener::zeros)
        }
        _ => of_point(readings, reading, sight.as_ref()),
    };
    readings.list.iter().zip(sights).map(of).collect()
}

fn of_point(readings: &Readings, reading: &Reading, sight: Option<&Sight>) -> Whitener {
    let across = |seen: &Sight| {
        let by_time = seen.by_shared.fixed_view::<2, 1>(0, 0).into_owned();
        (seen.by_shift.fixed_rows::<2>(0).into_owned(), by_time)
    };
    let (by_point, by_time) = sight.map_or_else(|| (SMatrix::zeros(), Vector2::zeros()), across);
    let covariance = readings.noise.covariance(reading.covariance, &by_point, &by_time);
    let own = noise_levels::Whitener::of(&covariance)
        .unwrap_or_else(|| readings.noise.coarse_whitener(reading.covariance))
        .matrix();
    let mut whitener = Whitener::zeros();
    whitener.fixed_view_mut::<2, 2>(0, 0).copy_from(&own);
    whitener
}

/// Adds the rows of all sights with a weight.
pub(crate) fn add_sights(
    equations: &mut Arrow,
    state: &State,
    sights: &[Option<Sight>],
    whiteners: &[Whitener],
    weights: &[f64],
) {
    let normals = state.normals();
    let mut columns = Columns::new();
    let mut entries = [(0, 0.0); COLUMNS];
    for ((sight, whitener), weight) in sights.iter().zip(whiteners).zip(weights) {
        let Some(seen) = sight.as_ref().filter(|_| *weight > 0.0) else { continue };
        columns.fill(state, &normals, (seen, whitener));
        let residual = whitener * seen.residual;
        let found = columns.found();
        for row in 0..seen.rows {
            for (entry, (index, column)) in entries.iter_mut().zip(found) {
                *entry = (*index, column[row]);
            }
            equations.add_row(&entries[..found.len()], residual[row], *weight);
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
    let of_angles = &step.as_slice()[state.of_form() + state.of_place()..shared];
    let plates = state.plates.as_ref().map(|plates| plates.moved(of_angles));
    let u_m = state.u_m.clone();
    if let Some(placed) = &state.placed {
        let placed = placed.moved(&step.as_slice()[..state.of_form() + state.of_place()]);
        return State { at, spline: placed.spline(), u_m, placed: Some(placed), plates };
    }
    let mut spline = state.spline.clone();
    for (k, [one, other]) in state.spline.normals().iter().enumerate() {
        spline.control[k] += one * step[2 * k] + other * step[2 * k + 1];
    }
    State { at, spline, u_m, placed: None, plates }
}
