//! A uniform cubic B-spline in base, open or closed.
//!
//! c(u) = Σ B_k(u) C_k with u ≈ arc length in m. On the segment j = ⌊u/h⌋ the four control points j … j + 3 have weights, in a
//! closed spline modulo their number. Several open curves are one spline in pieces. Between the control points a … b of a piece
//! and the next piece lie three segments, (b − 3) h < u < b h, without a curve.

use nalgebra::{DMatrix, Vector3, Vector4};
use std::ops::Range;

/// Least number of control points: in a closed curve each must differ from its three neighbours on either side.
pub(crate) const LEAST_CONTROL: usize = 8;

/// The spline.
#[derive(Clone, Debug)]
pub(crate) struct Spline {
    /// Control points, m.
    pub control: Vec<Vector3<f64>>,
    /// Spacing of the knots in u, m.
    pub spacing_m: f64,
    /// Whether the curve is closed.
    pub closed: bool,
    /// First control point of each piece except the first.
    pub breaks: Vec<usize>,
}

/// A place u on a spline: the first control point of its segment, and the four weights of value and slope.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Basis {
    /// Index of the first of the four.
    pub first: usize,
    /// Weights of the value.
    pub value: Vector4<f64>,
    /// Weights of the derivative with respect to u, 1/m.
    pub slope: Vector4<f64>,
}

impl Spline {
    /// Number of segments of a length, m, with knots of about a spacing, m.
    #[must_use]
    pub(crate) fn segments(length_m: f64, spacing_m: f64, closed: bool) -> usize {
        let least = if closed { LEAST_CONTROL } else { LEAST_CONTROL - 3 };
        ((length_m / spacing_m).ceil() as usize).max(least)
    }

    /// Length of u, m.
    #[must_use]
    pub(crate) fn span_m(&self) -> f64 {
        let segments = if self.closed { self.control.len() } else { self.control.len() - 3 };
        segments as f64 * self.spacing_m
    }

    /// Index of a control point, continued beyond the end of a closed spline.
    #[must_use]
    pub(crate) fn index(&self, k: usize) -> usize {
        if self.closed { k % self.control.len() } else { k }
    }

    /// u within the period of a closed spline; unchanged on an open one.
    #[must_use]
    pub(crate) fn wrapped(&self, u_m: f64) -> f64 {
        if self.closed { u_m.rem_euclid(self.span_m()) } else { u_m }
    }

    /// The control points of each piece.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = Range<usize>> {
        let ends = self.breaks.iter().copied().chain(std::iter::once(self.control.len()));
        std::iter::once(0).chain(self.breaks.iter().copied()).zip(ends).map(|(from, to)| from..to)
    }

    /// Control points of the piece at u, or of the nearest one.
    #[must_use]
    #[inline]
    fn piece_at(&self, u_m: f64) -> Range<usize> {
        // The three segments between two pieces are divided equally.
        let is_before = |first: &usize| u_m / self.spacing_m < *first as f64 - 1.5;
        let next = self.breaks.iter().position(is_before).unwrap_or(self.breaks.len());
        let from = if next == 0 { 0 } else { self.breaks[next - 1] };
        from..self.breaks.get(next).copied().unwrap_or(self.control.len())
    }

    /// Range of the piece of an open spline at u, or of the nearest one, m.
    #[must_use]
    pub(crate) fn ends_m(&self, u_m: f64) -> [f64; 2] {
        let piece = self.piece_at(u_m);
        [piece.start, piece.end - 3].map(|knot| knot as f64 * self.spacing_m)
    }

    /// A piece alone.
    #[must_use]
    pub(crate) fn piece(&self, control: Range<usize>) -> Self {
        Self { control: self.control[control].to_vec(), breaks: Vec::new(), ..*self }
    }

    /// Whether u is on the spline.
    #[must_use]
    pub(crate) fn holds(&self, u_m: f64) -> bool {
        let [from_m, to_m] = self.ends_m(u_m);
        self.closed || (from_m..=to_m).contains(&u_m)
    }

    /// The weights at u; an open spline continues its last segment beyond its ends.
    #[must_use]
    pub(crate) fn basis(&self, u_m: f64) -> Basis {
        let u_m = self.wrapped(u_m);
        let piece = self.piece_at(u_m);
        let last = if self.closed { piece.end - 1 } else { piece.end - 4 };
        let place = u_m / self.spacing_m;
        let first = (place.floor().max(0.0) as usize).clamp(piece.start, last);
        let s = place - first as f64;
        let (s2, s3) = (s * s, s * s * s);
        let value = Vector4::new(
            (1.0 - s).powi(3) / 6.0,
            (3.0 * s3 - 6.0 * s2 + 4.0) / 6.0,
            (-3.0 * s3 + 3.0 * s2 + 3.0 * s + 1.0) / 6.0,
            s3 / 6.0,
        );
        let slope = Vector4::new(
            -(1.0 - s).powi(2) / 2.0,
            (9.0 * s2 - 12.0 * s) / 6.0,
            (-9.0 * s2 + 6.0 * s + 3.0) / 6.0,
            s2 / 2.0,
        );
        Basis { first, value, slope: slope / self.spacing_m }
    }

    /// Point and derivative with respect to u from weights.
    #[must_use]
    #[inline]
    pub(crate) fn at(&self, basis: &Basis) -> (Vector3<f64>, Vector3<f64>) {
        let (mut point, mut tangent) = (Vector3::zeros(), Vector3::zeros());
        for m in 0..4 {
            let control = &self.control[self.index(basis.first + m)];
            point += control * basis.value[m];
            tangent += control * basis.slope[m];
        }
        (point, tangent)
    }

    /// Second derivative with respect to u, 1/m, from the weights at u, m.
    #[must_use]
    pub(crate) fn second(&self, basis: &Basis, u_m: f64) -> Vector3<f64> {
        let s = self.wrapped(u_m) / self.spacing_m - basis.first as f64;
        let weights = [1.0 - s, 3.0 * s - 2.0, 1.0 - 3.0 * s, s];
        let control = |m: usize| self.control[self.index(basis.first + m)] * weights[m];
        (0..4).map(control).sum::<Vector3<f64>>() / self.spacing_m.powi(2)
    }

    /// The point at u, m.
    #[must_use]
    pub(crate) fn point(&self, u_m: f64) -> Vector3<f64> {
        self.at(&self.basis(u_m)).0
    }

    /// Two unit normals of each control point, perpendicular to C_{k+1} − C_{k−1} and to each other.
    #[must_use]
    pub(crate) fn normals(&self) -> Vec<[Vector3<f64>; 2]> {
        let count = self.control.len();
        let mut before: Option<[Vector3<f64>; 2]> = None;
        (0..count)
            .map(|k| {
                let (previous, next) = if self.closed {
                    ((k + count - 1) % count, (k + 1) % count)
                } else {
                    let from = self.breaks.iter().rev().copied().find(|first| *first <= k).unwrap_or(0);
                    let end = self.breaks.iter().copied().find(|first| *first > k).unwrap_or(count);
                    (k.max(from + 1) - 1, (k + 1).min(end - 1))
                };
                let normals = square_to(&(self.control[next] - self.control[previous]), before.as_ref());
                before = Some(normals);
                normals
            })
            .collect()
    }

    /// Whether two places of it are nearer than a knot in space, but not along it.
    #[must_use]
    pub(crate) fn meets_itself(&self) -> bool {
        /// Places this many knots apart are not near along the curve.
        const APART: usize = 4;
        let count = (self.span_m() / self.spacing_m).round() as usize;
        let points: Vec<Vector3<f64>> = (0..=count).map(|k| self.point(k as f64 * self.spacing_m)).collect();
        let apart = |i: usize, j: usize| {
            let steps = j - i;
            if self.closed { steps.min(count - steps) } else { steps }
        };
        let mut pairs = (0..=count).flat_map(|i| (i + APART..=count).map(move |j| (i, j)));
        pairs.any(|(i, j)| apart(i, j) >= APART && (points[i] - points[j]).norm() < self.spacing_m)
    }

    /// Length of the curve, m: the sum of its chords, four for each knot.
    #[must_use]
    pub(crate) fn length_m(&self) -> f64 {
        let own = |spline: &Self| spline.arc_lengths(4).last().copied().unwrap_or(0.0);
        if self.breaks.is_empty() {
            own(self)
        } else {
            self.pieces().map(|piece| own(&self.piece(piece))).sum()
        }
    }

    /// Arc length of a single piece from the beginning at every 1/`per_knot` of a knot, m.
    #[must_use]
    pub(crate) fn arc_lengths(&self, per_knot: usize) -> Vec<f64> {
        let steps = (self.span_m() / self.spacing_m).round() as usize * per_knot;
        let u_at = |k: usize| k as f64 * self.spacing_m / per_knot as f64;
        let mut lengths_m = vec![0.0];
        let mut from = self.point(0.0);
        for k in 1..=steps {
            let to = if self.closed && k == steps { self.point(0.0) } else { self.point(u_at(k)) };
            lengths_m.push(lengths_m[k - 1] + (to - from).norm());
            from = to;
        }
        lengths_m
    }

    /// u at an arc length, both in m.
    #[must_use]
    pub(crate) fn u_of_arc_length(lengths_m: &[f64], step_m: f64, at_m: f64) -> f64 {
        let after = lengths_m.partition_point(|length| *length < at_m).clamp(1, lengths_m.len() - 1);
        let (from, to) = (lengths_m[after - 1], lengths_m[after]);
        let part = if to > from { (at_m - from) / (to - from) } else { 0.0 };
        (after as f64 - 1.0 + part) * step_m
    }

    /// The smoothest spline through weighted points (u in m, point, weight), by least squares; `None` if it is not finite.
    #[must_use]
    pub(crate) fn through(
        samples: &[(f64, Vector3<f64>, f64)],
        length_m: f64,
        spacing_m: f64,
        closed: bool,
        most_control: usize,
    ) -> Option<Self> {
        /// Weight of the third differences relative to a sample: they decide only where there is none.
        const SMOOTH: f64 = 1e-4;
        if !(length_m.is_finite() && length_m > 0.0) {
            return None;
        }
        let most = if closed { most_control } else { most_control - 3 };
        let segments = Self::segments(length_m, spacing_m, closed).min(most);
        let count = if closed { segments } else { segments + 3 };
        let spacing_m = length_m / segments as f64;
        let breaks = Vec::new();
        let mut spline = Self { control: vec![Vector3::zeros(); count], spacing_m, closed, breaks };
        let (mut hessian, mut right) = (DMatrix::<f64>::zeros(count, count), DMatrix::<f64>::zeros(count, 3));
        for (u_m, point, weight) in samples {
            let basis = spline.basis(*u_m);
            for i in 0..4 {
                let row = spline.index(basis.first + i);
                for j in 0..4 {
                    hessian[(row, spline.index(basis.first + j))] += weight * basis.value[i] * basis.value[j];
                }
                for axis in 0..3 {
                    right[(row, axis)] += weight * basis.value[i] * point[axis];
                }
            }
        }
        for m in spline.third_differences() {
            for (i, a) in THIRD.iter().enumerate() {
                for (j, b) in THIRD.iter().enumerate() {
                    hessian[(spline.index(m + i), spline.index(m + j))] += SMOOTH * a * b;
                }
            }
        }
        let solved = hessian.cholesky()?.solve(&right);
        for (k, control) in spline.control.iter_mut().enumerate() {
            *control = Vector3::new(solved[(k, 0)], solved[(k, 1)], solved[(k, 2)]);
        }
        spline.control.iter().all(|c| c.iter().all(|x| x.is_finite())).then_some(spline)
    }

    /// First control point of each third difference: none connects two pieces.
    #[must_use]
    pub(crate) fn third_differences(&self) -> Vec<usize> {
        if self.closed {
            return (0..self.control.len()).collect();
        }
        self.pieces().flat_map(|piece| piece.start..piece.end - 3).collect()
    }
}

/// Coefficients of a third difference.
pub(crate) const THIRD: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];

/// Two unit normals of a direction, from those of the neighbour, so that they change slowly along a curve.
pub(crate) fn square_to(
    direction: &Vector3<f64>,
    neighbour: Option<&[Vector3<f64>; 2]>,
) -> [Vector3<f64>; 2] {
    /// Control points nearer than this have no direction, m.
    const LEAST_M: f64 = 1e-12;
    let tangent = direction.try_normalize(LEAST_M).unwrap_or_else(Vector3::x);
    let away = |v: Vector3<f64>| (v - tangent * tangent.dot(&v)).try_normalize(1e-3);
    let least = tangent.iamin();
    let axis = Vector3::from_fn(|k, _| if k == least { 1.0 } else { 0.0 });
    let first = neighbour.and_then(|n| away(n[0])).or_else(|| away(axis)).unwrap_or_else(Vector3::y);
    [first, tangent.cross(&first)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix4;

    /// The coefficients of 1, s, s², s³ of each weight.
    fn power_basis() -> Matrix4<f64> {
        Matrix4::new(1.0, 4.0, 1.0, 0.0, -3.0, 0.0, 3.0, 0.0, 3.0, -6.0, 3.0, 0.0, -1.0, 3.0, -3.0, 1.0) / 6.0
    }

    fn wound(closed: bool) -> Spline {
        let control = (0..14_u32)
            .map(|k| {
                let a = f64::from(k) * std::f64::consts::TAU / 14.0;
                Vector3::new(0.1 * a.cos(), 0.1 * a.sin(), 0.02 * (2.0 * a).sin())
            })
            .collect();
        Spline { control, spacing_m: 0.045, closed, breaks: Vec::new() }
    }

    #[test]
    fn weights_are_the_cubic_b_splines_and_slopes_their_derivatives() {
        let spline = wound(false);
        for u_m in [0.0, 0.01, 0.1, 0.3, 0.4949] {
            let basis = spline.basis(u_m);
            let s = u_m / spline.spacing_m - basis.first as f64;
            let expected = power_basis().transpose() * Vector4::new(1.0, s, s * s, s * s * s);
            assert!((basis.value - expected).norm() < 1e-14);
            // A central difference over 1 µm of a cubic is off by h² c'''/6 < 1e-9, and rounding adds up to 1e-6.
            let ahead = spline.point(u_m + 1e-6);
            let difference = (ahead - spline.point(u_m - 1e-6)) / 2e-6;
            assert!((spline.at(&basis).1 - difference).norm() < 1e-8, "{u_m}");
            // The slope is a quadratic, so its central difference is exact but for rounding of 1e-16 m / 1e-6 m / 0.05 m.
            let slope = |u_m: f64| spline.at(&spline.basis(u_m)).1;
            let bend = (slope(u_m + 1e-6) - slope(u_m - 1e-6)) / 2e-6;
            assert!((spline.second(&basis, u_m) - bend).norm() < 1e-5, "{u_m}");
        }
    }

    #[test]
    fn a_closed_spline_goes_on_where_it_began() {
        let spline = wound(true);
        let (before, after) = (spline.point(spline.span_m() - 1e-9), spline.point(1e-9));
        assert!((before - after).norm() < 1e-8);
        assert!((spline.point(-0.01) - spline.point(spline.span_m() - 0.01)).norm() < 1e-12);
    }

    #[test]
    fn normals_are_square_to_the_curve_and_to_each_other() {
        for closed in [false, true] {
            let spline = wound(closed);
            for (k, [one, other]) in spline.normals().iter().enumerate() {
                assert!((one.norm() - 1.0).abs() < 1e-12 && one.dot(other).abs() < 1e-12);
                if (1..13).contains(&k) {
                    let chord = spline.control[k + 1] - spline.control[k - 1];
                    assert!(chord.dot(one).abs() < 1e-14 && chord.dot(other).abs() < 1e-14);
                }
            }
        }
    }
}
