//! The answer with the plates beside the curve: the stripes of a frame instead of its seam point.
//!
//! The fit begins at the answer of the seam points. A stripe has no clear foot on the seam at the inside of a corner, and at the ends.

use crate::assess::outliers::Outliers;
use crate::curve::answer::{Answered, Asked};
use crate::curve::drift::DriftFree;
use crate::curve::equations::{State, sights};
use crate::curve::plate_sight::reach;
use crate::curve::plates::{Direction, Plates};
use crate::curve::readings::{Light, Readings};
use crate::curve::sight::{HandEye, Sight, moving};
use crate::curve::solve::{Search, settled};
use nalgebra::Vector3;

/// Support points farther from the first plates than this are outliers: the plates are those of many frames.
const NEAR_M: f64 = 2e-3;
/// A frame reaches over this many control points at most: the equations are to stay banded.
const MOST_REACH: usize = 16;
/// Control points that a frame may reach farther during the fit.
const SPARE: usize = 1;

/// The answer with the stripes.
pub(crate) struct WithPlates {
    /// The answer, without a drift of its own.
    pub free: DriftFree,
    /// Its readings: support points, and seam points where there are none.
    readings: Readings,
    /// Number of the frames with stripes, with those that have no clear foot.
    frames: usize,
}

impl WithPlates {
    /// Its readings, corrected by the sensor's shape that it found.
    #[must_use]
    pub(crate) fn corrected(&self) -> Readings {
        let shape = self.free.answer.shape;
        shape.map_or_else(|| self.readings.clone(), |shape| self.readings.corrected(&shape))
    }

    /// Whether the stripes of a reading lie on the plates.
    #[must_use]
    pub(crate) fn explains(&self, k: usize) -> bool {
        self.readings.list[k].supports().is_some() && self.free.answer.finished.fitted.weights[k] > 0.0
    }

    /// Outliers among the frames with stripes. A stripe without a clear foot lies on no plate.
    #[must_use]
    pub(crate) fn outliers(&self) -> Outliers {
        let kept = (0..self.readings.list.len()).filter(|k| self.explains(*k)).count();
        Outliers { count: self.frames - kept, of: self.frames }
    }
}

impl Asked<'_> {
    /// The answer with the light of each reading; `None` if the support points lie on no plates beside the curve. A reading whose stripes have no clear
    /// foot has the light of the others. `rate_sigma_ppm` is the uncertainty of the clock rates of the stamps.
    #[must_use]
    pub(crate) fn with_plates(
        &self,
        seam: &Answered,
        (lights, others): (&[Light], Light),
        rate_sigma_ppm: f64,
    ) -> Option<WithPlates> {
        let mut readings = self.search.readings.clone();
        for (reading, light) in readings.list.iter_mut().zip(lights) {
            reading.light = *light;
        }
        let frames = readings.list.iter().filter(|reading| reading.supports().is_some()).count();
        let state = first(&mut readings, seam, others)?;
        let finished = settled(&readings, state, None, seam.finished.first_length_m)?;
        let asked = Asked { search: Search { readings: &readings, ..self.search }, ..*self };
        let answer = asked.concluded(finished, seam.rivals.clone(), &seam.course, (false, None));
        let free = asked.without_drift(answer, rate_sigma_ppm);
        Some(WithPlates { free, readings, frames })
    }
}

/// The seam points' answer with the plates that the stripes show. Readings whose stripes have no clear foot have the light of the others.
fn first(readings: &mut Readings, seam: &Answered, others: Light) -> Option<State> {
    let mut state = State { plates: None, ..seam.finished.fitted.state.clone() };
    let weights = &seam.finished.fitted.weights;
    let inliers = (0..readings.list.len()).filter(|k| weights[*k] > 0.0);
    let directions: Vec<Direction> = inliers.filter_map(|k| direction(readings, &state, k)).collect();
    let control = state.spline.control.len();
    state.plates = Some(Plates::through(&state.spline, &directions, control)?);
    let seen = sights(readings, &state);
    let is_near = |seen: &&Sight| seen.of_point().is_none() && seen.residual.amax() < NEAR_M;
    let near = seen.iter().flatten().filter(is_near);
    let most = (if state.spline.closed { control / 2 } else { control }).min(MOST_REACH);
    let farthest = near.filter_map(|seen| reach(seen, &state.spline)).filter(|reach| *reach <= most).max()?;
    if let Some(plates) = &mut state.plates {
        plates.reach = (farthest + SPARE).min(most);
    }
    for (reading, seen) in readings.list.iter_mut().zip(&seen) {
        let reaches = seen.as_ref().and_then(|seen| reach(seen, &state.spline));
        if reading.supports().is_some() && reaches.is_none_or(|reach| reach > farthest) {
            reading.light = others;
        }
    }
    let seen = sights(readings, &state);
    for (u_m, seen) in state.u_m.iter_mut().zip(&seen) {
        *u_m = seen.as_ref().map_or(*u_m, |seen| seen.u_m);
    }
    Some(state)
}

/// Directions of the plates at a reading, in base; `None` without stripes on both.
fn direction(readings: &Readings, state: &State, k: usize) -> Option<Direction> {
    let reading = &readings.list[k];
    let (supports, moving) = (reading.supports()?, moving(readings, reading, &state.at)?);
    let hand_eye = HandEye::of(&state.at);
    let points = supports.map(|support| moving.position + moving.attitude * hand_eye.in_tool(&support.point));
    let seam = state.spline.point(state.u_m[k]);
    let along = [0, 2].map(|first| {
        let middle: Vector3<f64> = (points[first] + points[first + 1]) * 0.5;
        let chord = points[first + 1] - points[first];
        chord * chord.dot(&(middle - seam)).signum()
    });
    Some(Direction { u_m: state.u_m[k], along })
}
