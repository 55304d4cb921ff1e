//! Curves of any form, as straight segments between points.

use nalgebra::Vector3;

/// A curve through points in their order.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    points: Vec<Vector3<f64>>,
}

/// Ends closer than this are one point, m.
const CLOSED_M: f64 = 1e-6;

/// Place on a polyline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnPolyline {
    /// The nearest point, m.
    pub point: Vector3<f64>,
    /// Whether it is one of the two ends, with the given point beyond it.
    pub beyond_end: bool,
}

impl Polyline {
    /// The curve through points (m). `None` for fewer than two, or if two neighbours coincide.
    #[must_use]
    pub fn new(points: Vec<Vector3<f64>>) -> Option<Self> {
        let apart = points.windows(2).all(|pair| (pair[1] - pair[0]).norm() > 0.0);
        (points.len() >= 2 && apart).then_some(Self { points })
    }

    /// Its points, m.
    #[must_use]
    pub fn points(&self) -> &[Vector3<f64>] {
        &self.points
    }

    /// Whether it is closed, to a micrometre: then it has no ends.
    #[must_use]
    pub(crate) fn is_closed(&self) -> bool {
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        self.points.len() > 2 && (last - first).norm() < CLOSED_M
    }

    /// The nearest point of the curve.
    #[must_use]
    pub fn nearest(&self, point: &Vector3<f64>) -> OnPolyline {
        let last = self.points.len() - 2;
        let open = !self.is_closed();
        let mut best = (f64::INFINITY, OnPolyline { point: self.points[0], beyond_end: true });
        for (k, pair) in self.points.windows(2).enumerate() {
            let piece = pair[1] - pair[0];
            let along = piece.dot(&(point - pair[0])) / piece.norm_squared();
            let nearest = pair[0] + piece * along.clamp(0.0, 1.0);
            let beyond_end = open && ((k == 0 && along < 0.0) || (k == last && along > 1.0));
            let distance = (point - nearest).norm();
            if distance < best.0 {
                best = (distance, OnPolyline { point: nearest, beyond_end });
            }
        }
        best.1
    }
}
