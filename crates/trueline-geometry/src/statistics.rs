//! Medians and their kin: what the majority says, whatever the rest does.

/// The median (upper of the middle two); `None` of nothing.
#[must_use]
pub fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The value that a share of all is below; `None` of nothing.
#[must_use]
pub fn quantile(values: impl Iterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let place = (values.len() as f64 * share) as usize;
    (place < values.len()).then(|| *values.select_nth_unstable_by(place, f64::total_cmp).1)
}

/// Standard deviation from the median absolute deviation; 0 of nothing.
#[must_use]
pub fn mad_sigma(values: &[f64]) -> f64 {
    let middle = median(values.iter().copied()).unwrap_or(0.0);
    // The median of |N(0, 1)| is 0.67449.
    median(values.iter().map(|v| (v - middle).abs())).unwrap_or(0.0) / 0.674_49
}
