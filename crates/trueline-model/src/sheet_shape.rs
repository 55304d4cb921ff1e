//! Between stages 2 and 3: a projective correction of the sheet's coordinates.
//!
//! An error of a camera's focal lengths, principal point or laser plane, or of a profiler's scales, moves a
//! measured point by a homography within the sheet and by a rigid motion. The rigid motion is part of the
//! hand-eye transform. Five numbers of the homography remain, the shape: with (a, b) counted from the shape's
//! origin,
//!
//! ```text
//! a′ = ((1 + h₁) a + h₃ b)/w,  b′ = (1 + h₂) b/w,  w = 1 + h₄ a + h₅ b
//! ```
//!
//! h₁ is a scale of width, h₂ of depth, h₃ a shear, h₄ and h₅ keystone (1/m). (a, b) is the sensor's report, (a′, b′)
//! the point's place. A residual needs the inverse: the sensor's report of a predicted point. Its derivative at the
//! *predicted* point is free of the measurement's noise. At the measured point the estimate would be drawn towards
//! zero, as in every problem with errors in its variables.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

/// A projective correction of the sheet's coordinates about an origin in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetShape {
    /// h₁ width scale, h₂ depth scale, h₃ shear, h₄ and h₅ keystone in 1/m.
    pub h: [f64; 5],
    /// Point with a = b = 0, in the sheet's own coordinates, m.
    pub origin_m: [f64; 2],
}

/// The sensor's report of a point of the sheet.
#[derive(Clone, Copy, Debug)]
pub struct ReportedPoint {
    /// Coordinates in the sheet as reported, m.
    pub reported: Vector2<f64>,
    /// d reported / d true coordinates.
    pub d_true: Matrix2<f64>,
    /// d reported / d h.
    pub d_shape: SMatrix<f64, 2, 5>,
}

impl SheetShape {
    /// Number of unknowns.
    pub const DIMENSION: usize = 5;

    /// The shape of a sensor without error.
    #[must_use]
    pub fn exact_about(origin: &Vector2<f64>) -> Self {
        Self { h: [0.0; 5], origin_m: [origin.x, origin.y] }
    }

    /// True place of a point reported at `reported` (sheet coordinates, m), with d true / d reported.
    #[must_use]
    pub fn corrected(&self, reported: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let [h1, h2, h3, h4, h5] = self.h;
        let origin = Vector2::from(self.origin_m);
        let from_origin = reported - origin;
        let linear = Matrix2::new(1.0 + h1, h3, 0.0, 1.0 + h2);
        let keystone = Vector2::new(h4, h5);
        let inverse_w = (1.0 + keystone.dot(&from_origin)).recip();
        let moved = linear * from_origin * inverse_w;
        (origin + moved, (linear - moved * keystone.transpose()) * inverse_w)
    }

    /// The sensor's report of a point at `at` (sheet coordinates, m): the inverse of
    /// [`SheetShape::corrected`].
    #[must_use]
    pub fn reported(&self, at: &Vector2<f64>) -> ReportedPoint {
        let [h1, h2, h3, h4, h5] = self.h;
        let origin = Vector2::from(self.origin_m);
        let from_origin = at - origin;
        let (inverse_a, inverse_b) = (1.0 / (1.0 + h1), 1.0 / (1.0 + h2));
        // Inverts the affine part, then the keystone: g = m/(1 − h₄ m_a − h₅ m_b).
        let b = from_origin.y * inverse_b;
        let a = (from_origin.x - h3 * b) * inverse_a;
        let m = Vector2::new(a, b);
        let inverse_w = 1.0 / (1.0 - h4 * a - h5 * b);
        let reported = m * inverse_w;
        let d_m = (Matrix2::identity() + reported * Vector2::new(h4, h5).transpose()) * inverse_w;
        let affine = Matrix2::new(inverse_a, -h3 * inverse_a * inverse_b, 0.0, inverse_b);
        let d_affine = SMatrix::<f64, 2, 3>::from_columns(&[
            Vector2::new(-a * inverse_a, 0.0),
            Vector2::new(h3 * b * inverse_a * inverse_b, -b * inverse_b),
            Vector2::new(-b * inverse_a, 0.0),
        ]);
        let mut d_shape = SMatrix::<f64, 2, 5>::zeros();
        d_shape.fixed_columns_mut::<3>(0).copy_from(&(d_m * d_affine));
        d_shape.set_column(3, &(reported * reported.x));
        d_shape.set_column(4, &(reported * reported.y));
        ReportedPoint { reported: origin + reported, d_true: d_m * affine, d_shape }
    }

    /// d corrected / d h for a point reported at `reported`: of [`SheetShape::corrected`] at a constant
    /// report; `None` if the correction turns the sheet inside out.
    #[must_use]
    pub fn d_corrected_d_shape(&self, reported: &Vector2<f64>) -> Option<SMatrix<f64, 2, 5>> {
        // 0 = ∂g/∂q dq + ∂g/∂h dh
        let report = self.reported(&self.corrected(reported).0);
        Some(-(report.d_true.try_inverse()? * report.d_shape))
    }

    /// Moves the five numbers.
    #[must_use]
    pub fn retract(&self, step: &SVector<f64, 5>) -> Self {
        let mut h = self.h;
        for (h, step) in h.iter_mut().zip(step) {
            *h += step;
        }
        Self { h, ..*self }
    }

    /// The composition: first `first`, then `self`, both about the same origin.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        let product = self.homography() * first.homography();
        let h = product / product[(2, 2)];
        Self { h: [h[(0, 0)] - 1.0, h[(1, 1)] - 1.0, h[(0, 1)], h[(2, 0)], h[(2, 1)]], ..*self }
    }

    fn homography(&self) -> nalgebra::Matrix3<f64> {
        let [h1, h2, h3, h4, h5] = self.h;
        nalgebra::Matrix3::new(1.0 + h1, h3, 0.0, 0.0, 1.0 + h2, 0.0, h4, h5, 1.0)
    }
}
