//! Planes in space by unit normal and offset.

use nalgebra::{Unit, UnitVector3, Vector3};

/// The plane of all points p with n·p = d, |n| = 1, d ≥ 0.
///
/// Unlike z = a x + b y + c it can represent a plane that contains the z direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    normal: UnitVector3<f64>,
    offset: f64,
}

impl Plane {
    /// Builds the plane n·p = offset (m). The normal may have any nonzero length. If the offset is negative both signs are flipped, which gives the
    /// same plane.
    ///
    /// Returns `None` if the normal is zero or anything is not finite.
    #[must_use]
    pub fn new(normal: Vector3<f64>, offset: f64) -> Option<Self> {
        let length = normal.norm();
        if !(length > 0.0 && length.is_finite() && offset.is_finite()) {
            return None;
        }
        let sign = if offset < 0.0 { -1.0 } else { 1.0 };
        Some(Self { normal: Unit::new_unchecked(normal * (sign / length)), offset: offset * sign / length })
    }

    /// Builds the plane z = a x + b y + c, the form of the paper and of many sensor makers.
    #[must_use]
    pub fn from_height(a: f64, b: f64, c: f64) -> Option<Self> {
        Self::new(Vector3::new(-a, -b, 1.0), c)
    }

    /// Unit normal n; it points from the origin towards the plane.
    #[must_use]
    pub fn normal(&self) -> &UnitVector3<f64> {
        &self.normal
    }

    /// Distance d of the plane from the origin, m.
    #[must_use]
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Signed distance of a point from the plane, m. Positive on the side of the normal.
    #[must_use]
    pub fn signed_distance(&self, point: &Vector3<f64>) -> f64 {
        self.normal.dot(point) - self.offset
    }
}
