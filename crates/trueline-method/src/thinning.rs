//! Thinning: quantities that change slowly along a scan need only a few hundred of its readings.

/// Step between the used items, so that at most `most` of `count` are used.
#[must_use]
pub(crate) fn stride(count: usize, most: usize) -> usize {
    count.div_ceil(most).max(1)
}
