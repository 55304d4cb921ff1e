//! The sufficient statistic of a weld: all that the detector ever needs of it, a few kilobytes.

use crate::parameters::CALIBRATION;
use crate::quadratic::Quadratic;
use trueline_geometry::Pose;

/// Evidence of one weld about the calibration and its own seams.
#[derive(Clone, Debug, PartialEq)]
pub struct WeldStatistic {
    /// Evidence about θ (SI) and, for each seam, its (θ₂, θ₃, δ₂, δ₃) from the part's; bows marginalised.
    pub evidence: Quadratic,
    /// Features that count.
    pub used: usize,
    /// Features that belong to no seam.
    pub outliers: usize,
    /// Noise factor: residuals divided by the expected noise.
    pub noise_factor: f64,
    /// Correlation of neighbouring residuals, which reduces the information if it is positive.
    pub correlation: f64,
    /// Where the axes under the part had it, on average; `None` without such an axis.
    pub base_from_part: Option<Pose>,
}

impl WeldStatistic {
    /// Number of seams.
    #[must_use]
    pub fn seams(&self) -> usize {
        (self.evidence.size() - CALIBRATION) / 4
    }

    /// Numbers left over for the noise level.
    #[must_use]
    pub fn freedom(&self) -> f64 {
        (2.0 * self.used as f64 - (CALIBRATION + 6 * self.seams()) as f64).max(1.0)
    }
}
