//! The form of a seam beyond its bow: hat functions along it, which stay where they are in space.

/// Hats at equal distances along a seam; between two of them the form is straight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hats {
    /// Place of the first, m from the seam's anchor.
    first_m: f64,
    /// From one to the next, m.
    apart_m: f64,
    /// Their number.
    pub count: usize,
}

/// More hats than this along all seams add no information to fewer that are farther apart …
const MOST: usize = 80;
/// … and the least number of a seam.
const LEAST: usize = 12;

impl Hats {
    /// Over one of so many seams that is seen from one place to another, so far apart, or as far as there may be hats.
    #[must_use]
    pub(crate) fn over([from_m, to_m]: [f64; 2], apart_m: f64, seams: usize) -> Self {
        let most = (MOST / seams.max(1)).max(LEAST);
        let apart_m = apart_m.max((to_m - from_m) / (most - 1) as f64);
        let count = ((to_m - from_m) / apart_m).ceil() as usize + 1;
        Self { first_m: from_m, apart_m, count }
    }

    /// The hats that are there at a place: the number of the first of two and what each of them is. Beyond the ends the form goes on as it is there.
    #[must_use]
    pub(crate) fn at(&self, along_m: f64) -> (usize, [f64; 2]) {
        let place = ((along_m - self.first_m) / self.apart_m).clamp(0.0, (self.count - 1) as f64);
        let first = (place.floor() as usize).min(self.count.saturating_sub(2));
        let beyond = place - first as f64;
        (first, [1.0 - beyond, beyond])
    }

    /// The slope of a form at a place, 1: values are those of one direction at the hats, m.
    #[must_use]
    pub(crate) fn slope(&self, along_m: f64, values: impl Fn(usize) -> f64) -> f64 {
        if self.count < 2 {
            return 0.0;
        }
        let (first, _) = self.at(along_m);
        (values(first + 1) - values(first)) / self.apart_m
    }

    /// The value of a form at a place, m.
    #[must_use]
    pub(crate) fn value(&self, along_m: f64, values: impl Fn(usize) -> f64) -> f64 {
        let (first, [one, other]) = self.at(along_m);
        let second = if self.count > 1 { values(first + 1) } else { 0.0 };
        one * values(first) + other * second
    }
}
