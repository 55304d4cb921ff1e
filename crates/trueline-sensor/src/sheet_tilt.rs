//! Small moves of a laser plane: its normal toward each axis of its sheet, and its offset.

use nalgebra::{SMatrix, Vector3};
use trueline_geometry::Plane;
use trueline_model::LaserSheet;

/// The plane with normal n + θ₁e₁ + θ₂e₂, brought to length one, and offset d + δ; `step` is (θ₁, θ₂, δ) in rad and m.
#[must_use]
pub fn moved(plane: &Plane, step: &Vector3<f64>) -> Plane {
    let axes = axes(plane);
    let normal = (plane.normal().into_inner() + axes * step.xy()).normalize();
    // A normal of length one and a finite offset are a plane.
    Plane::new(normal, plane.offset() + step.z).unwrap_or(*plane)
}

/// The axes e₁ and e₂ toward which the normal tilts, as columns.
#[must_use]
pub fn axes(plane: &Plane) -> SMatrix<f64, 3, 2> {
    *LaserSheet::from_plane(*plane).axes()
}
