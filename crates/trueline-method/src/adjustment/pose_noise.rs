//! Noise of the poses in the information of an adjustment.
//!
//! Jacobians are taken at noisy poses, and their noise looks like motion. Along two paths of the same motion with independent noise the Jacobians J₁
//! and J₂ share the motion alone: H₀ = sym(J₁ᵀ W J₂), and N = H − H₀ is noise. The covariance of an estimate is H₀⁻¹ H H₀⁻¹ \[Fuller1987\].

use crate::adjustment::adjust::{Adjusted, Adjustment};
use crate::adjustment::sights::{Frame, Sights};
use nalgebra::{DMatrix, SMatrix};

/// Largest share of noise in an information. First-order theory fails where errors are as large as the motion.
pub(crate) const MOST_NOISE: f64 = 0.5;

impl<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize> Adjustment<S, ROWS, LOCAL> {
    /// The covariance of all columns at the end, by the information of the motion alone. With C = L Lᵀ that of the free unknowns and Lᵀ N L = V Λ Vᵀ
    /// it is H₀⁻¹ = H⁻¹ + B Λ (1 − Λ)⁻¹ Bᵀ, B = H⁻¹ L⁻ᵀ V. The shares Λ are estimates, and some of shares near zero are negative.
    #[must_use]
    pub(crate) fn covariance(&self, adjusted: &Adjusted) -> DMatrix<f64> {
        let of_all = adjusted.solved.covariance();
        let Some(noise) = self.pose_noise() else { return of_all };
        let count = noise.nrows();
        let Some(root) = of_all.view((0, 0), (count, count)).into_owned().cholesky().map(|factor| factor.l())
        else {
            return of_all;
        };
        let shares = (root.transpose() * noise * &root).symmetric_eigen();
        let Some(directions) = root.tr_solve_lower_triangular(&shares.eigenvectors) else { return of_all };
        let by_share = of_all.columns(0, count) * directions;
        let wider = shares.eigenvalues.map(|share| share.min(MOST_NOISE) / (1.0 - share.min(MOST_NOISE)));
        of_all + &by_share * DMatrix::from_diagonal(&wider) * by_share.transpose()
    }

    /// N over the free unknowns. `None` without two such paths.
    pub(crate) fn pose_noise(&self) -> Option<DMatrix<f64>> {
        let mut own = self.scan.frames(&self.at);
        let halves: Vec<_> =
            own.iter().map(|frame| self.scan.along_halves(frame.as_ref()?, &self.at)).collect();
        // A frame that only the whole path can place says nothing about the noise.
        own.iter_mut()
            .zip(&halves)
            .filter(|(_, halves)| halves.is_none())
            .for_each(|(frame, _)| *frame = None);
        own.iter().flatten().next()?;
        // The symmetric part of J₁ᵀ J₂ is the square of their half sum minus that of their half difference.
        let with = |part: &dyn Fn(&[SMatrix<f64, ROWS, LOCAL>; 2]) -> SMatrix<f64, ROWS, LOCAL>| {
            let replaced = |(frame, halves): (&Option<Frame<ROWS, LOCAL>>, &Option<_>)| {
                Some(Frame { by_unknowns: part(halves.as_ref()?), ..frame.clone()? })
            };
            self.information(&own.iter().zip(&halves).map(replaced).collect::<Vec<_>>())
        };
        let shared = with(&|[one, other]| (one + other) * 0.5) - with(&|[one, other]| (one - other) * 0.5);
        Some(self.information(&own) - shared)
    }

    /// Information of frames on the free unknowns.
    fn information(&self, frames: &[Option<Frame<ROWS, LOCAL>>]) -> DMatrix<f64> {
        let whitened = self.whitened(&self.table(frames));
        let sums = std::array::from_fn(|residual| whitened[residual].sums.clone());
        let count = self.columns.free.len();
        self.equations(&sums).of_scan.view((0, 0), (count, count)).into_owned()
    }
}
