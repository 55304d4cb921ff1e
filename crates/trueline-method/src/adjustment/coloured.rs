//! Noise that lasts from frame to frame: white noise with an Ornstein–Uhlenbeck process on top \[Uhlenbeck1930\], filtered out of rows in order of
//! time \[Kalman1960\].

use crate::assess::row_products::RowProducts;
use nalgebra::DMatrix;

/// How much of the noise lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coloured {
    /// Its variance, in units of that of the white noise.
    pub amplitude: f64,
    /// Over how long it is alike, s.
    pub lasts_s: f64,
}

impl Coloured {
    /// Nothing lasts.
    pub const NONE: Self = Self { amplitude: 0.0, lasts_s: 1.0 };
}

/// Products of whitened rows with each other.
#[derive(Clone, Debug)]
pub(crate) struct Sums {
    /// Σ row rowᵀ.
    pub products: DMatrix<f64>,
    /// ln |V|, in units of the white noise.
    pub log_determinant: f64,
    /// Rows.
    pub count: usize,
}

/// A row in time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tick {
    /// Since the row before, s; infinite where another series begins.
    pub since_s: f64,
    /// How much less than the others it counts: 1 over its own white variance. A row of weight 0 is left out.
    pub weight: f64,
}

/// Whitens rows of so many numbers each, in order of time.
#[must_use]
pub(crate) fn whiten(rows: &[f64], width: usize, ticks: &[Tick], noise: Coloured) -> Sums {
    let mut filter = Filter::new(noise, width);
    let mut products = RowProducts::new(width);
    for (row, tick) in rows.chunks_exact(width).zip(ticks) {
        filter.pass(tick.since_s);
        if tick.weight > 0.0 {
            filter.take(row, tick.weight.recip(), products.next_row());
        }
    }
    Sums { products: products.sums(), log_determinant: filter.log_determinant, count: filter.count }
}

/// A Kalman filter over rows: what one number of a row is expected to be follows the same numbers of those before.
struct Filter {
    noise: Coloured,
    variance: f64,
    predicted: Vec<f64>,
    log_determinant: f64,
    count: usize,
}

impl Filter {
    fn new(noise: Coloured, width: usize) -> Self {
        Self {
            noise,
            variance: noise.amplitude,
            predicted: vec![0.0; width],
            log_determinant: 0.0,
            count: 0,
        }
    }

    /// Some time goes by.
    fn pass(&mut self, since_s: f64) {
        if self.noise.amplitude <= 0.0 {
            return;
        }
        let kept = (-since_s / self.noise.lasts_s).exp();
        self.variance = kept * kept * self.variance + self.noise.amplitude * (1.0 - kept * kept);
        self.predicted.iter_mut().for_each(|predicted| *predicted *= kept);
    }

    /// A row with so much white variance of its own: its innovation is of unit variance.
    fn take(&mut self, row: &[f64], white: f64, innovations: &mut [f64]) {
        let total = self.variance + white;
        let (gain, scale) = (self.variance / total, total.sqrt().recip());
        for ((value, predicted), innovation) in row.iter().zip(&mut self.predicted).zip(innovations) {
            let new = value - *predicted;
            *predicted += gain * new;
            *innovation = new * scale;
        }
        self.variance *= 1.0 - gain;
        self.log_determinant += total.ln();
        self.count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    const NOISE: Coloured = Coloured { amplitude: 2.5, lasts_s: 0.3 };

    /// Against the covariance matrix itself: two series, one row left out, others of less weight.
    #[test]
    fn the_filter_is_the_inverse_of_the_covariance() {
        let times: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k) + 0.02 * f64::from(k).sin()).collect();
        let series = |k: usize| k / 25;
        let weight = |k: usize| [1.0, 0.4, 1.0, 0.0, 0.7][k % 5];
        let rows: Vec<f64> = (0..40 * 3).map(|k| (f64::from(k) * 0.7).sin()).collect();
        let since = |k: usize| {
            if k == 0 || series(k) != series(k - 1) { f64::INFINITY } else { times[k] - times[k - 1] }
        };
        let ticks: Vec<Tick> = (0..40).map(|k| Tick { since_s: since(k), weight: weight(k) }).collect();
        let sums = whiten(&rows, 3, &ticks, NOISE);
        let kept: Vec<usize> = (0..40).filter(|k| weight(*k) > 0.0).collect();
        let covariance = DMatrix::from_fn(kept.len(), kept.len(), |i, j| {
            let (a, b) = (kept[i], kept[j]);
            let lasting = NOISE.amplitude * (-(times[a] - times[b]).abs() / NOISE.lasts_s).exp();
            let white = if i == j { weight(a).recip() } else { 0.0 };
            white + if series(a) == series(b) { lasting } else { 0.0 }
        });
        let columns = DMatrix::from_fn(kept.len(), 3, |i, j| rows[3 * kept[i] + j]);
        let Some(factor) = covariance.cholesky() else { panic!("a covariance") };
        let expected = columns.transpose() * factor.solve(&columns);
        // Of 32 rows of about one, whose covariance's condition is below 30: rounding only.
        assert!((sums.products - expected).amax() < 1e-11);
        let log_determinant = 2.0 * DVector::from(factor.l().diagonal()).map(f64::ln).sum();
        assert!((sums.log_determinant - log_determinant).abs() < 1e-11);
        assert_eq!(sums.count, kept.len());
    }
}
