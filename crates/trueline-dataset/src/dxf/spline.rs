//! A spline of a drawing: any degree, knots and weights.

use nalgebra::Vector3;

/// Points of each piece between two knots.
const PER_PIECE: usize = 32;
/// No program draws a higher degree.
const MOST_DEGREE: f64 = 15.0;

/// The spline, by de Boor's algorithm on points with their weights.
pub(super) struct Nurbs {
    degree: usize,
    knots: Vec<f64>,
    control: Vec<Vector3<f64>>,
    weights: Vec<f64>,
}

impl Nurbs {
    /// `None` where its parts do not go together.
    pub(super) fn new(
        degree: f64,
        knots: Vec<f64>,
        control: Vec<Vector3<f64>>,
        mut weights: Vec<f64>,
    ) -> Option<Self> {
        if !(1.0..=MOST_DEGREE).contains(&degree) || degree.fract() != 0.0 {
            return None;
        }
        if weights.is_empty() {
            weights = vec![1.0; control.len()];
        }
        let degree = degree as usize;
        let is_whole = control.len() > degree
            && knots.len() == control.len() + degree + 1
            && weights.len() == control.len()
            && weights.iter().all(|weight| *weight > 0.0)
            && knots.windows(2).all(|pair| pair[0] <= pair[1])
            && knots[degree] < knots[control.len()];
        is_whole.then_some(Self { degree, knots, control, weights })
    }

    /// Points along it.
    pub(super) fn points(&self) -> Vec<Vector3<f64>> {
        let mut points = Vec::new();
        let last = self.control.len();
        for piece in self.degree..last {
            let (from, to) = (self.knots[piece], self.knots[piece + 1]);
            if to > from {
                let at = |k: usize| self.at(piece, from + (to - from) * k as f64 / PER_PIECE as f64);
                points.extend((0..PER_PIECE).map(at));
            }
        }
        // The end belongs to the last piece that has a length.
        let end = (self.degree..last).rev().find(|piece| self.knots[piece + 1] > self.knots[*piece]);
        points.extend(end.map(|piece| self.at(piece, self.knots[piece + 1])));
        points
    }

    fn at(&self, piece: usize, u: f64) -> Vector3<f64> {
        let first = piece - self.degree;
        let own = |k: usize| (self.control[first + k] * self.weights[first + k], self.weights[first + k]);
        let mut points: Vec<(Vector3<f64>, f64)> = (0..=self.degree).map(own).collect();
        for round in 1..=self.degree {
            for k in (round..=self.degree).rev() {
                let (low, high) = (self.knots[first + k], self.knots[first + k + self.degree + 1 - round]);
                let part = if high > low { (u - low) / (high - low) } else { 0.0 };
                points[k] = (
                    points[k - 1].0 * (1.0 - part) + points[k].0 * part,
                    points[k - 1].1 * (1.0 - part) + points[k].1 * part,
                );
            }
        }
        let (point, weight) = points[self.degree];
        point / weight
    }
}
