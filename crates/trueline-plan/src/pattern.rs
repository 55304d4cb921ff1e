//! A path that served well in one cell is a place to begin the search from in others: in the unit box it is stated as parts
//! of their own limits. It saves the longest part of a search, finding the deep valley; other starts compete with it.

use crate::design::DIMENSION;
use crate::shape::Shape;

/// Found by longer searches from other random numbers in the paper's cell, for 20 s. Ramp, share and centre of the seam come
/// first; then along the stripe, stand-off, work angle, travel angle and spin, in the order of
/// [`crate::design::from_unit_box`].
#[rustfmt::skip]
const TWO_PASSES: [f64; DIMENSION] = [
    0.911, 0.136, 0.465,
    0.324, 0.934, 0.857, 0.283, 0.808, 0.494,
    0.989, 0.574, 0.734, 0.618, 0.731, 0.751, 0.630,
    0.916, 0.195, 0.940, 0.381, 0.145, 0.450, 0.454,
    0.000, 1.000, 0.322, 0.333, 0.797, 0.134, 0.934,
    0.998, 0.436, 0.846, 0.066, 0.719, 0.062, 0.753,
];

/// A wide and slow swing of an external axis, with a second harmonic: reach, mean, share of the first, then frequency and phase of each.
pub(crate) const AXIS_PATTERN: [f64; 7] = [0.8, 0.5, 0.9, 0.25, 0.5, 0.5, 0.5];

/// The pattern of a shape; `None` if none is known.
#[must_use]
pub(crate) fn of(shape: Shape) -> Option<&'static [f64; DIMENSION]> {
    (shape == Shape::TwoPasses).then_some(&TWO_PASSES)
}
