//! Closed-form fits of lines and planes to points, and their robust forms.

use crate::statistics::median;
use crate::{Circle, Line, Plane};
use nalgebra::{Matrix3, SMatrix, SVector, SymmetricEigen, UnitVector3, Vector3};

/// Mean and principal axes of weighted points: columns of `axes` in order of decreasing spread.
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
/// Returns `None` for fewer than two distinct points.
#[must_use]
pub fn line(points: &[Vector3<f64>]) -> Option<Line> {
    weighted_line(points, &vec![1.0; points.len()])
}

/// Orthogonal least-squares line with a weight for each point.
#[must_use]
pub(crate) fn weighted_line(points: &[Vector3<f64>], weights: &[f64]) -> Option<Line> {
    let fit = principal_axes(points, weights)?;
    (fit.spread[0] > 0.0).then(|| Line::new(fit.mean, &UnitVector3::new_normalize(fit.axes[0])))
}

/// Line through points, up to about half of them outliers: principal axes, re-weighted by Geman–McClure with
/// the median distance as scale.
#[must_use]
pub fn robust_line(points: &[Vector3<f64>]) -> Option<Line> {
    let mut fitted = line(points)?;
    let mut squared: Vec<f64> = Vec::with_capacity(points.len());
    for _ in 0..10 {
        squared.clear();
        squared.extend(points.iter().map(|p| fitted.distance(p).powi(2)));
        let scale2 = median(squared.iter().copied())?;
        if scale2 <= f64::MIN_POSITIVE {
            break;
        }
        let weights: Vec<f64> = squared.iter().map(|d2| (1.0 + d2 / scale2).powi(-2)).collect();
        fitted = weighted_line(points, &weights)?;
    }
    Some(fitted)
}

/// A fitted plane with the residuals of the points.
#[derive(Clone, Copy, Debug)]
pub struct PlaneFit {
    /// The plane.
    pub plane: Plane,
    /// RMS distance of the points from the plane, m.
    pub rms: f64,
    /// Smallest spread of the points inside the plane, m. Near zero the points lie on one line and the plane is undefined.
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

/// Plane through points with outliers: the orthogonal fit, repeated without the points further away than five
/// times the median distance (never more than half of them).
#[must_use]
pub fn robust_plane(points: &[Vector3<f64>]) -> Option<PlaneFit> {
    let mut fit = plane(points)?;
    for _ in 0..20 {
        let usual = median(points.iter().map(|p| fit.plane.signed_distance(p).abs()))?;
        let limit = 5.0 * usual.max(1e-12);
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

/// Circle through points with outliers. The algebraic fit in the plane of the points comes first, then Gauss–Newton
/// on the distances in space, re-weighted by Geman–McClure with the median distance as scale.
///
/// Returns `None` for points on a straight line, or fewer than three.
#[must_use]
pub fn robust_circle(points: &[Vector3<f64>]) -> Option<Circle> {
    let mut circle = algebraic_circle(points)?;
    for _ in 0..50 {
        let squared: Vec<f64> = points.iter().map(|p| (p - circle.nearest(p)).norm_squared()).collect();
        let scale2 = median(squared.iter().copied())?.max(1e-30);
        let weights = squared.iter().map(|d2| (1.0 + d2 / scale2).powi(-2));
        let (next, moved) = improved(&circle, points.iter().zip(weights))?;
        circle = next;
        if moved < 1e-12 * circle.radius() {
            break;
        }
    }
    Some(circle)
}

/// The circle in the points' plane with the best fit of x² + y² = a x + b y + c \[Kasa1976\].
fn algebraic_circle(points: &[Vector3<f64>]) -> Option<Circle> {
    let fitted = robust_plane(points)?;
    let normal = *fitted.plane.normal();
    let reference = if normal.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let u = normal.cross(&reference).normalize();
    let v = normal.cross(&u);
    let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let (mut normal_matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for point in points {
        let d = point - mean;
        let row = Vector3::new(u.dot(&d), v.dot(&d), 1.0);
        normal_matrix += row * row.transpose();
        right += row * (row.x * row.x + row.y * row.y);
    }
    let solved = normal_matrix.cholesky()?.solve(&right);
    let (a, b) = (0.5 * solved.x, 0.5 * solved.y);
    let radius = (solved.z + a * a + b * b).sqrt();
    Circle::new(mean + u * a + v * b, normal, radius)
}

/// Two axes in a circle's plane.
fn plane_axes(circle: &Circle) -> [Vector3<f64>; 2] {
    let axis = circle.axis().into_inner();
    let reference = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let u = axis.cross(&reference).normalize();
    [u, axis.cross(&u)]
}

/// The circle moved by a step: shift of the centre along u, v and the axis (m), rotation of the axis towards u and v (rad), change of the radius
/// (m).
fn moved_circle(circle: &Circle, step: &SVector<f64, 6>) -> Option<Circle> {
    let (axis, [u, v]) = (circle.axis().into_inner(), plane_axes(circle));
    let centre = circle.centre() + u * step[0] + v * step[1] + axis * step[2];
    let turned = UnitVector3::new_normalize(axis + u * step[3] + v * step[4]);
    Circle::new(centre, turned, circle.radius() + step[5])
}

/// Distances of a point from the circle's cylinder and from its plane, m, each with its derivative by [`moved_circle`]'s step. `None` for a point on
/// the axis.
fn distances(circle: &Circle, point: &Vector3<f64>) -> Option<[(f64, SVector<f64, 6>); 2]> {
    let (axis, [u, v]) = (circle.axis().into_inner(), plane_axes(circle));
    let d = point - circle.centre();
    let height = axis.dot(&d);
    let in_plane = d - axis * height;
    let outward = in_plane.try_normalize(1e-12)?;
    let (along_u, along_v) = (outward.dot(&u), outward.dot(&v));
    Some([
        (
            in_plane.norm() - circle.radius(),
            SVector::from([-along_u, -along_v, 0.0, -height * along_u, -height * along_v, -1.0]),
        ),
        (height, SVector::from([0.0, 0.0, -1.0, u.dot(&d), v.dot(&d), 0.0])),
    ])
}

/// One Gauss–Newton step on both distances of each point. Returns the new circle and its motion, m.
fn improved<'a>(
    circle: &Circle,
    points: impl Iterator<Item = (&'a Vector3<f64>, f64)>,
) -> Option<(Circle, f64)> {
    let (mut hessian, mut gradient) = (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros());
    for (point, weight) in points {
        for (residual, row) in distances(circle, point)? {
            hessian += row * row.transpose() * weight;
            gradient += row * (residual * weight);
        }
    }
    let step = -hessian.cholesky()?.solve(&gradient);
    let moved =
        step.fixed_rows::<3>(0).norm() + step[5].abs() + circle.radius() * step.fixed_rows::<2>(3).norm();
    Some((moved_circle(circle, &step)?, moved))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn derivatives_of_the_distances_from_a_circle_are_their_differences() {
        let axis = UnitVector3::new_normalize(Vector3::new(0.2, -0.4, 0.9));
        let circle = Circle::new(Vector3::new(0.3, -0.2, 0.5), axis, 0.6).unwrap();
        let point = Vector3::new(0.9, 0.3, 0.8);
        let h = 1e-6;
        for k in 0..6 {
            let at = |step: f64| {
                let moved =
                    moved_circle(&circle, &SVector::from_fn(|row, _| if row == k { step } else { 0.0 }));
                distances(&moved.unwrap(), &point).unwrap().map(|(residual, _)| residual)
            };
            let (plus, minus) = (at(h), at(-h));
            for (which, (_, row)) in distances(&circle, &point).unwrap().into_iter().enumerate() {
                let numeric = (plus[which] - minus[which]) / (2.0 * h);
                // Central differences: h² of the third derivative, and 1e-16 over h.
                assert!(
                    (numeric - row[k]).abs() < 1e-9,
                    "distance {which}, unknown {k}: {numeric} {}",
                    row[k]
                );
            }
        }
    }
}
