//! Numbers over time as a cubic spline: twice continuously differentiable, so that its third derivative is bounded.

use nalgebra::SVector;

/// Value and derivatives at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jet<const N: usize> {
    /// Value.
    pub value: SVector<f64, N>,
    /// First derivative.
    pub first: SVector<f64, N>,
    /// Second derivative.
    pub second: SVector<f64, N>,
}

/// A cubic spline of `N` numbers with parabolas as outermost pieces: a path may begin and end during motion.
#[derive(Clone, Debug)]
pub(super) struct Spline<const N: usize> {
    times_s: Vec<f64>,
    values: Vec<SVector<f64, N>>,
    /// Second derivatives at the knots.
    bends: Vec<SVector<f64, N>>,
}

impl<const N: usize> Spline<N> {
    /// Through values at rising times; at least two.
    #[must_use]
    pub(super) fn through(times_s: Vec<f64>, values: Vec<SVector<f64, N>>) -> Self {
        let bends = bends(&times_s, &values);
        Self { times_s, values, bends }
    }

    /// Last time, s.
    #[must_use]
    pub(super) fn end_s(&self) -> f64 {
        *self.times_s.last().unwrap_or(&0.0)
    }

    /// Number of pieces.
    #[must_use]
    pub(super) fn pieces(&self) -> usize {
        self.times_s.len() - 1
    }

    /// Start of a piece and its length, s.
    #[must_use]
    pub(crate) fn piece_s(&self, piece: usize) -> (f64, f64) {
        (self.times_s[piece], self.times_s[piece + 1] - self.times_s[piece])
    }

    /// Value and derivatives; before the first time and after the last the outermost pieces go on.
    #[must_use]
    pub(super) fn at(&self, time_s: f64) -> Jet<N> {
        let after = self.times_s.partition_point(|t| *t <= time_s);
        self.in_piece(after.clamp(1, self.pieces()) - 1, time_s)
    }

    fn in_piece(&self, piece: usize, time_s: f64) -> Jet<N> {
        let (start_s, length_s) = self.piece_s(piece);
        let (from, to) = (self.values[piece], self.values[piece + 1]);
        let (bend_from, bend_to) = (self.bends[piece], self.bends[piece + 1]);
        let passed_s = time_s - start_s;
        let slope = (to - from) / length_s - (bend_from * 2.0 + bend_to) * (length_s / 6.0);
        let third = (bend_to - bend_from) / length_s;
        Jet {
            value: from + (slope + (bend_from / 2.0 + third * (passed_s / 6.0)) * passed_s) * passed_s,
            first: slope + (bend_from + third * (passed_s / 2.0)) * passed_s,
            second: bend_from + third * passed_s,
        }
    }

    /// Bounds of the norms of first, second and third derivative within a piece. The second derivative is linear and
    /// the third constant there, so theirs are exact. The first one leaves the chord of its ends by at most h²/8 of
    /// its own second derivative.
    #[must_use]
    pub(super) fn bounds(&self, piece: usize) -> [f64; 3] {
        let (start_s, length_s) = self.piece_s(piece);
        let ends = [self.in_piece(piece, start_s), self.in_piece(piece, start_s + length_s)];
        let third = (self.bends[piece + 1] - self.bends[piece]).norm() / length_s;
        let most = |of: fn(&Jet<N>) -> f64| ends.iter().map(of).fold(0.0, f64::max);
        [most(|j| j.first.norm()) + third * length_s * length_s / 8.0, most(|j| j.second.norm()), third]
    }
}

/// Second derivatives at the knots, those at the ends equal to their neighbours: a tridiagonal system, by elimination.
fn bends<const N: usize>(times_s: &[f64], values: &[SVector<f64, N>]) -> Vec<SVector<f64, N>> {
    let last = times_s.len() - 1;
    let mut bends = vec![SVector::zeros(); last + 1];
    if last < 2 {
        return bends;
    }
    let mut above = vec![0.0; last];
    for k in 1..last {
        let (before_s, after_s) = (times_s[k] - times_s[k - 1], times_s[k + 1] - times_s[k]);
        let change = (values[k + 1] - values[k]) / after_s - (values[k] - values[k - 1]) / before_s;
        let at_the_ends = if k == 1 { before_s } else { 0.0 } + if k == last - 1 { after_s } else { 0.0 };
        let pivot = 2.0 * (before_s + after_s) + at_the_ends - before_s * above[k - 1];
        above[k] = after_s / pivot;
        let known: SVector<f64, N> = bends[k - 1];
        bends[k] = (change * 6.0 - known * before_s) / pivot;
    }
    for k in (1..last - 1).rev() {
        let next = bends[k + 1];
        bends[k] -= next * above[k];
    }
    (bends[0], bends[last]) = (bends[1], bends[last - 1]);
    bends
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector1;

    #[test]
    fn parabolas_are_reproduced_and_derivatives_are_those_of_the_value() {
        let times: Vec<f64> = [0.0, 0.3, 0.4, 0.55, 1.0].to_vec();
        let through = |f: fn(f64) -> f64| {
            Spline::through(times.clone(), times.iter().map(|t| Vector1::new(f(*t))).collect())
        };
        let parabola = through(|t| 2.0 - t + 3.0 * t * t);
        let jet = parabola.at(0.37);
        assert!((jet.value[0] - 2.0407).abs() < 1e-14 && (jet.first[0] - 1.22).abs() < 1e-13);
        assert!((jet.second[0] - 6.0).abs() < 1e-12);
        let spline = through(|t| (5.0 * t).sin());
        let step = 1e-5;
        for k in 1..99 {
            let time = f64::from(k) * 0.01 + 0.0005;
            let (before, here, after) = (spline.at(time - step), spline.at(time), spline.at(time + step));
            // Differences of a cubic: error h²·|third|/6, third below 200 here.
            assert!(((after.value - before.value)[0] / (2.0 * step) - here.first[0]).abs() < 1e-8);
            assert!(((after.first - before.first)[0] / (2.0 * step) - here.second[0]).abs() < 1e-8);
        }
        for time in &times {
            assert!((spline.at(*time).value[0] - (5.0 * time).sin()).abs() < 1e-15);
        }
    }

    #[test]
    fn bounds_hold_within_every_piece() {
        let times: Vec<f64> = (0..40).map(|k| f64::from(k) * 0.1).collect();
        let values = times.iter().map(|t| Vector1::new((3.0 * t).sin() + 0.2 * (11.0 * t).cos())).collect();
        let spline = Spline::through(times, values);
        for piece in 0..spline.pieces() {
            let (start, length) = spline.piece_s(piece);
            let [first, second, _] = spline.bounds(piece);
            for k in 0..=20 {
                let jet = spline.at(start + length * f64::from(k) / 20.0 * 0.999_999);
                assert!(jet.first.norm() <= first + 1e-12 && jet.second.norm() <= second + 1e-9);
            }
        }
    }
}
