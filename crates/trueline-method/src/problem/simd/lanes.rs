//! Four numbers at once.
//!
//! Plain arrays, with every lane written out. In a function compiled for AVX2 four equal operations become one instruction. (Loops over the lanes
//! would compile to the same, but a sweep has thousands of them and they take minutes to compile.) The two kinds differ in how they multiply and
//! add. Closures are not used here: one that is not inlined is compiled for the plain processor, where a fused product is a library call.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Samples side by side.
pub(super) const WIDTH: usize = 4;

/// Four numbers. `FUSED` if the processor multiplies and adds in one instruction.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(crate) struct Lanes<const FUSED: bool>(pub [f64; WIDTH]);

impl<const FUSED: bool> Lanes<FUSED> {
    /// The same number four times.
    #[inline(always)]
    pub(crate) fn splat(value: f64) -> Self {
        Self([value; WIDTH])
    }

    /// a · b + self, with one rounding if the processor can.
    #[inline(always)]
    pub(crate) fn plus_product(self, a: Self, b: Self) -> Self {
        let ([a0, a1, a2, a3], [b0, b1, b2, b3], [c0, c1, c2, c3]) = (a.0, b.0, self.0);
        if FUSED {
            Self([a0.mul_add(b0, c0), a1.mul_add(b1, c1), a2.mul_add(b2, c2), a3.mul_add(b3, c3)])
        } else {
            Self([a0 * b0 + c0, a1 * b1 + c1, a2 * b2 + c2, a3 * b3 + c3])
        }
    }

    /// Applies a function to each number.
    #[inline(always)]
    pub(crate) fn map(self, function: impl Fn(f64) -> f64) -> Self {
        let [a, b, c, d] = self.0;
        Self([function(a), function(b), function(c), function(d)])
    }

    /// Square roots.
    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        let [a, b, c, d] = self.0;
        Self([a.sqrt(), b.sqrt(), c.sqrt(), d.sqrt()])
    }

    /// The largest. None may be NaN.
    #[inline(always)]
    pub(crate) fn max(self) -> f64 {
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        larger(larger(self.0[0], self.0[1]), larger(self.0[2], self.0[3]))
    }

    /// The smallest. None may be NaN.
    #[inline(always)]
    pub(crate) fn min(self) -> f64 {
        let smaller = |a: f64, b: f64| if a < b { a } else { b };
        smaller(smaller(self.0[0], self.0[1]), smaller(self.0[2], self.0[3]))
    }
}

macro_rules! element_wise {
    ($trait:ident, $function:ident, $operator:tt) => {
        impl<const FUSED: bool> $trait for Lanes<FUSED> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                let ([a0, a1, a2, a3], [b0, b1, b2, b3]) = (self.0, other.0);
                Self([a0 $operator b0, a1 $operator b1, a2 $operator b2, a3 $operator b3])
            }
        }
    };
}
element_wise!(Add, add, +);
element_wise!(Sub, sub, -);
element_wise!(Mul, mul, *);
element_wise!(Div, div, /);

impl<const FUSED: bool> Neg for Lanes<FUSED> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let [a, b, c, d] = self.0;
        Self([-a, -b, -c, -d])
    }
}

/// Four vectors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vectors<const FUSED: bool>(pub [Lanes<FUSED>; 3]);

impl<const FUSED: bool> Vectors<FUSED> {
    /// The same vector four times.
    #[inline(always)]
    pub(crate) fn splat(vector: &nalgebra::Vector3<f64>) -> Self {
        Self([Lanes::splat(vector.x), Lanes::splat(vector.y), Lanes::splat(vector.z)])
    }

    /// From each component of four.
    #[inline(always)]
    pub(crate) fn from_components(components: &[[f64; WIDTH]; 3]) -> Self {
        let [x, y, z] = *components;
        Self([Lanes(x), Lanes(y), Lanes(z)])
    }

    /// Scalar products.
    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> Lanes<FUSED> {
        let [a, b] = [self.0, other.0];
        (a[0] * b[0]).plus_product(a[1], b[1]).plus_product(a[2], b[2])
    }

    /// Vector products.
    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        let ([ax, ay, az], [bx, by, bz]) = (self.0, other.0);
        Self([
            (ay * bz).plus_product(-az, by),
            (az * bx).plus_product(-ax, bz),
            (ax * by).plus_product(-ay, bx),
        ])
    }

    /// self · factor.
    #[inline(always)]
    pub(crate) fn scaled(self, factor: Lanes<FUSED>) -> Self {
        let [x, y, z] = self.0;
        Self([x * factor, y * factor, z * factor])
    }

    /// self + vector · factor.
    #[inline(always)]
    pub(crate) fn plus_scaled(self, vector: Self, factor: Lanes<FUSED>) -> Self {
        let ([x, y, z], [a, b, c]) = (self.0, vector.0);
        Self([x.plus_product(a, factor), y.plus_product(b, factor), z.plus_product(c, factor)])
    }
}

impl<const FUSED: bool> Add for Vectors<FUSED> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        Self([x + a, y + b, z + c])
    }
}

impl<const FUSED: bool> Sub for Vectors<FUSED> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let ([x, y, z], [a, b, c]) = (self.0, other.0);
        Self([x - a, y - b, z - c])
    }
}

/// Four rotations, by rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rotations<const FUSED: bool>(pub [Vectors<FUSED>; 3]);

impl<const FUSED: bool> Rotations<FUSED> {
    /// The same rotation four times.
    #[inline(always)]
    pub(super) fn splat(matrix: &nalgebra::Matrix3<f64>) -> Self {
        let rows = matrix.transpose();
        Self([
            Vectors::splat(&rows.column(0).into_owned()),
            Vectors::splat(&rows.column(1).into_owned()),
            Vectors::splat(&rows.column(2).into_owned()),
        ])
    }

    /// Rotates.
    #[inline(always)]
    pub(super) fn apply(&self, vector: Vectors<FUSED>) -> Vectors<FUSED> {
        let [x, y, z] = self.0;
        Vectors([x.dot(vector), y.dot(vector), z.dot(vector)])
    }
}

/// Four unit quaternions, w x y z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quaternions<const FUSED: bool>(pub [Lanes<FUSED>; 4]);

/// Squared half angles up to which the series of sine and cosine are exact: the first omitted terms are x⁵/10! and x⁵/11!, 3e-17 at 0.1 rad.
const SERIES_SQUARED: f64 = 0.01;

impl<const FUSED: bool> Quaternions<FUSED> {
    /// The same rotation four times.
    #[inline(always)]
    pub(super) fn splat(q: &nalgebra::UnitQuaternion<f64>) -> Self {
        Self([Lanes::splat(q.w), Lanes::splat(q.i), Lanes::splat(q.j), Lanes::splat(q.k)])
    }

    /// Exp of half the rotation vectors given.
    #[inline(always)]
    pub(super) fn exp_of_half(half: Vectors<FUSED>) -> Self {
        let x = half.dot(half);
        let (cosine, sine_over_angle) = if x.max() <= SERIES_SQUARED { short_turn(x) } else { long_turn(x) };
        let [a, b, c] = half.0;
        Self([cosine, a * sine_over_angle, b * sine_over_angle, c * sine_over_angle])
    }

    /// The product: first `other`, then self.
    #[inline(always)]
    pub(super) fn times(&self, other: &Self) -> Self {
        let ([aw, ax, ay, az], [bw, bx, by, bz]) = (self.0, other.0);
        Self([
            (aw * bw).plus_product(-ax, bx).plus_product(-ay, by).plus_product(-az, bz),
            (aw * bx).plus_product(ax, bw).plus_product(ay, bz).plus_product(-az, by),
            (aw * by).plus_product(-ax, bz).plus_product(ay, bw).plus_product(az, bx),
            (aw * bz).plus_product(ax, by).plus_product(-ay, bx).plus_product(az, bw),
        ])
    }

    /// The matrices of the inverse rotations.
    #[inline(always)]
    pub(super) fn inverse_matrices(&self) -> Rotations<FUSED> {
        let [w, x, y, z] = self.0;
        let [x2, y2, z2] = [x + x, y + y, z + z];
        let one = Lanes::splat(1.0);
        let [xx, yy, zz] = [x * x2, y * y2, z * z2];
        let [xy, xz, yz] = [x * y2, x * z2, y * z2];
        let [wx, wy, wz] = [w * x2, w * y2, w * z2];
        // The transpose of the usual matrix.
        Rotations([
            Vectors([one - yy - zz, xy + wz, xz - wy]),
            Vectors([xy - wz, one - xx - zz, yz + wx]),
            Vectors([xz + wy, yz - wx, one - xx - yy]),
        ])
    }
}

/// cos √x and sin √x / √x by their series.
#[inline(always)]
fn short_turn<const FUSED: bool>(x: Lanes<FUSED>) -> (Lanes<FUSED>, Lanes<FUSED>) {
    let cosine = series(x, [1.0, -1.0 / 2.0, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40_320.0]);
    let sine_over_angle = series(x, [1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0]);
    (cosine, sine_over_angle)
}

#[inline(always)]
fn series<const FUSED: bool>(x: Lanes<FUSED>, coefficients: [f64; 5]) -> Lanes<FUSED> {
    let mut sum = Lanes::splat(coefficients[4]);
    for k in [3, 2, 1, 0] {
        sum = Lanes::splat(coefficients[k]).plus_product(sum, x);
    }
    sum
}

/// The same for rotations larger than any robot makes between two samples, which a recording may still contain.
#[cold]
fn long_turn<const FUSED: bool>(x: Lanes<FUSED>) -> (Lanes<FUSED>, Lanes<FUSED>) {
    let sine_over_angle =
        |angle: f64| if angle < 1e-4 { 1.0 - angle * angle / 6.0 } else { angle.sin() / angle };
    (x.map(|x| x.sqrt().cos()), x.map(|x| sine_over_angle(x.sqrt())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Quaternion, UnitQuaternion, Vector3};
    use trueline_geometry::so3;

    // Numbers of few bits, whose sums and products are exact for any rounding.
    const A: [f64; WIDTH] = [1.5, -2.0, 0.25, 3.0];
    const B: [f64; WIDTH] = [2.0, 4.0, -8.0, 0.5];
    const C: [f64; WIDTH] = [0.125, -1.0, 6.0, 2.5];

    fn each(of: impl Fn(usize) -> f64) -> [f64; WIDTH] {
        std::array::from_fn(of)
    }

    fn numbers<const FUSED: bool>() {
        let (a, b, c) = (Lanes::<FUSED>(A), Lanes::<FUSED>(B), Lanes::<FUSED>(C));
        assert_eq!((a + b).0, each(|k| A[k] + B[k]));
        assert_eq!((a - b).0, each(|k| A[k] - B[k]));
        assert_eq!((a * b).0, each(|k| A[k] * B[k]));
        assert_eq!((a / b).0, each(|k| A[k] / B[k]));
        assert_eq!((-a).0, each(|k| -A[k]));
        assert_eq!(c.plus_product(a, b).0, each(|k| C[k] + A[k] * B[k]));
        assert_eq!(a.map(|x| 2.0 * x + 1.0).0, each(|k| 2.0 * A[k] + 1.0));
        assert_eq!((a * a).sqrt().0, each(|k| A[k].abs()));
        for shift in 0..WIDTH {
            let mut turned = [1.0, 2.0, 3.0, -4.0];
            turned.rotate_left(shift);
            assert_eq!((Lanes::<FUSED>(turned).max(), Lanes::<FUSED>(turned).min()), (3.0, -4.0));
        }
    }

    fn vectors<const FUSED: bool>() {
        let (all, other) =
            (Vectors([Lanes::<FUSED>(A), Lanes(B), Lanes(C)]), Vectors([Lanes(B), Lanes(C), Lanes(A)]));
        let of = |k: usize| (Vector3::new(A[k], B[k], C[k]), Vector3::new(B[k], C[k], A[k]));
        let component = |of: Vectors<FUSED>, k: usize| Vector3::from_fn(|row, _| of.0[row].0[k]);
        let scaled = all.plus_scaled(other, Lanes(A));
        for k in 0..WIDTH {
            let (a, b) = of(k);
            assert_eq!(all.dot(other).0[k], a.dot(&b));
            assert_eq!(component(all.cross(other), k), a.cross(&b));
            assert_eq!(component(all + other, k), a + b);
            assert_eq!(component(all - other, k), a - b);
            assert_eq!(component(scaled, k), a + b * A[k]);
        }
    }

    #[test]
    fn fused_or_not_four_are_as_one_by_one() {
        numbers::<false>();
        numbers::<true>();
        vectors::<false>();
        vectors::<true>();
    }

    fn turns<const FUSED: bool>(half_angles: [f64; WIDTH]) {
        let axis = Vector3::new(0.6, -0.48, 0.64);
        let half = Vectors([0, 1, 2].map(|row| Lanes::<FUSED>(half_angles.map(|angle| axis[row] * angle))));
        let found = Quaternions::exp_of_half(half);
        let start = so3::exp(&Vector3::new(0.3, -1.1, 0.7));
        let after = Quaternions::splat(&start).times(&found);
        let inverse = after.inverse_matrices().0;
        for (k, angle) in half_angles.into_iter().enumerate() {
            // To a few eps of each number's own size, including the sine of a tiny rotation.
            let [w, x, y, z] = found.0.map(|part| part.0[k]);
            let sine = axis * angle.sin();
            assert!((w - angle.cos()).abs() < 4e-16, "cosine of {angle}");
            assert!((Vector3::new(x, y, z) - sine).norm() <= 6e-16 * angle, "sine of {angle}");
            let expected = start * UnitQuaternion::new_unchecked(Quaternion::from_parts(angle.cos(), sine));
            let matrix = expected.inverse().to_rotation_matrix().into_inner();
            for (row, found) in inverse.iter().enumerate() {
                for column in 0..3 {
                    // Sums of products of numbers up to 1, a dozen roundings.
                    assert!((found.0[column].0[k] - matrix[(row, column)]).abs() < 4e-15, "{angle}");
                }
            }
            let [w, ..] = after.0;
            assert!((w.0[k] - expected.w).abs() < 1e-15);
        }
    }

    /// Groups of short turns, of long ones, and of both, where the short ones take the long way too.
    #[test]
    fn turns_of_any_size_are_exact_to_rounding_whatever_is_beside_them() {
        for group in [
            [0.0, 1e-9, 1e-3, 0.0999],
            [0.05, 0.099, 0.02, 0.08],
            [0.1001, 0.3, 1.0, 3.0],
            [0.0, 2.0, 1e-9, 9.9e-5],
            [1.01e-4, 3e-3, 0.09, 0.11],
        ] {
            turns::<false>(group);
            turns::<true>(group);
        }
    }
}
