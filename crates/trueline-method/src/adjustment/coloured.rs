//! Correlated noise: white noise plus a short and a long Ornstein–Uhlenbeck process \[Uhlenbeck1930\]. A Kalman filter whitens rows in time order
//! \[Kalman1960\].

use crate::problem::row_products::RowProducts;
use nalgebra::DMatrix;

/// Amount of correlated noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coloured {
    /// Variance of the short process, in units of the white noise's.
    pub amplitude: f64,
    /// Correlation time of the short process, s.
    pub lasts_s: f64,
    /// Variance of the long process ([`LONG_S`]), in the same units.
    pub long: f64,
}

/// Correlation time of the long process, s: the time in which an arm turns.
pub const LONG_S: f64 = 2.5;

impl Coloured {
    /// No correlated noise.
    pub const NONE: Self = Self { amplitude: 0.0, lasts_s: 1.0, long: 0.0 };

    /// Variance of both processes.
    #[must_use]
    pub fn lasting(&self) -> f64 {
        self.amplitude + self.long
    }
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

/// Whitened rows with their filter gains, so that another column can be added.
pub(crate) struct Whitened {
    width: usize,
    /// The whitened rows of nonzero weight.
    rows: Vec<f64>,
    /// Filter gains of every row. `None` for a row of weight 0.
    gains: Vec<(Two, Option<Gain>)>,
    /// Their products.
    pub sums: Sums,
}

/// One number for each process.
type Two = [f64; 2];

/// The gain of a row. The innovation is the value minus both predictions, times the scale.
#[derive(Clone, Copy, Debug)]
struct Gain {
    gain: Two,
    scale: f64,
}

impl Whitened {
    /// The sums with one column replaced, one value for each row.
    #[must_use]
    pub(crate) fn with_column(&self, column: usize, values: impl Iterator<Item = f64>) -> Sums {
        let mut predicted = [0.0; 2];
        let mut counted = self.rows.chunks_exact(self.width);
        let mut with_all = vec![0.0; self.width];
        let mut square = 0.0;
        for (value, (kept, gain)) in values.zip(&self.gains) {
            predicted = [predicted[0] * kept[0], predicted[1] * kept[1]];
            let Some(Gain { gain, scale }) = gain else { continue };
            let Some(row) = counted.next() else { break };
            let new = value - predicted[0] - predicted[1];
            predicted = [predicted[0] + gain[0] * new, predicted[1] + gain[1] * new];
            let innovation = new * scale;
            square += innovation * innovation;
            with_all.iter_mut().zip(row).for_each(|(sum, number)| *sum += number * innovation);
        }
        let mut sums = self.sums.clone();
        for (k, with) in with_all.into_iter().enumerate() {
            sums.products[(k, column)] = with;
            sums.products[(column, k)] = with;
        }
        sums.products[(column, column)] = square;
        sums
    }
}

/// A row in time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tick {
    /// Time since the previous row, s. Infinite at the start of a series.
    pub since_s: f64,
    /// Inverse of the row's relative white variance. A row of weight 0 is left out.
    pub weight: f64,
}

/// Whitens rows of equal length in time order.
#[must_use]
pub(crate) fn whiten(rows: &[f64], width: usize, ticks: &[Tick], noise: Coloured) -> Whitened {
    let mut filter = Filter::new(noise);
    let gains: Vec<_> = ticks.iter().map(|tick| filter.next(tick)).collect();
    let mut predicted = [vec![0.0; width], vec![0.0; width]];
    let mut products = RowProducts::new(width);
    let mut whitened = Vec::with_capacity(rows.len());
    for (row, (kept, gain)) in rows.chunks_exact(width).zip(&gains) {
        for (predicted, kept) in predicted.iter_mut().zip(kept).filter(|(_, kept)| **kept != 1.0) {
            predicted.iter_mut().for_each(|predicted| *predicted *= kept);
        }
        let Some(Gain { gain, scale }) = gain else { continue };
        let innovations = products.next_row();
        let [short, long] = &mut predicted;
        for (((value, short), long), innovation) in row.iter().zip(short).zip(long).zip(&mut *innovations) {
            let new = value - *short - *long;
            *short += gain[0] * new;
            *long += gain[1] * new;
            *innovation = new * scale;
        }
        whitened.extend_from_slice(innovations);
    }
    let (log_determinant, count) = (filter.log_determinant, filter.count);
    let sums = Sums { products: products.sums(), log_determinant, count };
    Whitened { width, rows: whitened, gains, sums }
}

/// A Kalman filter. The covariance of its prediction depends on the rows' times alone.
struct Filter {
    noise: Coloured,
    /// Variances of both processes, and their covariance.
    variances: Two,
    covariance: f64,
    log_determinant: f64,
    count: usize,
}

impl Filter {
    fn new(noise: Coloured) -> Self {
        let variances = [noise.amplitude, noise.long];
        Self { noise, variances, covariance: 0.0, log_determinant: 0.0, count: 0 }
    }

    /// Decay of the predictions until a row, and the row's gain.
    fn next(&mut self, tick: &Tick) -> (Two, Option<Gain>) {
        let processes = [(self.noise.amplitude, self.noise.lasts_s), (self.noise.long, LONG_S)];
        let mut kept = [1.0; 2];
        for ((variance, kept), (amplitude, lasts_s)) in
            self.variances.iter_mut().zip(&mut kept).zip(processes)
        {
            if amplitude > 0.0 {
                *kept = (-tick.since_s / lasts_s).exp();
                *variance = *kept * *kept * *variance + amplitude * (1.0 - *kept * *kept);
            }
        }
        self.covariance *= kept[0] * kept[1];
        if tick.weight <= 0.0 {
            return (kept, None);
        }
        let with = self.variances.map(|variance| variance + self.covariance);
        let total = with[0] + with[1] + tick.weight.recip();
        let (gain, scale) = (with.map(|with| with / total), total.sqrt().recip());
        self.variances = [0, 1].map(|k| self.variances[k] - gain[k] * with[k]);
        self.covariance -= gain[0] * with[1];
        self.log_determinant += total.ln();
        self.count += 1;
        (kept, Some(Gain { gain, scale }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    const NOISE: Coloured = Coloured { amplitude: 2.5, lasts_s: 0.3, long: 1.7 };

    /// Against the covariance matrix: two series, one row left out, others of less weight.
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
        let whitened = whiten(&rows, 3, &ticks, NOISE);
        let sums = whitened.sums.clone();
        let kept: Vec<usize> = (0..40).filter(|k| weight(*k) > 0.0).collect();
        let covariance = DMatrix::from_fn(kept.len(), kept.len(), |i, j| {
            let (a, b) = (kept[i], kept[j]);
            let apart_s = (times[a] - times[b]).abs();
            let lasting =
                NOISE.amplitude * (-apart_s / NOISE.lasts_s).exp() + NOISE.long * (-apart_s / LONG_S).exp();
            let white = if i == j { weight(a).recip() } else { 0.0 };
            white + if series(a) == series(b) { lasting } else { 0.0 }
        });
        let columns = DMatrix::from_fn(kept.len(), 3, |i, j| rows[3 * kept[i] + j]);
        let Some(factor) = covariance.cholesky() else { panic!("a covariance") };
        let expected = columns.transpose() * factor.solve(&columns);
        // Rounding only: 32 rows of about one, and a covariance with condition number below 30.
        assert!((sums.products - expected).amax() < 1e-11);
        let log_determinant = 2.0 * DVector::from(factor.l().diagonal()).map(f64::ln).sum();
        assert!((sums.log_determinant - log_determinant).abs() < 1e-11);
        assert_eq!(sums.count, kept.len());
        // A replaced last column gives the same sums as if it had been there from the start.
        let other: Vec<f64> = (0..40).map(|k| (f64::from(k) * 1.3).cos()).collect();
        let mut changed = rows.clone();
        (0..40).for_each(|k| changed[3 * k + 2] = other[k]);
        let followed = whitened.with_column(2, other.iter().copied());
        let plain = whiten(&changed, 3, &ticks, NOISE).sums;
        assert!((followed.products - plain.products).amax() < 1e-11);
    }
}
