//! The straight line through a piece of stripe, as even columns give it: all that a sensor's own software fits.

use nalgebra::{Vector2, Vector3};

/// A least-squares line in ideal pixels.
pub(super) struct StraightLine {
    /// Unit direction of the chord.
    along: Vector2<f64>,
    /// Length of the chord, px.
    pub length_px: f64,
    /// Two points of the line with independent errors perpendicular to it: one standard deviation of the columns to either
    /// side of their middle.
    pub supports: [Vector2<f64>; 2],
}

impl StraightLine {
    /// Through places in order, each an ideal pixel and its point; `None` of fewer than two.
    pub(super) fn through(places: &[(Vector2<f64>, Vector3<f64>)]) -> Option<Self> {
        let (first, last) = (places.first()?.0, places.last()?.0);
        let length_px = (last - first).norm();
        let along = (last - first).try_normalize(1e-9)?;
        let normal = Vector2::new(-along.y, along.x);
        // Columns are even: a place represents half of the way to its neighbours.
        let share = |k: usize| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(places.len() - 1));
            0.5 * (places[after].0 - places[before].0).norm() / length_px
        };
        let numbers: Vec<[f64; 3]> = (0..places.len())
            .map(|k| [share(k), along.dot(&(places[k].0 - first)), normal.dot(&(places[k].0 - first))])
            .collect();
        let mean = |of: &dyn Fn(&[f64; 3]) -> f64| numbers.iter().map(|n| n[0] * of(n)).sum::<f64>();
        let (middle, height) = (mean(&|n| n[1]), mean(&|n| n[2]));
        let spread = mean(&|n| (n[1] - middle).powi(2));
        let slope = mean(&|n| (n[1] - middle) * (n[2] - height)) / spread;
        let supports = [-1.0, 1.0].map(|side| {
            let s = middle + side * spread.sqrt();
            first + along * s + normal * (height + slope * (s - middle))
        });
        Some(Self { along, length_px, supports })
    }

    /// Unit vector square to the chord.
    pub(super) fn normal(&self) -> Vector2<f64> {
        Vector2::new(-self.along.y, self.along.x)
    }
}
