//! How much of what the scan seems to say is motion, and how much is noise of the robot's poses.
//!
//! A robot that is not tilted reports an attitude that trembles; a fit takes that for tilt and knows everything. But
//! noise is another a moment later, and motion is not: the columns of the Jacobian are multiplied with themselves a
//! little later. For a direction d of the unknowns, with J(t) the Jacobian at an observation's time plus t,
//! s(τ) = Σ (J(0) d)·(J(τ) d) / Σ |J(0) d|². A motion loses ½ ω² τ² of it, which two times tell apart from noise:
//! s(0⁺) ≈ (4 s(τ) − s(2τ)) / 3.

use crate::observations::Observation;
use crate::parameters::Parameters;
use crate::problem::{LOCAL, LineProblem, global_index};
use nalgebra::{DMatrix, SMatrix};
use trueline_geometry::smooth::HALF_WINDOW_S;
use trueline_lsq::{Information, LeastSquares};

/// Information of the Jacobian with itself, and with itself later.
pub struct Signal {
    own: DMatrix<f64>,
    later: DMatrix<f64>,
    much_later: DMatrix<f64>,
}

/// Observations that are looked at.
const SAMPLE: usize = 1000;
/// Noise of poses that go into one local fit is alike; beyond its window it is not. Robots do not tilt so fast that
/// this matters: at 2 Hz it is a tenth of a turn.
const LAG_S: f64 = 3.0 * HALF_WINDOW_S;
/// With a smaller part of motion in it a direction is not seen: noise in a column draws its unknown towards zero by the
/// other part.
const LEAST_SHARE: f64 = 0.8;

impl Signal {
    /// Of a problem at its solution.
    #[must_use]
    pub fn of(problem: &LineProblem<'_>, at: &Parameters) -> Self {
        let n = problem.dimension();
        let mut signal =
            Self { own: DMatrix::zeros(n, n), later: DMatrix::zeros(n, n), much_later: DMatrix::zeros(n, n) };
        let lag_s = problem.observations.robot.period_s.max(LAG_S);
        let every = problem.list.len().div_ceil(SAMPLE).max(1);
        let mut hints = [0; 3];
        // Whole images, so that no line is passed over.
        let chosen = problem.selected().filter(|(o, _)| (o.frame as usize).is_multiple_of(every));
        for (o, whitener) in chosen {
            let mut jacobian = |later: usize| {
                let shifted = Observation { stamp_s: o.stamp_s + lag_s * later as f64, ..*o };
                Some(problem.whitened((&shifted, whitener), at, &mut hints[later])?.1)
            };
            if let (Some(now), Some(later), Some(much_later)) = (jacobian(0), jacobian(1), jacobian(2)) {
                add(&mut signal.own, &(now.transpose() * now), o.line);
                add(&mut signal.later, &(now.transpose() * later), o.line);
                add(&mut signal.much_later, &(now.transpose() * much_later), o.line);
            }
        }
        signal
    }

    /// What is seen of an information without the directions that nothing but noise moves.
    ///
    /// In the coordinates of the covariance's root the shares are the eigenvalues of one symmetric matrix, relative to
    /// another: noise and motion come apart although they share unknowns.
    #[must_use]
    pub fn shown_by(&self, information: &Information) -> Information {
        let root = information.covariance_root();
        if root.ncols() == 0 {
            return information.clone();
        }
        let in_root = |matrix: &DMatrix<f64>| root.transpose() * (matrix + matrix.transpose()) * root * 0.5;
        let motion = in_root(&((&self.later * 4.0 - &self.much_later) / 3.0));
        let Some(factor) = in_root(&self.own).cholesky() else { return information.clone() };
        let inverse = factor.l().solve_lower_triangular(&DMatrix::identity(root.ncols(), root.ncols()));
        let Some(inverse) = inverse else { return information.clone() };
        let eigen = (&inverse * motion * inverse.transpose()).symmetric_eigen();
        let moved: Vec<usize> = (0..root.ncols()).filter(|k| eigen.eigenvalues[*k] >= LEAST_SHARE).collect();
        if moved.len() == root.ncols() {
            return information.clone();
        }
        let chosen = inverse.transpose() * eigen.eigenvectors.select_columns(&moved);
        information.keeping(&chosen.qr().q())
    }
}

fn add(sum: &mut DMatrix<f64>, local: &SMatrix<f64, LOCAL, LOCAL>, line: u32) {
    for row in 0..LOCAL {
        for column in 0..LOCAL {
            sum[(global_index(row, line as usize), global_index(column, line as usize))] +=
                local[(row, column)];
        }
    }
}
