//! Sums of the products of whitened residuals and their gradients, Σ (J | r)ᵀ (J | r), over the frames of each joint.

use crate::problem::layout::Layout;
use crate::problem::row_products::RowProducts;
use crate::stripe::frame_residual::{FrameGradients, ROWS};
use crate::stripe::unknowns::StripeUnknowns;
use crate::stripe::weighed_frame::WeighedFrame;
use nalgebra::{DMatrix, SVector};
use trueline_lsq::NormalEquations;

/// The sums so far.
pub(crate) struct FrameSums {
    unknowns: StripeUnknowns,
    /// Products by joint, in rows of local unknowns and a residual.
    joints: Vec<RowProducts>,
}

impl FrameSums {
    /// Empty sums.
    #[must_use]
    pub(crate) fn new(unknowns: StripeUnknowns) -> Self {
        let joints = (0..unknowns.joints).map(|_| RowProducts::new(unknowns.local() + 1)).collect();
        Self { unknowns, joints }
    }

    /// Adds a frame: its residuals and their gradients, before whitening.
    pub(crate) fn add(
        &mut self,
        weighed: &WeighedFrame,
        residual: &SVector<f64, ROWS>,
        gradients: &FrameGradients,
    ) {
        let whitener = &weighed.whitener;
        let local = self.unknowns.local();
        // A row of weight 0 is skipped.
        for row in (0..ROWS).filter(|row| whitener[(*row, *row)] > 0.0) {
            let numbers = self.joints[weighed.frame.joint].next_row();
            numbers.fill(0.0);
            // The whitener is lower triangular.
            for of in 0..=row {
                let part = whitener[(row, of)];
                let gradient = &gradients.as_slice()[of * gradients.nrows()..][..local];
                numbers[..local].iter_mut().zip(gradient).for_each(|(number, by)| *number += part * by);
                numbers[local] += part * residual[of];
            }
        }
    }

    /// Σ JᵀJ over all unknowns.
    #[must_use]
    pub(crate) fn hessian(self) -> DMatrix<f64> {
        let mut equations = NormalEquations::zeros(self.unknowns.dimension());
        self.add_to(&mut equations);
        equations.hessian
    }

    /// Adds Σ JᵀJ, Σ Jᵀ r and ½ Σ rᵀ r.
    pub(crate) fn add_to(self, equations: &mut NormalEquations) {
        let (unknowns, local) = (self.unknowns, self.unknowns.local());
        for (joint, products) in self.joints.into_iter().enumerate() {
            let sums = products.sums();
            unknowns.add(joint, sums.column(local).as_slice(), equations.gradient.as_mut_slice());
            unknowns.add_square(joint, &sums, &mut equations.hessian);
            equations.cost += 0.5 * sums[(local, local)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stripe::frames::{Sight, StripeFrame};
    use crate::stripe::unknowns::LOCAL_ALL;
    use crate::stripe::weighed_frame::PoseError;
    use nalgebra::{SMatrix, Vector2};

    /// A whitener with one row of weight 0.
    fn weighed(joint: usize) -> WeighedFrame {
        let frame = StripeFrame {
            stamp_s: 0.0,
            joint,
            sight: Sight::Stripes([None; 2]),
            edge: None,
            edge_axis: Vector2::x(),
        };
        let counts = |row: usize| row != 2;
        let whitener = SMatrix::from_fn(|i: usize, j: usize| match counts(i) && counts(j) && j <= i {
            true => 1.0 + i as f64 - 0.3 * j as f64,
            false => 0.0,
        });
        WeighedFrame { frame, whitener, rows: 4, pose_error: PoseError::NONE }
    }

    #[test]
    fn sums_are_those_of_whitened_residuals_by_joint() {
        let unknowns = StripeUnknowns { joints: 2, edged: true, shaped: true };
        let mut sums = FrameSums::new(unknowns);
        let mut plain = NormalEquations::zeros(unknowns.dimension());
        for k in 0..70 {
            let weighed = weighed(k % 2);
            let residual = SVector::from_fn(|i, _| ((3 * k + i) as f64).sin());
            let gradients = FrameGradients::from_fn(|i, j| ((k + 7 * i + 11 * j) as f64).cos());
            sums.add(&weighed, &residual, &gradients);
            let (r, g) = (weighed.whitener * residual, gradients * weighed.whitener.transpose());
            plain.cost += 0.5 * r.norm_squared();
            let place = |local: usize| unknowns.place(local, k % 2).unwrap_or(usize::MAX);
            for i in 0..LOCAL_ALL {
                plain.gradient[place(i)] += g.row(i).transpose().dot(&r);
                for j in 0..LOCAL_ALL {
                    plain.hessian[(place(i), place(j))] += g.row(i).dot(&g.row(j));
                }
            }
        }
        let mut found = NormalEquations::zeros(unknowns.dimension());
        sums.add_to(&mut found);
        // Some hundred products of up to a hundred.
        assert!((found.cost - plain.cost).abs() < 1e-9);
        assert!((found.gradient - plain.gradient).amax() < 1e-9);
        assert!((found.hessian - plain.hessian).amax() < 1e-9);
    }
}
