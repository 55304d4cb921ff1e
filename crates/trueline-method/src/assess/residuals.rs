//! Residual of every feature, and their summary.

use crate::config::ResidualKind;
use crate::input::observations::Observations;
use crate::input::skip::Skip;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use crate::problem::placement::placement;
use nalgebra::{Vector2, Vector3};
use std::collections::BTreeMap;

/// Squared whitened residual (two components) that inliers exceed four times in a million: 5 σ.
pub const OUTLIER_SQUARED: f64 = 25.0;

/// The residual of one feature at the solution.
#[derive(Clone, Copy, Debug)]
pub struct FeatureResidual {
    /// Row of the feature in the recording, from 0.
    pub row: u32,
    /// Its line.
    pub line: u32,
    /// Stamp of its image since the start, as used in the fit, s.
    pub stamp_s: f64,
    /// The point in base, m.
    pub point_in_base: Vector3<f64>,
    /// Offset from the line in base along its two cross axes, m.
    pub offset_m: Vector2<f64>,
    /// Measured minus predicted, px: the residual in standard deviations of the feature alone, times the feature's sigma.
    pub residual_px: Option<Vector2<f64>>,
    /// Measured minus predicted in the laser sheet along its two axes, m.
    pub in_sheet_m: Option<Vector2<f64>>,
    /// Velocity of the seam across the sheet, along its two axes, m/s: the factor of a time offset error.
    pub crossing_m_s: Option<Vector2<f64>>,
    /// The whitened residual. Both components are standard normal if the model holds.
    pub whitened: Vector2<f64>,
    /// Its length, σ.
    pub normalised: f64,
    /// Weight of the robust loss, 0 to 1.
    pub weight: f64,
}

impl FeatureResidual {
    /// Whether an inlier would hardly ever be this far off.
    #[must_use]
    pub fn is_outlier(&self) -> bool {
        self.normalised.powi(2) > OUTLIER_SQUARED
    }
}

/// Residuals of all usable features, and the others by reason.
#[must_use]
pub fn evaluate(problem: &LineProblem<'_>, at: &Parameters) -> (Vec<FeatureResidual>, BTreeMap<Skip, usize>) {
    let observations = problem.observations;
    let mut skipped = observations.skipped.clone();
    let mut list = Vec::with_capacity(problem.list.len());
    let mut selected = problem.selected().peekable();
    for o in &observations.list {
        let Some((_, whitener)) = selected.next_if(|(s, _)| s.row == o.row) else {
            let reason = why_not_placed(observations, o.stamp_s - at.time_offset_s);
            *skipped.entry(reason).or_insert(0) += 1;
            continue;
        };
        let seen = placement(observations, o, at).and_then(|placement| {
            let point = at.corrected(&observations.sheet, &o.point_in_camera);
            let point_in_base = placement.point_in_base(&point);
            let offset_m = at.offset_from_seam(o.line as usize, &point_in_base);
            let in_sheet = problem.in_sheet(o, at, &placement);
            let residual = match problem.residual {
                ResidualKind::Sheet => in_sheet?.residual,
                ResidualKind::PointToLine => offset_m,
            };
            Some((point_in_base, offset_m, in_sheet, residual))
        });
        let Some((point_in_base, offset_m, in_sheet, residual)) = seen else {
            *skipped.entry(Skip::AlongPlane).or_insert(0) += 1;
            continue;
        };
        let whitened = whitener.apply(&residual);
        let squared = whitened.norm_squared();
        let in_sheet_m = in_sheet.map(|seen| seen.residual);
        let to_px = || Some(o.sheet_per_px().try_inverse()? * in_sheet_m?);
        list.push(FeatureResidual {
            row: o.row,
            line: o.line,
            stamp_s: o.stamp_s,
            point_in_base,
            offset_m,
            residual_px: observations.are_pixels.then(to_px).flatten(),
            in_sheet_m,
            crossing_m_s: in_sheet.map(|seen| seen.d_time_offset),
            whitened,
            normalised: squared.sqrt(),
            weight: problem.loss.weight(squared),
        });
    }
    (list, skipped)
}

pub(crate) fn why_not_placed(observations: &Observations, exposure_s: f64) -> Skip {
    let (start, end) = observations.robot.trajectory.span();
    if exposure_s < start || exposure_s > end { Skip::Outside } else { Skip::Gap }
}

/// Weight below which a feature does not affect the estimate.
const LEAST_WEIGHT: f64 = 1e-2;

/// Summary over the features. RMS values use those with weight in the estimate.
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualSummary {
    /// RMS length of the residual in the image, px.
    pub rms_px: Option<f64>,
    /// RMS distance from the line in base, m.
    pub rms_m: f64,
    /// Features within the noise limit.
    pub inliers: usize,
    /// Features beyond it.
    pub outliers: usize,
    /// Features evaluated: inliers and outliers.
    pub used: usize,
    /// Features not evaluated, by reason.
    pub skipped: BTreeMap<Skip, usize>,
}

impl ResidualSummary {
    /// Fraction of inliers among the evaluated features.
    #[must_use]
    pub(crate) fn inlier_share(&self) -> f64 {
        self.inliers as f64 / self.used.max(1) as f64
    }
}

/// Summarises residuals.
#[must_use]
pub(crate) fn summarise(list: &[FeatureResidual], skipped: BTreeMap<Skip, usize>) -> ResidualSummary {
    let inliers = list.iter().filter(|r| !r.is_outlier()).count();
    let carrying = || list.iter().filter(|r| r.weight > LEAST_WEIGHT);
    let count = carrying().count();
    let root_mean = |sum: f64| (sum / count.max(1) as f64).sqrt();
    let px: Option<f64> = carrying().map(|r| r.residual_px.map(|p| p.norm_squared())).sum();
    ResidualSummary {
        rms_px: px.filter(|_| count > 0).map(root_mean),
        rms_m: root_mean(carrying().map(|r| r.offset_m.norm_squared()).sum()),
        inliers,
        outliers: list.len() - inliers,
        used: list.len(),
        skipped,
    }
}
