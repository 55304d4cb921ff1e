//! A rounded edge; the detector finds its outermost point. The seam seems nearer by the radius, from any view.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use nalgebra::Vector3;

/// The edge; its line is the axis of the rounding.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoundedEdge {
    radius_m: f64,
}

impl RoundedEdge {
    pub(crate) fn of(errors: &DrawnErrors) -> Option<Self> {
        Some(Self { radius_m: errors.size(ShopError::RoundedEdge)? })
    }

    /// Displacement of the outermost point from the axis, m in base: the radius towards the sensor, perpendicular to
    /// the seam.
    pub(crate) fn shift(&self, seam_to_sensor: &Vector3<f64>, along: &Vector3<f64>) -> Vector3<f64> {
        let across = seam_to_sensor - along * along.dot(seam_to_sensor);
        across.normalize() * self.radius_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_point_moves_by_the_radius_towards_the_view() {
        let edge = RoundedEdge { radius_m: 2e-4 };
        // Seen from 45° and from further along the seam: only the view across the seam counts.
        let shift = edge.shift(&Vector3::new(0.3, 0.1, 0.1), &Vector3::x());
        assert!((shift - Vector3::new(0.0, 1.0, 1.0).normalize() * 2e-4).norm() < 1e-18);
    }
}
