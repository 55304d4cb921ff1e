//! A part that moves between passes: six unknowns for each pass after the first, with a prior.
//!
//! A fixture clamps a part again within its scatter. Each pass then sees the curve at its own place. The six unknowns of a pass are
//! the shift and the turn about the middle of the curve, relative to the first pass.

use crate::assess::share::ShareOf;
use crate::config::PartMoves;
use crate::curve::considered::Considered;
use crate::curve::equations::State;
use crate::curve::fit::Fitted;
use crate::curve::moved::Moves;
use crate::curve::passes::Passes;
use crate::curve::readings::Readings;
use crate::curve::rows::Moved;
use crate::curve::sight::Sight;
use nalgebra::Vector3;

/// Unknowns of a pass.
const PLACE: usize = 6;
/// Readings that a pass needs for each of them, on average: else its moves are those of a sensor that sways.
const READINGS_PER_UNKNOWN: usize = 5;

impl PartMoves {
    /// Displacement of the readings by one standard deviation of each unknown; `None` for a single pass, and for passes of too few readings.
    #[must_use]
    pub(crate) fn at(&self, fitted: &Fitted) -> Option<Considered> {
        let spline = &fitted.state.spline;
        let passes = self::passes(fitted).of;
        let most = passes.len() / (READINGS_PER_UNKNOWN * PLACE);
        let last = passes.iter().copied().max().filter(|last| (1..=most).contains(last))?;
        let middle = spline.control.iter().sum::<Vector3<f64>>() / spline.control.len() as f64;
        let by_reading = |(k, seen): (usize, &Option<Sight>)| {
            let (seen, pass) = (seen.as_ref()?, passes[k].checked_sub(1)?);
            let mut by = Moved::zeros(PLACE * last);
            by.columns_mut(PLACE * pass, 3).copy_from(&(seen.by_shift * self.shift_m));
            let turn = seen.turn_about(&middle) * self.turn_rad;
            by.columns_mut(PLACE * pass + 3, 3).copy_from(&turn);
            Some((k, by))
        };
        let readings = fitted.sights.iter().enumerate().filter_map(by_reading).collect();
        let moves = Moves { errors: PLACE * last, readings, every: 1 };
        Some(Considered { of: ShareOf::SeamForm, moves, shape: None, is_estimated: true })
    }
    /// Readings near the end of a pass, which may be off by a move.
    pub(crate) fn doubt(&self, readings: &mut Readings, fitted: &Fitted) {
        let doubtful = passes(fitted).is_near_end;
        for (reading, _) in readings.list.iter_mut().zip(doubtful).filter(|(_, is_near)| *is_near) {
            reading.covariance[0] += self.shift_m.powi(2);
            reading.covariance[2] += self.shift_m.powi(2);
            for support in reading.supports_mut() {
                support.variance += self.shift_m.powi(2);
            }
        }
    }
}

/// Number of passes over the curve.
#[must_use]
pub(crate) fn pass_count(fitted: &Fitted) -> usize {
    passes(fitted).of.into_iter().max().map_or(0, |last| last + 1)
}

fn passes(fitted: &Fitted) -> Passes {
    let State { spline, u_m, .. } = &fitted.state;
    Passes::of(u_m, spline.span_m(), spline.closed)
}
