//! Whitens what is correlated along one variable, time or the place on the seam: a scalar Kalman filter of an
//! Ornstein–Uhlenbeck process with white noise on top \[Uhlenbeck1930; Kalman1960\].
//!
//! cov(y(a), y(b)) = (1 − w) ρ^(|a − b|/step) + w δ_ab, in units of the variance. The filter turns values in rising order
//! into innovations of unit variance; run over residual and Jacobian alike it multiplies both by V^(−½).

use nalgebra::{DMatrix, DVector};

/// Correlation of neighbours, and the part of the variance that is white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correlation {
    /// ρ: correlation over one step of what is not white.
    pub neighbours: f64,
    /// w.
    pub white_share: f64,
}

/// Nothing is correlated.
pub(crate) const WHITE: Correlation = Correlation { neighbours: 0.0, white_share: 1.0 };

/// One number of an observation: where it is, in steps, its residual and its row of the Jacobian.
pub struct Sample {
    /// Place on the variable along which it is correlated, steps.
    pub at: f64,
    /// Samples of different groups are independent.
    pub group: u32,
    /// Residual, m.
    pub residual: f64,
    /// Jacobian.
    pub slope: DVector<f64>,
}

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

/// Whitens samples that lie in rising order within each group, groups one after the other.
#[must_use]
pub fn whiten(samples: &[Sample], correlation: Correlation, unknowns: usize) -> Whitened {
    let mut sums = Whitened {
        hessian: DMatrix::zeros(unknowns, unknowns),
        gradient: DVector::zeros(unknowns),
        square: 0.0,
        log_determinant: 0.0,
        count: samples.len(),
    };
    innovations(samples, correlation, unknowns, |slope, residual, variance| {
        sums.hessian.ger(1.0, slope, slope, 1.0);
        sums.gradient.axpy(residual, slope, 1.0);
        sums.square += residual * residual;
        sums.log_determinant += variance.ln();
    });
    sums
}

/// The innovations of r + J δ, of unit variance times the level.
#[must_use]
pub(crate) fn whitened_residuals(
    samples: &[Sample],
    correlation: Correlation,
    step: &DVector<f64>,
) -> Vec<f64> {
    let mut all = Vec::with_capacity(samples.len());
    innovations(samples, correlation, step.len(), |slope, residual, _| all.push(residual + slope.dot(step)));
    all
}

fn innovations(
    samples: &[Sample],
    correlation: Correlation,
    unknowns: usize,
    mut take: impl FnMut(&DVector<f64>, f64, f64),
) {
    let Correlation { neighbours, white_share } = correlation;
    let coloured = 1.0 - white_share;
    let mut predicted = DVector::zeros(unknowns);
    let (mut predicted_residual, mut variance) = (0.0, coloured);
    let mut last: Option<&Sample> = None;
    for sample in samples {
        let kept = match last {
            Some(last) if last.group == sample.group => neighbours.powf((sample.at - last.at).max(0.0)),
            _ => 0.0,
        };
        predicted *= kept;
        predicted_residual *= kept;
        variance = kept * kept * variance + coloured * (1.0 - kept * kept);
        let total = variance + white_share;
        let scale = total.sqrt().recip();
        let slope = &sample.slope - &predicted;
        let residual = sample.residual - predicted_residual;
        let gain = variance / total;
        predicted.axpy(gain, &slope, 1.0);
        predicted_residual += gain * residual;
        variance *= 1.0 - gain;
        take(&(slope * scale), residual * scale, total);
        last = Some(sample);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the covariance matrix itself, with a gap and two groups.
    #[test]
    fn the_filter_is_the_inverse_of_the_covariance() {
        let correlation = Correlation { neighbours: 0.7, white_share: 0.15 };
        let places = [(0.0, 0), (1.0, 0), (1.0, 0), (3.5, 0), (0.2, 1), (1.9, 1)];
        let samples: Vec<Sample> = places
            .iter()
            .enumerate()
            .map(|(k, (at, group))| Sample {
                at: *at,
                group: *group,
                residual: (k as f64 * 1.7).sin(),
                slope: DVector::from_vec(vec![1.0, (k as f64).cos()]),
            })
            .collect();
        let n = samples.len();
        let covariance = DMatrix::from_fn(n, n, |i, j| {
            let same = samples[i].group == samples[j].group;
            let near = correlation.neighbours.powf((samples[i].at - samples[j].at).abs());
            let white = if i == j { correlation.white_share } else { 0.0 };
            if same { (1.0 - correlation.white_share) * near + white } else { white }
        });
        let slopes = DMatrix::from_fn(n, 2, |i, j| samples[i].slope[j]);
        let residuals = DVector::from_fn(n, |i, _| samples[i].residual);
        let inverse = covariance.clone().try_inverse().unwrap_or_default();
        let sums = whiten(&samples, correlation, 2);
        // Six samples: rounding only.
        assert!((sums.hessian - slopes.transpose() * &inverse * &slopes).amax() < 1e-12);
        assert!((sums.gradient - slopes.transpose() * &inverse * &residuals).amax() < 1e-12);
        assert!((sums.square - residuals.dot(&(&inverse * &residuals))).abs() < 1e-12);
        assert!((sums.log_determinant - covariance.determinant().ln()).abs() < 1e-12);
    }
}
