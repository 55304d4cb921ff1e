//! Measures of a scan's quality.

use nalgebra::SMatrix;
use trueline_method::Requirement;
use trueline_method::problem::parameters::{LINES, ROTATION, TRANSLATION};

/// Covariance of time offset and hand-eye.
pub type SensorCovariance = SMatrix<f64, LINES, LINES>;

/// Converts a covariance to one number. Smaller is better, and 1 is the requirement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Criterion {
    /// The largest sigma in units of the required one: no unknown is neglected. The default: a calibration is as good
    /// as its least certain unknown.
    #[default]
    Worst,
    /// Root mean square of the sigmas in units of the required ones (A-optimal).
    Mean,
    /// Volume of the ellipsoid of confidence, as the side of a cube (D-optimal).
    Volume,
}

/// Requirements on the sigmas, and their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// One standard deviation each; `None` does not count.
    pub want: Requirement,
    /// How they become one number.
    pub criterion: Criterion,
}

impl Default for Goal {
    /// An accuracy that a good scan of some seconds reaches: 0.02 ms, 0.0078° and 0.012 mm are alike hard.
    fn default() -> Self {
        let want = Requirement {
            time_s: Some(0.02e-3),
            rotation_rad: Some(0.0078_f64.to_radians()),
            translation_m: Some(0.012e-3),
            ..Requirement::default()
        };
        Self { want, criterion: Criterion::Worst }
    }
}

/// See [`Goal::smooth_score`]: of seven equal sigmas it is 1.13 times the worst.
const SMOOTH_POWER: i32 = 16;

impl Goal {
    /// The required sigma of a component; `None` if it does not count.
    #[must_use]
    pub fn wanted(&self, component: usize) -> Option<f64> {
        match component {
            TRANSLATION.. => self.want.translation_m,
            ROTATION.. => self.want.rotation_rad,
            _ => self.want.time_s,
        }
    }

    /// The score of a covariance: at most 1 if all requirements are met (for [`Criterion::Worst`]).
    #[must_use]
    pub fn score(&self, covariance: &SensorCovariance) -> f64 {
        let counted: Vec<(usize, f64)> = (0..LINES).filter_map(|k| Some((k, self.wanted(k)?))).collect();
        let ratios = || counted.iter().map(|(k, wanted)| covariance[(*k, *k)].max(0.0).sqrt() / wanted);
        match self.criterion {
            Criterion::Worst => ratios().fold(0.0, f64::max),
            Criterion::Mean => (ratios().map(|r| r * r).sum::<f64>() / counted.len() as f64).sqrt(),
            Criterion::Volume => {
                let scaled = nalgebra::DMatrix::from_fn(counted.len(), counted.len(), |i, j| {
                    let ((a, wanted_a), (b, wanted_b)) = (counted[i], counted[j]);
                    covariance[(a, b)] / (wanted_a * wanted_b)
                });
                scaled.determinant().max(0.0).powf(0.5 / counted.len() as f64)
            }
        }
    }

    /// A score that a search can follow: of the worst sigma, which jumps from one to the next, a mean of a high power.
    #[must_use]
    pub(crate) fn smooth_score(&self, covariance: &SensorCovariance) -> f64 {
        if self.criterion != Criterion::Worst {
            return self.score(covariance);
        }
        let ratio = |k: usize| Some(covariance[(k, k)].max(0.0).sqrt() / self.wanted(k)?);
        let powers = (0..LINES).filter_map(ratio).map(|ratio| ratio.powi(SMOOTH_POWER));
        powers.sum::<f64>().powf(1.0 / f64::from(SMOOTH_POWER))
    }

    /// The largest ratio of a sigma to its requirement: at most 1 if all are met.
    #[must_use]
    pub(crate) fn missed_by(&self, covariance: &SensorCovariance) -> f64 {
        Self { criterion: Criterion::Worst, ..*self }.score(covariance)
    }
}
