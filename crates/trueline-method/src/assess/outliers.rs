//! Counts outliers, and tests whether the inliers are a majority.

/// Least surplus of inliers over outliers, in standard deviations of a fair coin. Below it their agreement may be chance.
const MAJORITY_SIGMAS: f64 = 2.5;

/// Outliers among measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outliers {
    /// Number.
    pub count: usize,
    /// Total number.
    pub of: usize,
}

impl Outliers {
    /// Fraction of the measurements.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.count as f64 / self.of.max(1) as f64
    }

    /// Whether the inliers outnumber the outliers by more than chance: 9 of 10, 14 of 16, 40 of 60, 540 of 1000.
    #[must_use]
    pub(crate) fn leave_a_majority(&self) -> bool {
        let [outliers, of] = [self.count, self.of].map(|count| count as f64);
        of - 2.0 * outliers > MAJORITY_SIGMAS * of.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::Outliers;

    #[test]
    fn a_majority_is_more_than_chance() {
        // n − 2k > 2.5 √n.
        for (of, most) in [(10, 1), (16, 2), (60, 20), (1000, 460)] {
            assert!(Outliers { count: most, of }.leave_a_majority(), "{most} of {of}");
            assert!(!Outliers { count: most + 1, of }.leave_a_majority(), "{most} of {of}");
        }
        assert!(!Outliers::default().leave_a_majority());
    }
}
