//! The boards' flatness, from the distances of their stripes from one plane, and boards that are not of the same
//! kind.
//!
//! Each board's surface is offset and twisted at its stripe, both drawn with one standard deviation τ. The restricted
//! likelihood \[Patterson1971\] of τ remains after integrating over all unknowns, boards and shared ones alike. The plane
//! takes three numbers from the boards' spread, and inexact poses explain a part of it. It is searched directly. Expectation
//! and maximisation hardly moves if the poses explain all of the spread, and ends at its start.

use crate::bundle::{BoardState, Bundle, BundleState};
use crate::bundle_state::SHARED_SIZE;
use crate::inverse_of_free::inverse_of_free;
use crate::picture_fit::{PictureEquations, flatness_information};
use nalgebra::{Cholesky, Const, Matrix2, SMatrix, SVector, Vector2};
use trueline_lsq::NormalEquations;

/// Boards are between these, m: a tenth of a micrometre is perfect; a sheet of paper is off by millimetres next to
/// its squares.
const FLATTEST_M: f64 = 1e-7;
const LEAST_FLAT_M: f64 = 5e-3;

/// First values of each decade, and halvings of their distance afterwards: to 2 %.
const PER_DECADE: usize = 4;
const HALVINGS: usize = 5;

/// A rise of the deviance that ends a hollow: beyond rounding.
const RISE: f64 = 1.0;

/// A board is of another kind if chance would produce such a one among all boards with less than this probability.
const STRANGE: f64 = 1e-3;

/// Information of all pictures, linear at flat boards, without a prior of their flatness.
pub(crate) struct Flatness {
    boards: Vec<BoardEquations>,
    /// Prior knowledge of the camera.
    hessian: SharedMatrix,
    gradient: SVector<f64, SHARED_SIZE>,
    fixed: Vec<usize>,
}

type SharedMatrix = SMatrix<f64, SHARED_SIZE, SHARED_SIZE>;

/// One picture's equations with the pose of its board eliminated; offset and twist are its own.
struct BoardEquations {
    shared: SharedMatrix,
    across: SMatrix<f64, SHARED_SIZE, 2>,
    own: Matrix2<f64>,
    shared_gradient: SVector<f64, SHARED_SIZE>,
    own_gradient: Vector2<f64>,
}

impl BoardEquations {
    fn of(picture: &PictureEquations) -> Option<Self> {
        let pose = picture.own.fixed_view::<6, 6>(0, 0).into_owned().cholesky()?;
        let shared_pose = picture.across.fixed_columns::<6>(0).into_owned();
        let own_pose = picture.own.fixed_view::<2, 6>(6, 0).into_owned();
        let by_shared = pose.solve(&shared_pose.transpose());
        let by_own = pose.solve(&own_pose.transpose());
        let pull = pose.solve(&picture.own_gradient.fixed_rows::<6>(0).into_owned());
        Some(Self {
            shared: picture.shared - shared_pose * by_shared,
            across: picture.across.fixed_columns::<2>(6) - shared_pose * by_own,
            own: picture.own.fixed_view::<2, 2>(6, 6) - own_pose * by_own,
            shared_gradient: picture.shared_gradient - shared_pose * pull,
            own_gradient: picture.own_gradient.fixed_rows::<2>(6) - own_pose * pull,
        })
    }
}

/// Least cost and determinant of the unknowns at a flatness.
struct Fitted {
    /// Twice the cost at its least, but for a constant.
    cost: f64,
    /// Minus twice the logarithm of the restricted likelihood, but for a constant.
    deviance: f64,
}

impl Flatness {
    /// At a state of the bundle; `fixed` are the shared unknowns that are held.
    /// `None` if a picture's corners do not fix its pose.
    #[must_use]
    pub(crate) fn at(bundle: &Bundle, state: &BundleState, fixed: &[usize]) -> Option<Self> {
        let boards = state.boards.iter().map(|board| BoardState::flat(board.camera_from_board)).collect();
        let flat = BundleState { boards, ..state.clone() };
        let free = Bundle { flatness_m: f64::INFINITY, ..bundle.clone() };
        let mut prior = NormalEquations::zeros(SHARED_SIZE);
        bundle.add_prior(state, &mut prior);
        Some(Self {
            boards: free.picture_equations(&flat).iter().map(BoardEquations::of).collect::<Option<_>>()?,
            hessian: SMatrix::from_fn(|i, j| prior.hessian[(i, j)]),
            gradient: SVector::from_fn(|i, _| prior.gradient[i]),
            fixed: fixed.to_vec(),
        })
    }

    /// The standard deviation of highest likelihood, m.
    #[must_use]
    pub(crate) fn most_likely(&self) -> Option<f64> {
        self.most_likely_without(None)
    }

    /// The board that is most unlike the others, if chance does not explain it.
    #[must_use]
    pub(crate) fn strange(&self) -> Option<usize> {
        let count = self.boards.len();
        // Offset and twist of each of the others, less the plane.
        let freedom = (2.0 * (count as f64 - 1.0) - 3.0).max(1.0);
        let unlike = |k: usize| {
            let flatness_m = self.most_likely_without(Some(k))?;
            let better = self.fitted(flatness_m, None)?.cost - self.fitted(flatness_m, Some(k))?.cost;
            // Two numbers over a spread that was estimated: Fisher's F with two degrees of freedom above.
            Some((k, (1.0 + better.max(0.0) / freedom).powf(-0.5 * freedom)))
        };
        let worst = (0..count).filter_map(unlike).min_by(|a, b| a.1.total_cmp(&b.1))?;
        (worst.1 * (count as f64) < STRANGE).then_some(worst.0)
    }

    fn most_likely_without(&self, left_out: Option<usize>) -> Option<f64> {
        let deviance = |log_m: f64| Some(self.fitted(log_m.exp(), left_out)?.deviance);
        let (from, to) = (FLATTEST_M.ln(), LEAST_FLAT_M.ln());
        let mut step = std::f64::consts::LN_10 / PER_DECADE as f64;
        let count = ((to - from) / step).round() as usize;
        // Up from perfect boards to the first hollow. There may be a second, false maximum. If boards may bulge by more
        // than the distance of the stripes, the plane turns into the direction of the noise, and hides it.
        let (mut best, mut least) = (from, deviance(from)?);
        for at in (1..=count).map(|k| from + step * k as f64) {
            let there = deviance(at)?;
            if there > least + RISE {
                break;
            }
            if there < least {
                (best, least) = (at, there);
            }
        }
        for _ in 0..HALVINGS {
            step *= 0.5;
            for at in [best - step, best + step] {
                let Some(there) = deviance(at).filter(|there| *there < least) else { continue };
                (least, best) = (there, at);
            }
        }
        Some(best.clamp(from, to).exp())
    }

    /// The best fit with boards so flat, but for one that may bulge as it likes.
    fn fitted(&self, flatness_m: f64, free: Option<usize>) -> Option<Fitted> {
        let (mut hessian, mut gradient) = (self.hessian, self.gradient);
        let (mut cost, mut determinants) = (0.0, 0.0);
        for (k, board) in self.boards.iter().enumerate() {
            let mut own = board.own;
            if free != Some(k) {
                for (index, information) in flatness_information(flatness_m).into_iter().enumerate() {
                    own[(index, index)] += information;
                    determinants -= information.ln();
                }
            }
            let own = own.cholesky()?;
            determinants += log_determinant(&own);
            cost -= board.own_gradient.dot(&own.solve(&board.own_gradient));
            hessian += board.shared - board.across * own.solve(&board.across.transpose());
            gradient += board.shared_gradient - board.across * own.solve(&board.own_gradient);
        }
        let covariance = inverse_of_free(&hessian, &self.fixed)?;
        cost -= gradient.dot(&(covariance * gradient));
        // A parameter held fixed has no variance, and no part in the determinant.
        let held = |k: usize| self.fixed.contains(&k);
        let factor = SharedMatrix::from_fn(|i, j| if i == j && held(i) { 1.0 } else { covariance[(i, j)] });
        let deviance = cost + determinants - log_determinant(&factor.cholesky()?);
        deviance.is_finite().then_some(Fitted { cost, deviance })
    }
}

fn log_determinant<const N: usize>(factor: &Cholesky<f64, Const<N>>) -> f64 {
    factor.l_dirty().diagonal().iter().map(|x| 2.0 * x.ln()).sum()
}
