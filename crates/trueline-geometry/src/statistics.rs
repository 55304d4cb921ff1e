//! Medians and related statistics, robust against a minority of outliers.

/// Part of all values over which their correlation is computed.
const LAG_PART: f64 = 0.25;

/// The median (upper of the middle two). `None` without values.
#[must_use]
pub fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The value below which a fraction of all values lies. `None` without values.
#[must_use]
pub fn quantile(values: impl Iterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let place = (values.len() as f64 * share) as usize;
    (place < values.len()).then(|| *values.select_nth_unstable_by(place, f64::total_cmp).1)
}

/// Standard deviation from the median absolute deviation. 0 without values.
#[must_use]
pub fn mad_sigma(values: &[f64]) -> f64 {
    let middle = median(values.iter().copied()).unwrap_or(0.0);
    // The median of |N(0, 1)| is 0.67449.
    median(values.iter().map(|v| (v - middle).abs())).unwrap_or(0.0) / 0.674_49
}

/// Ratio of the variance of a mean to that of independent values: 1 + 2 Σ ρ over the lags up to the first that may be chance
/// \[Geyer1992\].
#[must_use]
pub fn lasting<T>(values: &[T], product: impl Fn(&T, &T) -> f64) -> f64 {
    let squares: f64 = values.iter().map(|value| product(value, value)).sum();
    // Two standard deviations of a correlation of numbers without any; of six each there are six times as many.
    let chance = 2.0 / (values.len() as f64).sqrt();
    let most = (LAG_PART * values.len() as f64) as usize;
    let mut factor = 1.0;
    for lag in 1..=most {
        let sum: f64 = values.iter().zip(&values[lag..]).map(|(a, b)| product(a, b)).sum();
        let correlation = sum / squares;
        if correlation.is_nan() || correlation <= chance {
            break;
        }
        factor += 2.0 * correlation;
    }
    factor
}

#[cfg(test)]
mod tests {
    use super::*;

    fn middle(values: &[f64]) -> Option<f64> {
        median(values.iter().copied())
    }

    #[test]
    fn medians_and_quantiles_are_values_that_are_there() {
        assert_eq!(middle(&[]), None);
        assert_eq!(middle(&[7.0]), Some(7.0));
        assert_eq!(middle(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(middle(&[4.0, 1.0, 3.0, 2.0]), Some(3.0), "the upper of the middle two");
        assert_eq!(middle(&[1e9, -5.0, 2.0, 3.0, -1e9]), Some(2.0));
        let ten: Vec<f64> = (0..10).rev().map(f64::from).collect();
        for (share, wanted) in
            [(0.0, Some(0.0)), (0.25, Some(2.0)), (0.9, Some(9.0)), (0.99, Some(9.0)), (1.0, None)]
        {
            assert_eq!(quantile(ten.iter().copied(), share), wanted, "{share}");
        }
        assert_eq!(quantile(std::iter::empty(), 0.5), None);
    }

    #[test]
    fn the_mad_sigma_is_that_of_normal_values_wherever_they_lie_and_whatever_a_few_do() {
        // Quantiles of the standard normal at (k + ½)/9, in units of 2 about 100. Then two of them are outliers.
        let normal = [-1.593, -0.967, -0.589, -0.282, 0.0, 0.282, 0.589, 0.967, 1.593];
        let mut values = normal.map(|v| 100.0 + 2.0 * v);
        // The median of their distances from the middle is 2 · 0.589. For many values it would be 2 · 0.67449.
        assert!((mad_sigma(&values) - 2.0 * 0.589 / 0.674_49).abs() < 1e-12);
        (values[8], values[7]) = (1e6, 1e7);
        assert!((mad_sigma(&values) - 2.0 * 0.589 / 0.674_49).abs() < 1e-12);
        assert_eq!((mad_sigma(&[]), mad_sigma(&[5.0]), mad_sigma(&[5.0, 5.0, 5.0])), (0.0, 0.0, 0.0));
    }
}
