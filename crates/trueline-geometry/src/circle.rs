//! Circles in space.

use nalgebra::{UnitVector3, Vector3};

/// A circle: centre, axis and radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    centre: Vector3<f64>,
    axis: UnitVector3<f64>,
    radius: f64,
}

impl Circle {
    /// The circle about `centre` (m) perpendicular to `axis`. `None` unless the radius (m) is positive.
    #[must_use]
    pub fn new(centre: Vector3<f64>, axis: UnitVector3<f64>, radius: f64) -> Option<Self> {
        (radius > 0.0 && radius.is_finite()).then_some(Self { centre, axis, radius })
    }

    /// Centre, m.
    #[must_use]
    pub fn centre(&self) -> &Vector3<f64> {
        &self.centre
    }

    /// Unit axis.
    #[must_use]
    pub fn axis(&self) -> &UnitVector3<f64> {
        &self.axis
    }

    /// Radius, m.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The point of the circle nearest to a point. Any, for points on the axis.
    #[must_use]
    pub fn nearest(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let from_centre = point - self.centre;
        let in_plane = from_centre - self.axis.into_inner() * self.axis.dot(&from_centre);
        let outward = in_plane.try_normalize(1e-12).unwrap_or_else(|| any_across(&self.axis));
        self.centre + outward * self.radius
    }
}

/// A unit vector orthogonal to an axis.
fn any_across(axis: &UnitVector3<f64>) -> Vector3<f64> {
    let reference = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    axis.cross(&reference).normalize()
}
