//! The seams of one weld by the stored calibration: robust, straight except for a small bow.

use super::linearized::{BOW, LOCAL, Linearized, SEAM, Seam, linearized};
use super::weld_error::{LEAST_FEATURES, WeldError};
use nalgebra::{SMatrix, SVector, Vector2, Vector3, Vector4};
use trueline_geometry::{Line, fit};
use trueline_lsq::Loss;
use trueline_method::evaluate::placed_features::{PlacedFeature, PlacedFeatures};
use trueline_method::solve::noise_scale::noise_factor;
use trueline_model::Curvature;

/// A seam as fitted.
#[derive(Clone, Copy, Debug)]
pub struct SeamFit {
    /// The seam, anchored in the middle of the seen points.
    pub seam: Seam,
    /// Noise factor: residuals divided by the expected noise.
    pub noise_factor: f64,
}

/// Fits every seam of a weld with the calibration held.
///
/// # Errors
/// A seam with too few features, or of no line.
pub fn fitted_seams(of: &PlacedFeatures, shape_origin_m: [f64; 2]) -> Result<Vec<SeamFit>, WeldError> {
    let count = of.list.iter().map(|f| f.line + 1).max().unwrap_or(0);
    if count == 0 {
        return Err(WeldError::TooFewFeatures { line: 0, usable: 0, needed: LEAST_FEATURES });
    }
    (0..count).map(|line| fitted(of, line, shape_origin_m)).collect()
}

fn fitted(of: &PlacedFeatures, number: u32, shape_origin_m: [f64; 2]) -> Result<SeamFit, WeldError> {
    let (own, seam) = begun(of, number)?;
    let points: Vec<Vector3<f64>> = own.iter().map(|feature| in_base(feature)).collect();
    let off_m = third_off_m(&points, &seam.line);
    if off_m > CURVED_M {
        return Err(WeldError::Curved { line: number, off_m });
    }
    settled(of, (&own, number), seam, shape_origin_m)
}

/// Fits a piece of a curved seam: a parabola about its point nearest to `anchor` (base, m).
///
/// # Errors
/// As [`fitted_seams`].
pub(crate) fn fitted_piece(
    of: &PlacedFeatures,
    number: u32,
    anchor: &Vector3<f64>,
    shape_origin_m: [f64; 2],
) -> Result<SeamFit, WeldError> {
    let (own, seam) = begun(of, number)?;
    let curvature = Curvature { half_length_m: PIECE_M, ..seam.curvature };
    // A piece may be a half circle, so its bow is nearly free.
    let seam = Seam { line: seam.line.anchored_near(anchor), curvature, bow_sigma_m: PIECE_M };
    settled(of, (&own, number), seam, shape_origin_m)
}

/// Length at which the bow of a piece is stated, m: equal for all pieces, so that they compare from weld to weld.
const PIECE_M: f64 = 20e-3;

pub(crate) fn in_base(feature: &PlacedFeature) -> Vector3<f64> {
    feature.placement.point_in_base(&feature.point_in_camera)
}

/// The features of a seam and the line through them.
fn begun(of: &PlacedFeatures, number: u32) -> Result<(Vec<&PlacedFeature>, Seam), WeldError> {
    let own: Vec<&PlacedFeature> = of.list.iter().filter(|f| f.line == number).collect();
    if own.len() < LEAST_FEATURES {
        return Err(WeldError::TooFewFeatures { line: number, usable: own.len(), needed: LEAST_FEATURES });
    }
    let points: Vec<Vector3<f64>> = own.iter().map(|feature| in_base(feature)).collect();
    let seam = first(&points).ok_or(WeldError::NoLine { line: number })?;
    Ok((own, seam))
}

/// The optimum from a line.
fn settled(
    of: &PlacedFeatures,
    (own, number): (&[&PlacedFeature], u32),
    mut seam: Seam,
    shape_origin_m: [f64; 2],
) -> Result<SeamFit, WeldError> {
    let is_piece = seam.bow_sigma_m > seam.curvature.prior_sigma_m();
    let mut factor = f64::INFINITY;
    for _ in 0..ROUNDS {
        let all: Vec<Linearized> =
            own.iter().filter_map(|f| linearized(of, f, &seam, shape_origin_m)).collect();
        if all.len() < LEAST_FEATURES {
            return Err(WeldError::NoLine { line: number });
        }
        let step = step(&all, &seam, factor).ok_or(WeldError::NoLine { line: number })?;
        factor = noise_factor(&squared(&all, &step));
        seam.line = seam.line.retract(&Vector4::new(step[0], step[1], step[2], step[3]));
        if is_piece {
            // The small bow of a straight seam is linear; that of a piece turns its tangent.
            seam.curvature = seam.curvature.retract(&Vector2::new(step[4], step[5]));
        }
    }
    Ok(SeamFit { seam, noise_factor: factor })
}

/// A seam is curved if a third of its points are farther than this from a straight line, m. No change of a
/// working calibration moves points so far apart, and a seam that counts as straight bows by a fifth of it.
const CURVED_M: f64 = 5e-3;

/// A third of the points are farther from a line than this, m.
fn third_off_m(points: &[Vector3<f64>], line: &Line) -> f64 {
    let mut off_m: Vec<f64> = points.iter().map(|point| line.distance(point)).collect();
    off_m.sort_by(f64::total_cmp);
    off_m.get(2 * off_m.len() / 3).copied().unwrap_or(0.0)
}

/// Rounds of the fit. Each gains the ratio of the step to the distance from the sensor, a factor of a
/// hundred. The first ones find the outliers.
const ROUNDS: usize = 6;

/// The line through the points, in the order of their measurement.
fn first(points: &[Vector3<f64>]) -> Option<Seam> {
    let line = fit::robust_line(points)?;
    let along: Vec<f64> = points.iter().map(|p| line.direction().dot(&(p - line.anchor()))).collect();
    let mut sorted = along.clone();
    sorted.sort_by(f64::total_cmp);
    // The ends without the wildest two in a hundred.
    let end = |part: f64| sorted.get((part * (sorted.len() - 1) as f64) as usize).copied();
    let (low, high) = (end(0.02)?, end(0.98)?);
    let middle = line.anchor() + line.direction() * (0.5 * (low + high));
    let half = points.len() / 2;
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len().max(1) as f64;
    let forward = mean(&along[half..]) >= mean(&along[..half]);
    let line = if forward { line } else { line.reversed() };
    let half_length_m = 0.5 * (high - low);
    (half_length_m > 1e-6).then(|| Seam::straight(line.anchored_near(&middle), half_length_m))
}

type Own = SVector<f64, 6>;

/// The Gauss–Newton step of seam and bow; the bow is linear and keeps its origin.
fn step(all: &[Linearized], seam: &Seam, factor: f64) -> Option<Own> {
    let loss = Loss::Tukey { scale: 8.0 };
    let mut at = Own::zeros();
    for _ in 0..2 {
        let mut hessian = SMatrix::<f64, 6, 6>::zeros();
        let mut gradient = Own::zeros();
        for one in all {
            let whiten = one.total_covariance().cholesky()?.l().try_inverse()?;
            let jacobian = whiten * one.jacobian.fixed_columns::<{ LOCAL - SEAM }>(SEAM);
            let residual: Vector2<f64> = whiten * one.residual;
            let now = residual + jacobian * at;
            // While the noise level is unknown all points have equal weights: the first line was robust.
            let weight = if factor.is_finite() {
                loss.weight(now.norm_squared() / factor.powi(2).max(1e-12))
            } else {
                1.0 / (1.0 + now.norm_squared())
            };
            hessian += jacobian.transpose() * jacobian * weight;
            gradient += jacobian.transpose() * residual * weight;
        }
        let known = seam.bow_sigma_m.powi(-2);
        for (k, bow_m) in (BOW - SEAM..LOCAL - SEAM).zip(seam.curvature.bow_m) {
            hessian[(k, k)] += known;
            gradient[k] += known * bow_m;
        }
        at = -hessian.cholesky()?.solve(&gradient);
    }
    at.iter().all(|x| x.is_finite()).then_some(at)
}

fn squared(all: &[Linearized], step: &Own) -> Vec<f64> {
    let of = |one: &Linearized| {
        let whiten = one.total_covariance().cholesky()?.l().try_inverse()?;
        let jacobian = one.jacobian.fixed_columns::<{ LOCAL - SEAM }>(SEAM);
        Some((whiten * (one.residual + jacobian * step)).norm_squared())
    };
    all.iter().filter_map(of).collect()
}

/// A fitted seam in the chart of a part: the same line, anchored and turned relative to the part's as by [`Line::retract`].
#[must_use]
pub(crate) fn in_chart(seam: &Seam, of_part: &Line) -> (Seam, Vector4<f64>) {
    let step = crate::reference::line_step(of_part, &seam.line);
    (Seam { line: of_part.retract(&step), ..*seam }, step)
}
