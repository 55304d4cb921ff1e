//! Closed-form fits of lines and planes to points, and their robust forms.

use crate::{Line, Plane};
use nalgebra::{Matrix3, SymmetricEigen, UnitVector3, Vector3};

/// Mean and principal axes of weighted points: columns of `axes` by falling spread.
struct PrincipalAxes {
    mean: Vector3<f64>,
    axes: [Vector3<f64>; 3],
    spread: [f64; 3],
}

fn principal_axes(points: &[Vector3<f64>], weights: &[f64]) -> Option<PrincipalAxes> {
    let total: f64 = weights.iter().sum();
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let mean = points.iter().zip(weights).map(|(p, w)| p * *w).sum::<Vector3<f64>>() / total;
    let mut scatter = Matrix3::zeros();
    for (point, weight) in points.iter().zip(weights) {
        let d = point - mean;
        scatter += d * d.transpose() * *weight;
    }
    let eigen = SymmetricEigen::try_new(scatter / total, f64::EPSILON, 1000)?;
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    Some(PrincipalAxes {
        mean,
        axes: order.map(|k| eigen.eigenvectors.column(k).into_owned()),
        spread: order.map(|k| eigen.eigenvalues[k].max(0.0).sqrt()),
    })
}

/// Orthogonal least-squares line: through the mean, along the largest spread.
///
/// Returns `None` for fewer than two different points.
#[must_use]
pub fn line(points: &[Vector3<f64>]) -> Option<Line> {
    weighted_line(points, &vec![1.0; points.len()])
}

/// Orthogonal least-squares line with a weight for each point.
#[must_use]
pub fn weighted_line(points: &[Vector3<f64>], weights: &[f64]) -> Option<Line> {
    let fit = principal_axes(points, weights)?;
    (fit.spread[0] > 0.0).then(|| Line::new(fit.mean, &UnitVector3::new_normalize(fit.axes[0])))
}

/// Line through points of which up to about half may be wild: principal axes, re-weighted by
/// Geman–McClure with the median distance as scale.
#[must_use]
pub fn robust_line(points: &[Vector3<f64>]) -> Option<Line> {
    let mut fitted = line(points)?;
    let mut squared: Vec<f64> = Vec::with_capacity(points.len());
    for _ in 0..10 {
        squared.clear();
        squared.extend(points.iter().map(|p| fitted.distance(p).powi(2)));
        let mut sorted = squared.clone();
        sorted.sort_by(f64::total_cmp);
        let scale2 = sorted[sorted.len() / 2];
        if scale2 <= f64::MIN_POSITIVE {
            break;
        }
        let weights: Vec<f64> = squared.iter().map(|d2| (1.0 + d2 / scale2).powi(-2)).collect();
        fitted = weighted_line(points, &weights)?;
    }
    Some(fitted)
}

/// A fitted plane and how well the points lie in it.
#[derive(Clone, Copy, Debug)]
pub struct PlaneFit {
    /// The plane.
    pub plane: Plane,
    /// Root mean square distance of the points from the plane, m.
    pub rms: f64,
    /// Smallest spread of the points inside the plane, m; near zero the points lie on one line and
    /// the plane is not defined.
    pub extent: f64,
}

/// Orthogonal least-squares plane.
///
/// Returns `None` for fewer than three points or points that all coincide.
#[must_use]
pub fn plane(points: &[Vector3<f64>]) -> Option<PlaneFit> {
    if points.len() < 3 {
        return None;
    }
    let fit = principal_axes(points, &vec![1.0; points.len()])?;
    let plane = Plane::new(fit.axes[2], fit.axes[2].dot(&fit.mean))?;
    Some(PlaneFit { plane, rms: fit.spread[2], extent: fit.spread[1] })
}

/// Plane through points of which some are wild: the orthogonal fit, repeated without the points
/// further away than five times the median distance (never more than half of them).
#[must_use]
pub fn robust_plane(points: &[Vector3<f64>]) -> Option<PlaneFit> {
    let mut fit = plane(points)?;
    for _ in 0..20 {
        let mut distances: Vec<f64> = points.iter().map(|p| fit.plane.signed_distance(p).abs()).collect();
        distances.sort_by(f64::total_cmp);
        let limit = 5.0 * distances[distances.len() / 2].max(1e-12);
        let near: Vec<_> =
            points.iter().filter(|p| fit.plane.signed_distance(p).abs() <= limit).copied().collect();
        let next = plane(&near)?;
        let settled = (next.rms - fit.rms).abs() <= 1e-12 * fit.rms;
        fit = next;
        if settled {
            break;
        }
    }
    Some(fit)
}
