//! A target: one plate of a joint, nearly flat.
//!
//! With c the middle of the scan on the seam, o the direction in the plate away from the seam and a the direction along
//! it, a point p lies on the plate where
//!
//! ```text
//! φ(p) = n·(p − c) − δ − f(r, s) = 0,  r = o·(p − c)/25 mm,  s = a·(p − c)/100 mm
//! f = β₁ r² + β₂ r s + β₃ s² + β₄ r³ + β₅ r² s + β₆ r s² + β₇ s³
//! ```
//!
//! n and δ are three unknowns, β seven more, known beforehand to be small. Each β is how far the plate is off at 25 mm
//! from the seam and 100 mm along it. The terms 1, r, s, missing in f, are n and δ.

use nalgebra::{SVector, Unit, UnitVector3, Vector3};
use trueline_geometry::so3;

/// Distance from the seam at which a surface term has its stated value, m.
pub const SURFACE_REACH_M: f64 = 0.025;
/// Distance along the seam to which they refer, m.
pub const SURFACE_LENGTH_M: f64 = 0.100;

/// 1 / [`SURFACE_REACH_M`], 1/m. A product takes a fifth of the time of a quotient.
const PER_REACH: f64 = 1.0 / SURFACE_REACH_M;
/// 1 / [`SURFACE_LENGTH_M`], 1/m.
const PER_LENGTH: f64 = 1.0 / SURFACE_LENGTH_M;

/// Origin of a plate's numbers; fixed during the estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlateChart {
    /// c, the middle of the scan on the seam, base, m.
    pub centre: Vector3<f64>,
    /// a, unit, along the seam.
    pub along: Vector3<f64>,
    /// o, unit, in the plate and perpendicular to the seam.
    pub outward: Vector3<f64>,
}

/// A plate in base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plate {
    /// Origin of its numbers.
    pub chart: PlateChart,
    /// n.
    pub normal: UnitVector3<f64>,
    /// δ, m.
    pub offset_m: f64,
    /// β₁ … β₇, m.
    pub surface_m: [f64; 7],
}

/// φ at a point, with its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct PlateDistance {
    /// φ, m.
    pub value: f64,
    /// ∂φ/∂p.
    pub d_point: Vector3<f64>,
    /// ∂φ/∂(θ_a, θ_o, δ): tilts about a and o (rad), offset (m).
    pub d_plate: Vector3<f64>,
    /// ∂φ/∂β.
    pub d_surface: SVector<f64, 7>,
}

impl Plate {
    /// Unknowns of the plane.
    pub const DIMENSION: usize = 3;
    /// Unknowns of its surface.
    pub const SURFACE: usize = 7;

    /// A flat plate through a point (m) of its seam. `None` if the seam does not run along it.
    #[must_use]
    pub fn flat(centre: Vector3<f64>, normal: &UnitVector3<f64>, along: &Vector3<f64>) -> Option<Self> {
        let along = (along - normal.as_ref() * normal.dot(along)).try_normalize(1e-6)?;
        let outward = along.cross(normal);
        let chart = PlateChart { centre, along, outward };
        Some(Self { chart, normal: *normal, offset_m: 0.0, surface_m: [0.0; 7] })
    }

    /// φ at a point in base, with its derivatives.
    #[must_use]
    pub fn distance(&self, point: &Vector3<f64>) -> PlateDistance {
        let (value, d_point) = self.height(point);
        let PlateChart { centre, along, outward } = &self.chart;
        let from = point - centre;
        let tilt = |axis: &Vector3<f64>| axis.cross(&self.normal).dot(&from);
        PlateDistance {
            value,
            d_point,
            d_plate: Vector3::new(tilt(along), tilt(outward), -1.0),
            d_surface: -surface_terms(outward.dot(&from) * PER_REACH, along.dot(&from) * PER_LENGTH),
        }
    }

    /// φ at a point in base, m, and ∂φ/∂p.
    #[must_use]
    #[inline]
    pub fn height(&self, point: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let PlateChart { centre, along, outward } = &self.chart;
        let from = point - centre;
        let (r, s) = (outward.dot(&from) * PER_REACH, along.dot(&from) * PER_LENGTH);
        let ([b1, b2, b3, b4, b5, b6, b7], rr, rs, ss) = (self.surface_m, r * r, r * s, s * s);
        let bow = (b1 + b4 * r + b5 * s) * rr + b2 * rs + (b3 + b6 * r + b7 * s) * ss;
        let by_r = 2.0 * b1 * r + b2 * s + 3.0 * b4 * rr + 2.0 * b5 * rs + b6 * ss;
        let by_s = b2 * r + 2.0 * b3 * s + b5 * rr + 2.0 * b6 * rs + 3.0 * b7 * ss;
        let value = self.normal.dot(&from) - self.offset_m - bow;
        let slope = outward * (by_r * PER_REACH) + along * (by_s * PER_LENGTH);
        (value, self.normal.as_ref() - slope)
    }

    /// Moves the plane by (θ_a, θ_o, δ) and the surface by β.
    #[must_use]
    pub fn retract(&self, step: &Vector3<f64>, surface: &SVector<f64, 7>) -> Self {
        let turn = so3::exp(&(self.chart.along * step.x + self.chart.outward * step.y));
        Self {
            normal: Unit::new_normalize(turn * self.normal.as_ref()),
            offset_m: self.offset_m + step.z,
            surface_m: std::array::from_fn(|k| self.surface_m[k] + surface[k]),
            ..*self
        }
    }

    /// Distance of the plane from the base's origin along its normal, m: n·p = this.
    #[must_use]
    pub fn offset_in_base_m(&self) -> f64 {
        self.normal.dot(&self.chart.centre) + self.offset_m
    }
}

/// The seven terms at (r, s).
#[must_use]
pub fn surface_terms(r: f64, s: f64) -> SVector<f64, 7> {
    SVector::from([r * r, r * s, s * s, r * r * r, r * r * s, r * s * s, s * s * s])
}
