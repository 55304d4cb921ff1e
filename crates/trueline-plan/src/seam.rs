//! The seam that is to be scanned.

use nalgebra::{UnitVector3, Vector3};
use trueline_geometry::Line;

/// A stretch of straight seam in base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// Start of the scan, m.
    pub from_m: Vector3<f64>,
    /// Its end, m.
    pub to_m: Vector3<f64>,
}

impl Seam {
    /// Unit direction; `None` if both ends are one point.
    #[must_use]
    pub fn direction(&self) -> Option<UnitVector3<f64>> {
        UnitVector3::try_new(self.to_m - self.from_m, 1e-6)
    }

    /// The whole line, anchored in the middle.
    #[must_use]
    pub fn line(&self) -> Option<Line> {
        Some(Line::new(0.5 * (self.from_m + self.to_m), &self.direction()?))
    }

    /// Its length, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        (self.to_m - self.from_m).norm()
    }
}
