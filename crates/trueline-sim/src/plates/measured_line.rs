//! A straight line as it was measured, with its errors, and where two of them cross.

use nalgebra::{Matrix2, Vector2};

/// A straight line through two points of it whose errors, square to it, are independent. Lengths are px or m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeasuredLine {
    /// The two points.
    pub points: [Vector2<f64>; 2],
    /// Standard deviation of each, square to the line.
    pub sigma: f64,
}

impl MeasuredLine {
    /// The line with the least squared distances from points in order, each with this noise in both coordinates; `None` of
    /// points that give none. Its own points are one standard deviation of the places to either side of their middle.
    pub(crate) fn through(points: &[Vector2<f64>], noise: f64) -> Option<Self> {
        let number = points.len() as f64;
        let (first, last) = (points.first()?, points.last()?);
        let middle = points.iter().sum::<Vector2<f64>>() / number;
        let moments: Matrix2<f64> =
            points.iter().map(|point| (point - middle) * (point - middle).transpose()).sum::<Matrix2<f64>>()
                / number;
        let angle = 0.5 * (2.0 * moments.m12).atan2(moments.m11 - moments.m22);
        let along = Vector2::new(angle.cos(), angle.sin());
        let along = if along.dot(&(last - first)) < 0.0 { -along } else { along };
        let spread = along.dot(&(moments * along)).sqrt();
        // Middle and slope have the variances noise²/n and noise²/(n spread²).
        (spread > 0.0).then(|| Self {
            points: [-1.0, 1.0].map(|side| middle + along * (side * spread)),
            sigma: noise * (2.0 / number).sqrt(),
        })
    }

    /// Unit vector square to the line.
    pub(crate) fn normal(&self) -> Vector2<f64> {
        let along = (self.points[1] - self.points[0]).normalize();
        Vector2::new(-along.y, along.x)
    }

    /// The line moved square to itself.
    pub(crate) fn displaced(self, distance: f64) -> Self {
        let shift = self.normal() * distance;
        Self { points: self.points.map(|point| point + shift), ..self }
    }

    /// Variance of the line, square to it, at a point of it.
    pub(crate) fn variance_at(&self, at: &Vector2<f64>) -> f64 {
        let [a, b] = self.points;
        let part = (at - a).dot(&(b - a)) / (b - a).norm_squared();
        ((1.0 - part).powi(2) + part.powi(2)) * self.sigma.powi(2)
    }

    /// Where it crosses another line, to first order of both errors; `None` of parallel lines.
    pub(crate) fn crossing(&self, other: &Self) -> Option<Crossing> {
        let normals = [self.normal(), other.normal()];
        let inverse = Matrix2::from_rows(&normals.map(|n| n.transpose())).try_inverse()?;
        let at = inverse * Vector2::new(normals[0].dot(&self.points[0]), normals[1].dot(&other.points[0]));
        let variances = Matrix2::from_diagonal(&Vector2::new(self.variance_at(&at), other.variance_at(&at)));
        Some(Crossing { at, covariance: inverse * variances * inverse.transpose() })
    }
}

/// A seam point, with its covariance, in px or m.
pub(crate) struct Crossing {
    /// The point.
    pub at: Vector2<f64>,
    /// Its covariance.
    pub covariance: Matrix2<f64>,
}
