//! A change of one kind: its significance, its size, and its hidden part.

use super::tail::log10_probability;
use crate::parameters::{Kind, UNITS};
use crate::quadratic::Quadratic;
use nalgebra::{DMatrix, DVector};

/// Directions with less information per piece than this are undetermined. A change of ten units would be one
/// standard deviation, and the little information comes from noise in the derivatives.
pub const VISIBLE: f64 = 0.01;

/// A change as estimated from a window of pieces.
#[derive(Clone, Debug)]
pub struct Change {
    /// Its kind.
    pub kind: Kind,
    /// Estimate, in the SI unit of each column of the kind; `None` if hidden.
    pub value: Vec<Option<f64>>,
    /// One standard deviation of each.
    pub sigma: Vec<Option<f64>>,
    /// Sum of squares that it explains.
    pub explained: f64,
    /// Number of dimensions.
    pub dimensions: usize,
    /// log₁₀ of the probability that chance alone explains as much.
    pub p_log10: f64,
    shown: Shown,
}

/// The visible part of the estimate, in units.
#[derive(Clone, Debug)]
struct Shown {
    value: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Onto the directions that show.
    projector: DMatrix<f64>,
}

impl Shown {
    /// A weighted sum of the columns and its standard deviation; `None` where a part of it does not show.
    fn combination(&self, weights: &DVector<f64>) -> Option<[f64; 2]> {
        let seen = weights.dot(&(&self.projector * weights)) > MOSTLY * weights.norm_squared();
        let variance = weights.dot(&(&self.covariance * weights));
        seen.then(|| [weights.dot(&self.value), variance.sqrt()])
    }
}

impl Shown {
    /// √(xᵀ M x) and its standard deviation for M = `square`; `None` where a part of it does not show.
    fn root_mean_square(&self, square: &DMatrix<f64>) -> Option<[f64; 2]> {
        let (seen, all) = ((&self.projector * square).trace(), square.trace());
        if seen < MOSTLY * all {
            return None;
        }
        let gradient = square * &self.value;
        let size = self.value.dot(&gradient).max(0.0).sqrt();
        // If nothing has moved it is as certain as on average.
        let variance = if size > 0.0 {
            gradient.dot(&(&self.covariance * &gradient)) / (size * size)
        } else {
            (&self.covariance * square).trace()
        };
        Some([size, variance.max(0.0).sqrt()])
    }
}

/// Certainty of the scatter behind a statistic.
#[derive(Clone, Copy, Debug)]
pub struct Confidence {
    /// Degrees of freedom of the noise level of the features.
    pub noise_freedom: f64,
    /// Pieces that taught the scatter of the part.
    pub taught_by: usize,
    /// Variance of single pieces relative to their evidence.
    pub dispersion: f64,
    /// Pieces in the window.
    pub pieces: usize,
}

impl Change {
    /// The most likely change of a kind by evidence about its columns, in units. `within` is that part of it which does not
    /// depend on where the seams lie.
    #[must_use]
    pub fn of(kind: Kind, evidence: &Quadratic, within: Option<&Quadratic>, known: Confidence) -> Self {
        let eigen = evidence.matrix.clone().symmetric_eigen();
        let least = VISIBLE * known.pieces as f64;
        let shown: Vec<usize> = (0..evidence.size()).filter(|k| eigen.eigenvalues[*k] > least).collect();
        let (mut explained, mut share_within) = (0.0, 0.0);
        let mut value = DVector::zeros(evidence.size());
        let mut covariance = DMatrix::zeros(evidence.size(), evidence.size());
        let mut projector = DMatrix::zeros(evidence.size(), evidence.size());
        for &k in &shown {
            let (direction, information) = (eigen.eigenvectors.column(k), eigen.eigenvalues[k]);
            let score = direction.dot(&evidence.vector);
            explained += score * score / information;
            value += direction * (score / information);
            covariance += direction * direction.transpose() / information;
            projector += direction * direction.transpose();
            share_within += within.map_or(0.0, |w| direction.dot(&(&w.matrix * direction)) / information);
        }
        explained /= known.dispersion;
        let dimensions = shown.len();
        let learnt = 1.0 - (share_within / dimensions.max(1) as f64).clamp(0.0, 1.0);
        let freedom = freedom(known, learnt, dimensions);
        let units = &UNITS[kind.columns()];
        let shown = Shown { value, covariance: covariance * known.dispersion, projector };
        let of_column =
            |k: usize| shown.combination(&DVector::from_fn(units.len(), |i, _| f64::from(i == k) * units[i]));
        let columns: Vec<Option<[f64; 2]>> = (0..units.len()).map(of_column).collect();
        Self {
            kind,
            value: columns.iter().map(|column| column.map(|[value, _]| value)).collect(),
            sigma: columns.iter().map(|column| column.map(|[_, sigma]| sigma)).collect(),
            explained,
            dimensions,
            p_log10: log10_probability(explained, dimensions, freedom),
            shown,
        }
    }

    /// This change with its significance, and the amount of another estimate of it.
    #[must_use]
    pub(crate) fn with_amount_of(&self, other: Self) -> Self {
        Self { explained: self.explained, dimensions: self.dimensions, p_log10: self.p_log10, ..other }
    }

    /// A sum of the kind's columns with these weights (SI) and its standard deviation; `None` where these welds do not show it.
    #[must_use]
    pub fn combination(&self, weights: &[f64]) -> Option<[f64; 2]> {
        let units = &UNITS[self.kind.columns()];
        self.shown
            .combination(&DVector::from_iterator(units.len(), weights.iter().zip(units).map(|(w, u)| w * u)))
    }
}

impl Change {
    /// √(xᵀ M x) of the kind's columns x (SI) for M = `square`, and its standard deviation; `None` where these welds do not show it.
    #[must_use]
    pub(crate) fn root_mean_square(&self, square: &DMatrix<f64>) -> Option<[f64; 2]> {
        let units = &UNITS[self.kind.columns()];
        self.shown.root_mean_square(&DMatrix::from_fn(units.len(), units.len(), |i, j| {
            square[(i, j)] * units[i] * units[j]
        }))
    }
}

/// A direction visible by less than this part has no value of its own.
const MOSTLY: f64 = 0.99;

/// Degrees of freedom of a scatter that is partly noise and partly learnt. Of m pieces, m − d are left for d
/// dimensions (Hotelling). Precisions of variances add by the squares of their shares.
fn freedom(known: Confidence, learnt_share: f64, dimensions: usize) -> f64 {
    let learnt = known.taught_by as f64 - dimensions as f64;
    let noise_share = 1.0 - learnt_share;
    let inverse = noise_share.powi(2) / known.noise_freedom.max(1.0)
        + if learnt_share > 1e-6 { learnt_share.powi(2) / learnt.max(1.0) } else { 0.0 };
    inverse.recip()
}
