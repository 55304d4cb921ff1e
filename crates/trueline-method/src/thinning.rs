//! Some of many: what changes slowly along a scan is seen by a few hundred of its readings.

/// Every how many-th of so many is taken for there to be at most a number of them.
#[must_use]
pub(crate) fn stride(count: usize, most: usize) -> usize {
    count.div_ceil(most).max(1)
}
