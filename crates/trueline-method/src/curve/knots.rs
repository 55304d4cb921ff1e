//! The same curve with other knots; curves of several seams are one spline in pieces.

use crate::curve::equations::State;
use crate::curve::spline::Spline;
use nalgebra::Vector3;

/// Maximum number of control points: a bad candidate needs ninety thousand.
pub(crate) const MOST_CONTROL: usize = 120;
/// An open curve extends beyond its readings by this fraction of a knot.
pub(crate) const BEYOND: f64 = 0.25;

/// A piece alone, with its readings.
pub(crate) struct Piece {
    /// Its curve.
    pub spline: Spline,
    /// Places of its readings on the curve, m.
    pub u_m: Vec<f64>,
    /// Indices of its readings.
    pub readings: Vec<usize>,
}

/// Knot spacing of a curve with at most [`MOST_CONTROL`] control points, m.
#[must_use]
pub(crate) fn spacing_for(spline: &Spline, wanted_m: f64) -> f64 {
    wanted_m.max(spline.length_m() / (MOST_CONTROL - 4 * (1 + spline.breaks.len())) as f64)
}

/// The same state with other knots; an open curve is cut at its last readings, those with a weight if requested.
#[must_use]
pub(crate) fn reknotted(state: &State, spacing_m: f64, counts: Option<&[f64]>) -> Option<State> {
    let counted: Vec<bool> =
        (0..state.u_m.len()).map(|k| counts.is_none_or(|weights| weights[k] > 0.0)).collect();
    let (spline, u_m) = if state.spline.breaks.is_empty() {
        laid_again((&state.spline, &state.u_m), &|k| counted[k], (spacing_m, false))?
    } else {
        joined(&pieces(state), spacing_m, &counted)?
    };
    Some(State { at: state.at, spline, u_m, placed: None, plates: None })
}

/// The pieces of a curve, each alone.
fn pieces(state: &State) -> Vec<Piece> {
    let old = &state.spline;
    let alone = |control: std::ops::Range<usize>| {
        let first_m = control.start as f64 * old.spacing_m;
        let is_own = |k: &usize| old.ends_m(state.u_m[*k])[0] == first_m;
        let readings: Vec<usize> = (0..state.u_m.len()).filter(is_own).collect();
        let u_m = readings.iter().map(|k| state.u_m[*k] - first_m).collect();
        Piece { spline: old.piece(control), u_m, readings }
    };
    old.pieces().map(alone).collect()
}

/// Pieces as one spline with equal knot spacing, m, and the place of each reading on it.
#[must_use]
pub(crate) fn joined(pieces: &[Piece], spacing_m: f64, counted: &[bool]) -> Option<(Spline, Vec<f64>)> {
    let (mut control, mut breaks, mut u_m) = (Vec::new(), Vec::new(), vec![0.0; counted.len()]);
    for piece in pieces {
        let is_counted = |k: usize| counted[piece.readings[k]];
        let (spline, places_m) = laid_again((&piece.spline, &piece.u_m), &is_counted, (spacing_m, true))?;
        if !control.is_empty() {
            breaks.push(control.len());
        }
        let first_m = control.len() as f64 * spacing_m;
        for (k, place_m) in piece.readings.iter().zip(places_m) {
            u_m[*k] = first_m + place_m;
        }
        control.extend(spline.control);
    }
    Some((Spline { control, spacing_m, closed: false, breaks }, u_m))
}

/// A curve in one piece with other knots, at about a spacing, m, or exactly at it; with the new places of its readings.
fn laid_again(
    (old, places_m): (&Spline, &[f64]),
    is_counted: &dyn Fn(usize) -> bool,
    (spacing_m, is_exact): (f64, bool),
) -> Option<(Spline, Vec<f64>)> {
    const PER_KNOT: usize = 16;
    /// Tolerance for a whole number of knots.
    const ROUNDED: f64 = 1.0 + 1e-9;
    let lengths_m = old.arc_lengths(PER_KNOT);
    let step_m = old.spacing_m / PER_KNOT as f64;
    let arc_at = |u_m: f64| {
        let place = (u_m / step_m).clamp(0.0, (lengths_m.len() - 1) as f64);
        let before = (place as usize).min(lengths_m.len() - 2);
        let part = place - before as f64;
        lengths_m[before] * (1.0 - part) + lengths_m[before + 1] * part
    };
    let length_m = *lengths_m.last()?;
    let (from_m, to_m) = if old.closed {
        (0.0, length_m)
    } else {
        let places = || (0..places_m.len()).filter(|k| is_counted(*k)).map(|k| arc_at(places_m[k]));
        let (least, most) =
            (places().fold(f64::INFINITY, f64::min), places().fold(f64::NEG_INFINITY, f64::max));
        (least - BEYOND * spacing_m, most + BEYOND * spacing_m)
    };
    if to_m <= from_m || !(to_m - from_m).is_finite() {
        return None;
    }
    let knots_m = Spline::segments(to_m - from_m, spacing_m, old.closed) as f64 * spacing_m;
    let (own_m, scale, spacing_m) = if is_exact {
        (knots_m, knots_m / (to_m - from_m), spacing_m * ROUNDED)
    } else {
        (to_m - from_m, 1.0, spacing_m)
    };
    // A curve may lead anywhere beyond its readings. Only a length that its knots can follow is used.
    let count = ((to_m - from_m) / step_m).ceil().clamp(8.0, (2 * PER_KNOT * MOST_CONTROL) as f64) as usize;
    let sample = |k: usize| {
        let along_m = (to_m - from_m) * k as f64 / count as f64;
        let at_m = from_m + along_m;
        let point = if old.closed || (0.0..=length_m).contains(&at_m) {
            old.point(Spline::u_of_arc_length(&lengths_m, step_m, at_m))
        } else {
            beyond(old, at_m, length_m)
        };
        (along_m * scale, point, 1.0)
    };
    let samples: Vec<_> = (0..=count).map(sample).collect();
    let spline = Spline::through(&samples, own_m, spacing_m, old.closed, MOST_CONTROL)?;
    let u_m = places_m.iter().map(|u_m| (arc_at(*u_m) - from_m) * scale).collect();
    Some((spline, u_m))
}

/// A point beyond an end of an open curve, along the end's tangent, m.
fn beyond(spline: &Spline, at_m: f64, length_m: f64) -> Vector3<f64> {
    let (end_u_m, over_m) = if at_m < 0.0 { (0.0, at_m) } else { (spline.span_m(), at_m - length_m) };
    let (point, tangent) = spline.at(&spline.basis(end_u_m));
    point + tangent.normalize() * over_m
}
