//! Noise that lasts from frame to frame: white noise with two Ornstein–Uhlenbeck processes on top \[Uhlenbeck1930\], a short and a long one, filtered out of
//! rows in order of time \[Kalman1960\].

use crate::problem::row_products::RowProducts;
use nalgebra::DMatrix;

/// Amount of correlated noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coloured {
    /// Its variance, in units of that of the white noise.
    pub amplitude: f64,
    /// Over how long it is alike, s.
    pub lasts_s: f64,
    /// The variance of what lasts for [`LONG_S`], in the same units.
    pub long: f64,
}

/// How long the long one of the processes lasts, s: what swings as slowly as an arm turns.
pub const LONG_S: f64 = 2.5;

impl Coloured {
    /// Nothing lasts.
    pub const NONE: Self = Self { amplitude: 0.0, lasts_s: 1.0, long: 0.0 };

    /// The variance of all that lasts.
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

/// Rows that were whitened, and how: another column can follow.
pub(crate) struct Whitened {
    width: usize,
    /// The whitened rows, of those that count.
    rows: Vec<f64>,
    /// How each of all rows is filtered; `None` of one that does not count.
    gains: Vec<(Two, Option<Gain>)>,
    /// Their products.
    pub sums: Sums,
}

/// A number of each of both processes.
type Two = [f64; 2];

/// How a row is filtered: the innovation is the value less what both processes predict, times the scale.
#[derive(Clone, Copy, Debug)]
struct Gain {
    gain: Two,
    scale: f64,
}

impl Whitened {
    /// The sums with other values in one column, one for each of all rows.
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
    /// Since the row before, s; infinite where another series begins.
    pub since_s: f64,
    /// How much less than the others it counts: 1 over its own white variance. A row of weight 0 is left out.
    pub weight: f64,
}

/// Whitens rows of equal length, in order of time.
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

/// A Kalman filter: how the covariance of what is predicted follows the rows, by their places alone.
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

    /// What is kept of the predictions until a row, and how the row is filtered.
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
        // Of 32 rows of about one, whose covariance's condition is below 30: rounding only.
        assert!((sums.products - expected).amax() < 1e-11);
        let log_determinant = 2.0 * DVector::from(factor.l().diagonal()).map(f64::ln).sum();
        assert!((sums.log_determinant - log_determinant).abs() < 1e-11);
        assert_eq!(sums.count, kept.len());
        // Another last column follows as if it had been there.
        let other: Vec<f64> = (0..40).map(|k| (f64::from(k) * 1.3).cos()).collect();
        let mut changed = rows.clone();
        (0..40).for_each(|k| changed[3 * k + 2] = other[k]);
        let followed = whitened.with_column(2, other.iter().copied());
        let plain = whiten(&changed, 3, &ticks, NOISE).sums;
        assert!((followed.products - plain.products).amax() < 1e-11);
    }
}
