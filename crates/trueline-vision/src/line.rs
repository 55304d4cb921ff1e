//! A straight line in the ideal picture.

use nalgebra::Vector2;

/// A line in ideal pixels: a point on it and its unit direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line2 {
    /// A point on the line, px.
    pub point: Vector2<f64>,
    /// Unit vector along it.
    pub along: Vector2<f64>,
}

impl Line2 {
    /// Unit normal: the direction turned by a quarter from x to y.
    #[must_use]
    pub fn normal(&self) -> Vector2<f64> {
        Vector2::new(-self.along.y, self.along.x)
    }

    /// The point at a distance along it, px.
    #[must_use]
    pub fn at(&self, s: f64) -> Vector2<f64> {
        self.point + self.along * s
    }

    /// Distance along it of a point's foot, px.
    #[must_use]
    pub fn station(&self, point: &Vector2<f64>) -> f64 {
        self.along.dot(&(point - self.point))
    }

    /// Signed distance of a point, px; positive on the side of the normal.
    #[must_use]
    pub fn distance(&self, point: &Vector2<f64>) -> f64 {
        self.normal().dot(&(point - self.point))
    }

    /// The line moved by `shift` px along its normal at its point and turned by `slope` (px per px).
    #[must_use]
    pub fn moved(&self, shift: f64, slope: f64) -> Self {
        let normal = self.normal();
        Self { point: self.point + normal * shift, along: (self.along + normal * slope).normalize() }
    }

    /// Crossing of two lines; `None` if they are parallel to within 1e-6 rad.
    #[must_use]
    pub fn cross(&self, other: &Self) -> Option<Vector2<f64>> {
        let sine = self.along.perp(&other.along);
        (sine.abs() > 1e-6).then(|| self.at((other.point - self.point).perp(&other.along) / sine))
    }
}
