//! Whitens noise that is correlated along one variable, time or the place on the seam: a scalar Kalman filter of an Ornstein–Uhlenbeck process plus
//! white noise \[Uhlenbeck1930; Kalman1960\].
//!
//! cov(y(a), y(b)) = (1 − w) ρ^(|a − b|/step) + w δ_ab, in units of the variance. The filter turns values in rising order into innovations of unit
//! variance. Applied to residual and Jacobian alike, it multiplies both by V^(−½).

use crate::problem::row_products::RowProducts;
use nalgebra::{DMatrix, DVector};

/// Correlation of neighbours, and the white share of the variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correlation {
    /// ρ: correlation of the coloured part over one step.
    pub neighbours: f64,
    /// w.
    pub white_share: f64,
}

/// White noise.
pub(crate) const WHITE: Correlation = Correlation { neighbours: 0.0, white_share: 1.0 };

/// Sums of a whitened series.
#[derive(Clone, Debug)]
pub struct Whitened {
    /// Jᵀ V⁻¹ J.
    pub hessian: DMatrix<f64>,
    /// Jᵀ V⁻¹ r.
    pub gradient: DVector<f64>,
    /// rᵀ V⁻¹ r.
    pub square: f64,
    /// ln |V|.
    pub log_determinant: f64,
    /// Number of samples.
    pub count: usize,
}

impl Whitened {
    /// The sums scaled to a series that is longer by a factor.
    #[must_use]
    pub(crate) fn times(self, factor: f64) -> Self {
        Self {
            hessian: self.hessian * factor,
            gradient: self.gradient * factor,
            square: self.square * factor,
            log_determinant: self.log_determinant * factor,
            count: (self.count as f64 * factor).round() as usize,
        }
    }
}

/// The gain at one sample. The innovation is (value − kept · predicted). The next prediction is kept · predicted + gain times the innovation.
#[derive(Clone, Copy, Debug)]
struct Gain {
    kept: f64,
    gain: f64,
    /// Scales the innovation to unit variance.
    scale: f64,
}

/// Variance of the prediction. It depends on the places of the samples alone.
#[derive(Clone, Copy, Debug)]
struct Variance {
    correlation: Correlation,
    log_neighbours: f64,
    coloured: f64,
    predicted: f64,
}

impl Variance {
    fn new(correlation: Correlation) -> Self {
        let coloured = 1.0 - correlation.white_share;
        let log_neighbours = correlation.neighbours.max(f64::MIN_POSITIVE).ln();
        Self { correlation, log_neighbours, coloured, predicted: coloured }
    }

    /// Advances to a sample at a distance in steps. Returns its gain and its innovation's variance.
    fn next(&mut self, apart_steps: f64) -> (Gain, f64) {
        let kept = (apart_steps * self.log_neighbours).exp();
        let variance = kept * kept * self.predicted + self.coloured * (1.0 - kept * kept);
        let total = variance + self.correlation.white_share;
        let gain = variance / total;
        self.predicted = variance * (1.0 - gain);
        (Gain { kept, gain, scale: total.sqrt().recip() }, total)
    }
}

/// A sum of logarithms, taken only when the product would leave the range of a float.
#[derive(Clone, Copy, Debug)]
struct LogProduct {
    product: f64,
    sum: f64,
}

impl LogProduct {
    const ONE: Self = Self { product: 1.0, sum: 0.0 };

    fn times(&mut self, factor: f64) {
        self.product *= factor;
        if !(1e-200..1e200).contains(&self.product) {
            self.sum += self.product.ln();
            self.product = 1.0;
        }
    }

    fn ln(self) -> f64 {
        self.sum + self.product.ln()
    }
}

/// Whitens a stream of rows: the Jacobian with the residual as the last number.
pub struct Whitening {
    variance: Variance,
    predicted: Vec<f64>,
    innovations: RowProducts,
    log_determinant: LogProduct,
    count: usize,
}

impl Whitening {
    /// For rows with a number of unknowns.
    #[must_use]
    pub fn new(correlation: Correlation, unknowns: usize) -> Self {
        Self {
            variance: Variance::new(correlation),
            predicted: vec![0.0; unknowns + 1],
            innovations: RowProducts::new(unknowns + 1),
            log_determinant: LogProduct::ONE,
            count: 0,
        }
    }

    /// Adds the next sample, at a distance in steps from the last of its group. The distance is infinite at the start of a group. Returns its
    /// innovation, of unit variance times the level.
    pub fn take(&mut self, apart_steps: f64, row: &[f64]) -> &[f64] {
        let (Gain { kept, gain, scale }, total) = self.variance.next(apart_steps);
        let innovation = self.innovations.next_row();
        for ((value, predicted), innovation) in row.iter().zip(&mut self.predicted).zip(innovation) {
            let before = kept * *predicted;
            let new = value - before;
            *predicted = before + gain * new;
            *innovation = new * scale;
        }
        self.log_determinant.times(total);
        self.count += 1;
        self.innovations.last_row()
    }

    /// The sums over all samples.
    #[must_use]
    pub fn sums(self) -> Whitened {
        let unknowns = self.predicted.len() - 1;
        let products = self.innovations.sums();
        Whitened {
            hessian: products.view((0, 0), (unknowns, unknowns)).into_owned(),
            gradient: products.view((0, unknowns), (unknowns, 1)).column(0).into_owned(),
            square: products[(unknowns, unknowns)],
            log_determinant: self.log_determinant.ln(),
            count: self.count,
        }
    }
}

/// Filters of several correlations over the same values. Each list has one entry for each filter.
struct Filters {
    log_neighbours: Vec<f64>,
    white_share: Vec<f64>,
    coloured: Vec<f64>,
    kept: Vec<f64>,
    variance: Vec<f64>,
    predicted: Vec<f64>,
    square: Vec<f64>,
    product: Vec<f64>,
    log_determinant: Vec<f64>,
}

/// Number of samples whose innovation variances are multiplied before the logarithm. None is below the white share: with the least that is tried,
/// 0.0025, the product is at least 5e-84.
const MULTIPLIED: usize = 32;

impl Filters {
    fn new(correlations: &[Correlation]) -> Self {
        let of_each = |number: fn(&Correlation) -> f64| correlations.iter().map(number).collect::<Vec<f64>>();
        let coloured = of_each(|c| 1.0 - c.white_share);
        let zeros = vec![0.0; correlations.len()];
        Self {
            log_neighbours: of_each(|c| c.neighbours.max(f64::MIN_POSITIVE).ln()),
            white_share: of_each(|c| c.white_share),
            kept: zeros.clone(),
            variance: coloured.clone(),
            coloured,
            predicted: zeros.clone(),
            square: zeros.clone(),
            product: vec![1.0; correlations.len()],
            log_determinant: zeros,
        }
    }

    fn take(&mut self, apart_steps: f64, value: f64) {
        // Neighbouring entries share their correlation, so its exponential is computed once.
        let mut last = (f64::NAN, f64::NAN);
        for (kept, log_neighbours) in self.kept.iter_mut().zip(&self.log_neighbours) {
            if *log_neighbours != last.0 {
                last = (*log_neighbours, (apart_steps * log_neighbours).exp());
            }
            *kept = last.1;
        }
        let fixed = self.kept.iter().zip(&self.white_share).zip(&self.coloured);
        let filter = self.variance.iter_mut().zip(&mut self.predicted);
        let sums = self.square.iter_mut().zip(&mut self.product);
        for (((kept, white_share), coloured), ((variance, predicted), (square, product))) in
            fixed.zip(filter.zip(sums))
        {
            let before = kept * kept * *variance + coloured * (1.0 - kept * kept);
            let total = before + white_share;
            let per_total = 1.0 / total;
            let gain = before * per_total;
            let new = value - kept * *predicted;
            *variance = before * (1.0 - gain);
            *predicted = kept * *predicted + gain * new;
            *square += new * new * per_total;
            *product *= total;
        }
    }

    fn take_logarithms(&mut self) {
        for (log_determinant, product) in self.log_determinant.iter_mut().zip(&mut self.product) {
            *log_determinant += product.ln();
            *product = 1.0;
        }
    }
}

/// Twice the negative log likelihood of values for each correlation, at its most likely variance. Each value comes with its distance from the
/// previous one in steps.
#[must_use]
pub(crate) fn twice_negative_logs(
    values: impl Iterator<Item = (f64, f64)>,
    correlations: &[Correlation],
) -> Vec<f64> {
    let mut filters = Filters::new(correlations);
    let mut count = 0_usize;
    for (apart_steps, value) in values {
        filters.take(apart_steps, value);
        count += 1;
        if count.is_multiple_of(MULTIPLIED) {
            filters.take_logarithms();
        }
    }
    filters.take_logarithms();
    let count = count as f64;
    let of_sums =
        |(log_determinant, square): (&f64, &f64)| log_determinant + count * (square / count).ln() + count;
    filters.log_determinant.iter().zip(&filters.square).map(of_sums).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORRELATION: Correlation = Correlation { neighbours: 0.7, white_share: 0.15 };

    /// Place and group of samples with a gap, two at one place and two groups, and their rows: more than two blocks.
    fn samples() -> Vec<((f64, u32), [f64; 3])> {
        let places = [(0.0, 0), (1.0, 0), (1.0, 0), (3.5, 0)].into_iter();
        let places = places.chain((0..150).map(|k| (0.2 + 1.7 * f64::from(k), 1)));
        let row = |k: usize| [1.0, (k as f64).cos(), (k as f64 * 1.7).sin()];
        places.enumerate().map(|(k, place)| (place, row(k))).collect()
    }

    fn apart(samples: &[((f64, u32), [f64; 3])], k: usize) -> f64 {
        match k.checked_sub(1).map(|last| samples[last].0) {
            Some((at, group)) if group == samples[k].0.1 => samples[k].0.0 - at,
            _ => f64::INFINITY,
        }
    }

    fn covariance(samples: &[((f64, u32), [f64; 3])]) -> DMatrix<f64> {
        DMatrix::from_fn(samples.len(), samples.len(), |i, j| {
            let ((a, group), (b, other)) = (samples[i].0, samples[j].0);
            let coloured = (1.0 - CORRELATION.white_share) * CORRELATION.neighbours.powf((a - b).abs());
            let white = if i == j { CORRELATION.white_share } else { 0.0 };
            if group == other { coloured + white } else { white }
        })
    }

    /// Against the covariance matrix.
    #[test]
    fn the_filter_is_the_inverse_of_the_covariance() {
        let samples = samples();
        let covariance = covariance(&samples);
        let mut whitening = Whitening::new(CORRELATION, 2);
        let mut last = Vec::new();
        for (k, (_, row)) in samples.iter().enumerate() {
            last.push(whitening.take(apart(&samples, k), row)[2]);
        }
        let sums = whitening.sums();
        let slopes = DMatrix::from_fn(samples.len(), 2, |i, j| samples[i].1[j]);
        let residuals = DVector::from_fn(samples.len(), |i, _| samples[i].1[2]);
        let inverse = covariance.clone().try_inverse().unwrap_or_default();
        // Rounding only: 154 samples of about one, and a covariance with condition number below 50.
        assert!((sums.hessian - slopes.transpose() * &inverse * &slopes).amax() < 1e-11);
        assert!((sums.gradient - slopes.transpose() * &inverse * &residuals).amax() < 1e-11);
        assert!((sums.square - residuals.dot(&(&inverse * &residuals))).abs() < 1e-11);
        let log_determinant =
            covariance.cholesky().map_or(f64::NAN, |c| 2.0 * c.l().diagonal().map(f64::ln).sum());
        assert!((sums.log_determinant - log_determinant).abs() < 1e-11);
        assert!((last.iter().map(|e| e * e).sum::<f64>() - sums.square).abs() < 1e-11);
        assert_eq!(sums.count, samples.len());
    }

    /// The likelihood of values alone equals that from their covariance at its most likely size.
    #[test]
    fn values_alone_have_the_likelihood_of_their_covariance() {
        let samples = samples();
        let n = samples.len() as f64;
        let factor = covariance(&samples).cholesky().map(|c| (c.inverse(), c.l()));
        let Some((inverse, l)) = factor else { panic!("a covariance") };
        let residuals = DVector::from_fn(samples.len(), |i, _| samples[i].1[2]);
        let variance = residuals.dot(&(inverse * &residuals)) / n;
        let expected = 2.0 * l.diagonal().map(f64::ln).sum() + n * variance.ln() + n;
        let values = (0..samples.len()).map(|k| (apart(&samples, k), samples[k].1[2]));
        // Rounding of a number of about a hundred.
        let beside = Correlation { neighbours: 0.3, ..CORRELATION };
        let found = twice_negative_logs(values.clone(), &[WHITE, CORRELATION, CORRELATION, beside]);
        assert!((found[1] - expected).abs() < 1e-10);
        assert_eq!(found[1], found[2]);
        // Each has its own correlation. White values have the likelihood of their mean square.
        let square = residuals.norm_squared();
        assert!((found[0] - (n * (square / n).ln() + n)).abs() < 1e-10);
        assert_eq!(found[3], twice_negative_logs(values, &[beside])[0]);
    }
}
