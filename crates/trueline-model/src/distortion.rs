//! Brown–Conrady lens distortion with a safe inverse.
//!
//! With normalised image coordinates (x, y) and r² = x² + y², coefficients in OpenCV's order
//! \[k₁, k₂, p₁, p₂, k₃\] \[Brown1971\]:
//!
//! ```text
//! x_d = x (1 + k₁r² + k₂r⁴ + k₃r⁶) + 2 p₁xy + p₂(r² + 2x²)
//! y_d = y (1 + k₁r² + k₂r⁴ + k₃r⁶) + p₁(r² + 2y²) + 2 p₂xy
//! ```
//!
//! The polynomial folds back on itself beyond some radius. There two rays share a pixel, and an inverse that merely converges may return the wrong
//! one. This inverse is defined inside that radius only.

use nalgebra::{Matrix2, Vector2};

/// Distortion coefficients, dimensionless.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BrownConrady {
    /// Radial k₁.
    pub k1: f64,
    /// Radial k₂.
    pub k2: f64,
    /// Tangential p₁.
    pub p1: f64,
    /// Tangential p₂.
    pub p2: f64,
    /// Radial k₃.
    pub k3: f64,
}

impl BrownConrady {
    /// From OpenCV's order \[k₁, k₂, p₁, p₂, k₃\].
    #[must_use]
    pub fn from_opencv(c: [f64; 5]) -> Self {
        Self { k1: c[0], k2: c[1], p1: c[2], p2: c[3], k3: c[4] }
    }

    /// In OpenCV's order \[k₁, k₂, p₁, p₂, k₃\].
    #[must_use]
    pub fn to_opencv(&self) -> [f64; 5] {
        [self.k1, self.k2, self.p1, self.p2, self.k3]
    }

    /// Distorts normalised coordinates; returns the value and its 2×2 Jacobian.
    #[must_use]
    pub fn distort(&self, ideal: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let (x, y) = (ideal.x, ideal.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        // d radial / d r², times d r² / d(x, y) = (2x, 2y)
        let slope = self.k1 + r2 * (2.0 * self.k2 + r2 * 3.0 * self.k3);
        let value = Vector2::new(
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        );
        let cross = 2.0 * x * y * slope + 2.0 * self.p1 * x + 2.0 * self.p2 * y;
        let jacobian = Matrix2::new(
            radial + 2.0 * x * x * slope + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            cross,
            cross,
            radial + 2.0 * y * y * slope + 6.0 * self.p1 * y + 2.0 * self.p2 * x,
        );
        (value, jacobian)
    }

    /// Squared radius up to which the radial part rises, so that every pixel has one ray: the first positive
    /// root of 1 + 3k₁s + 5k₂s² + 7k₃s³ with s = r²; infinite without one.
    #[must_use]
    pub fn invertible_radius_squared(&self) -> f64 {
        first_positive_root([1.0, 3.0 * self.k1, 5.0 * self.k2, 7.0 * self.k3])
    }

    /// Removes distortion; returns the ideal coordinates and d ideal / d distorted (2×2).
    ///
    /// `None` where the pixel has no ray inside the invertible radius.
    #[must_use]
    pub fn undistort(&self, distorted: &Vector2<f64>) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let limit = self.invertible_radius_squared();
        let mut ideal = *distorted;
        if ideal.norm_squared() >= limit {
            ideal *= 0.9 * (limit / ideal.norm_squared()).sqrt();
        }
        for _ in 0..50 {
            let (value, jacobian) = self.distort(&ideal);
            let inverse = jacobian.try_inverse()?;
            let mut step = inverse * (distorted - value);
            // Stay inside the radius. Beyond it Newton would find the other ray.
            while (ideal + step).norm_squared() >= limit {
                step *= 0.5;
                if step.norm() < 1e-15 {
                    return None;
                }
            }
            ideal += step;
            if step.norm() < 1e-15 * (1.0 + ideal.norm()) {
                break;
            }
        }
        let (value, jacobian) = self.distort(&ideal);
        // A converged Newton iteration leaves rounding. 1e-12 is 4e-9 px at a focal length of 3600 px.
        let converged = (value - distorted).norm() < 1e-12 * (1.0 + distorted.norm());
        let same_sheet = jacobian.determinant() > 0.0 && jacobian.trace() > 0.0;
        (converged && same_sheet).then(|| jacobian.try_inverse().map(|inverse| (ideal, inverse)))?
    }
}

/// Smallest positive root of c₀ + c₁s + c₂s² + c₃s³ with c₀ > 0. Infinite without a root.
fn first_positive_root(c: [f64; 4]) -> f64 {
    let value = |s: f64| c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    // Beyond this bound (Cauchy's, on the reversed polynomial) the leading term dominates.
    let leading = c.iter().rposition(|x| *x != 0.0).unwrap_or(0);
    if leading == 0 {
        return f64::INFINITY;
    }
    let bound = 1.0 + c[..leading].iter().fold(0.0_f64, |m, x| m.max((x / c[leading]).abs()));
    // The turning points split the axis into monotone pieces. The first change of sign is the root.
    let [first, second] = turning_points(c);
    let mut low = 0.0;
    for high in [first, second, Some(bound)].into_iter().flatten() {
        if high > low && value(high) <= 0.0 {
            return bisect(value, low, high);
        }
        low = low.max(high);
    }
    f64::INFINITY
}

/// Roots of c₁ + 2c₂s + 3c₃s², rising.
fn turning_points(c: [f64; 4]) -> [Option<f64>; 2] {
    let (a, b, k) = (3.0 * c[3], 2.0 * c[2], c[1]);
    let roots = if a == 0.0 {
        [(b != 0.0).then(|| -k / b), None]
    } else {
        let discriminant = b * b - 4.0 * a * k;
        if discriminant < 0.0 {
            [None, None]
        } else {
            let q = -0.5 * (b + discriminant.sqrt().copysign(b));
            if q == 0.0 { [Some(0.0), None] } else { [Some(q / a), Some(k / q)] }
        }
    };
    let [one, two] = roots.map(|root| root.filter(|s| s.is_finite()));
    match (one, two) {
        (Some(a), Some(b)) if b < a => [Some(b), Some(a)],
        (None, Some(b)) => [Some(b), None],
        other => other.into(),
    }
}

fn bisect(value: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high || middle.is_nan() {
            // No number lies between them.
            return low;
        }
        if value(middle) > 0.0 { low = middle } else { high = middle }
    }
}
