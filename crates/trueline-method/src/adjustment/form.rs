//! The form of a seam beyond its bow: hat functions along it, fixed in space.

/// Hats at equal distances along a seam. The form is straight between two of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hats {
    /// Place of the first, m from the seam's anchor.
    first_m: f64,
    /// Spacing of the hats, m.
    apart_m: f64,
    /// Their number.
    pub count: usize,
}

/// Maximum number of hats along all seams. More hats than this add no information …
const MOST: usize = 80;
/// … and the least number of a seam.
const LEAST: usize = 12;

impl Hats {
    /// The hats of one seam between two places on it, m. Their spacing grows if there would be too many over all seams.
    #[must_use]
    pub(crate) fn over([from_m, to_m]: [f64; 2], apart_m: f64, seams: usize) -> Self {
        let most = (MOST / seams.max(1)).max(LEAST);
        let apart_m = apart_m.max((to_m - from_m) / (most - 1) as f64);
        let count = ((to_m - from_m) / apart_m).ceil() as usize + 1;
        Self { first_m: from_m, apart_m, count }
    }

    /// The two hats at a place: the number of the first, and the value of each. Beyond the ends the form is constant.
    #[must_use]
    pub(crate) fn at(&self, along_m: f64) -> (usize, [f64; 2]) {
        let place = ((along_m - self.first_m) / self.apart_m).clamp(0.0, (self.count - 1) as f64);
        let first = (place.floor() as usize).min(self.count.saturating_sub(2));
        let beyond = place - first as f64;
        (first, [1.0 - beyond, beyond])
    }

    /// Slope of a form at a place, dimensionless, from its values at the hats in one direction, m.
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
