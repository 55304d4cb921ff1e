//! A straight line in a profile.

use crate::fastest::fastest;
use nalgebra::{Matrix2, Vector2};

/// Two faces that differ in direction by less (sine) are one, or the plates of a lap joint: 10°.
pub(super) const LEAST_ANGLE_SINE: f64 = 0.17;

/// The points p with n · p = d, of a unit normal n.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StraightLine {
    normal: Vector2<f64>,
    distance_mm: f64,
}

impl StraightLine {
    /// The line through a point, of a unit normal.
    pub(super) fn through(point: &Vector2<f64>, normal: Vector2<f64>) -> Self {
        Self { normal, distance_mm: normal.dot(point) }
    }

    /// Distance of a point from the line, signed.
    pub(super) fn off(&self, point: &Vector2<f64>) -> f64 {
        self.normal.dot(point) - self.distance_mm
    }

    /// Its crossing with another one, unless they are nearly parallel.
    pub(super) fn meets(&self, other: &Self) -> Option<Vector2<f64>> {
        let matrix = Matrix2::from_rows(&[self.normal.transpose(), other.normal.transpose()]);
        if matrix.determinant().abs() < LEAST_ANGLE_SINE {
            return None;
        }
        Some(matrix.try_inverse()? * Vector2::new(self.distance_mm, other.distance_mm))
    }

    /// The squares of how far points are off it, mm², each counted up to that of a limit.
    pub(super) fn squares_up_to(&self, points: &[Vector2<f64>], limit_mm: f64) -> f64 {
        fastest!(limited_squares(
            points,
            [self.normal.x, self.normal.y, self.distance_mm],
            limit_mm * limit_mm
        ))
    }
}

/// Sums in lanes, which one instruction adds at once.
#[inline(always)]
fn limited_squares(points: &[Vector2<f64>], [nx, ny, distance]: [f64; 3], most: f64) -> f64 {
    const LANES: usize = 8;
    let square = |point: &Vector2<f64>| {
        let off = nx * point.x + ny * point.y - distance;
        (off * off).min(most)
    };
    let mut lanes = [0.0_f64; LANES];
    let chunks = points.chunks_exact(LANES);
    let rest = chunks.remainder();
    for chunk in chunks {
        for (lane, point) in lanes.iter_mut().zip(chunk) {
            *lane += square(point);
        }
    }
    lanes.iter().sum::<f64>() + rest.iter().map(square).sum::<f64>()
}
