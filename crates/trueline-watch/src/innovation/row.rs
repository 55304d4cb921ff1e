//! A row of a weld's sums: two numbers with their derivatives, of a seam point or of the stripe on a plate.

use super::linearized::{LOCAL, Linearized};
use super::unknowns::{LOCAL_OF_STRIPE, Unknowns};
use nalgebra::{DVector, Matrix2, SMatrix, Vector2};
use trueline_method::evaluate::placed_features::PlacedFeature;

/// Errors that all of one image share: robot x, y, z, its attitude about them, and the stamp.
pub(crate) const SHARED: usize = 7;

/// Two numbers of one image.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    /// Stamp of the image, s after the first robot sample; rows of one stamp are of one image.
    pub stamp_s: f64,
    /// The seam.
    pub line: usize,
    /// Its plate; `None` for the seam's point.
    pub plate: Option<usize>,
    /// Residual, m.
    pub residual: Vector2<f64>,
    /// d r / d local columns.
    pub jacobian: SMatrix<f64, 2, LOCAL_OF_STRIPE>,
    /// Own covariance, m².
    pub covariance: Matrix2<f64>,
    /// How shared errors of one standard deviation move it.
    pub shared: SMatrix<f64, 2, SHARED>,
    /// 0 for an outlier, 1 for an inlier.
    pub weight: f64,
}

impl Row {
    /// Of a seam point.
    pub(crate) fn of_feature(feature: &PlacedFeature, linearized: &Linearized) -> Self {
        let mut jacobian = SMatrix::<f64, 2, LOCAL_OF_STRIPE>::zeros();
        jacobian.fixed_columns_mut::<LOCAL>(0).copy_from(&linearized.jacobian);
        let mut shared = SMatrix::<f64, 2, SHARED>::zeros();
        shared.fixed_columns_mut::<3>(0).copy_from(&linearized.shared.fixed_columns::<3>(0));
        shared.fixed_columns_mut::<1>(SHARED - 1).copy_from(&linearized.shared.fixed_columns::<1>(3));
        Self {
            stamp_s: feature.stamp_s,
            line: feature.line as usize,
            plate: None,
            residual: linearized.residual,
            jacobian,
            covariance: linearized.covariance,
            shared,
            weight: 1.0,
        }
    }

    /// Its columns, and their places among all.
    pub(crate) fn columns(&self, unknowns: Unknowns) -> impl Iterator<Item = (usize, usize)> + '_ {
        let count = if self.plate.is_some() { LOCAL_OF_STRIPE } else { LOCAL };
        let plate = self.plate.unwrap_or(0);
        (0..count).map(move |local| (local, unknowns.place(local, self.line, plate)))
    }

    /// Whitened residual at an estimate of everything.
    pub(crate) fn left_over(
        &self,
        unknowns: Unknowns,
        estimate: Option<&DVector<f64>>,
    ) -> Option<Vector2<f64>> {
        let mut residual = self.residual;
        if let Some(x) = estimate {
            for (local, place) in self.columns(unknowns) {
                residual += self.jacobian.column(local) * x[place];
            }
        }
        let total = self.covariance + self.shared * self.shared.transpose();
        Some(total.cholesky()?.l().try_inverse()? * residual)
    }

    /// Whether it is the first row of an image for its seam: each image counts once.
    pub(crate) fn counts(&self) -> bool {
        self.plate != Some(1)
    }
}
