//! The joint fit: one camera, perhaps one laser plane, and a pose of the board for every picture.
//!
//! A board's pose concerns only its own picture, so the information matrix is an arrow: the poses are eliminated
//! (variable projection \[Golub1973\]). The solver sees the camera and the plane; a state always carries the poses
//! that fit them best. The cost is then a function of camera and plane alone, its gradient is theirs alone, and its
//! Gauss–Newton Hessian is the Schur complement.

use crate::board::Board;
pub use crate::bundle_state::{BoardState, BundleState, SENSOR_SIZE, SHARED_SIZE};
use crate::inverse_of_free::inverse_of_free;
pub use crate::picture_fit::Picture;
use crate::picture_fit::{PictureEquations, PictureFit};
use crate::projection::{CAMERA_SIZE, CameraVector, from_vector, to_vector};
use crate::sheet::SHEET_SIZE;
use crate::sheet_tilt;
use nalgebra::{DMatrix, DVector, SMatrix};
use trueline_lsq::{LeastSquares, NormalEquations};
use trueline_model::Camera;

/// Most steps of a picture's own fit; it is quadratic near its end.
const MOST_STEPS: usize = 30;

/// A picture's own fit has ended when it moves by less than this, in standard deviations.
const SETTLED: f64 = 1e-9;

/// The joint problem.
#[derive(Clone, Debug)]
pub struct Bundle {
    /// The board.
    pub board: Board,
    /// The pictures.
    pub pictures: Vec<Picture>,
    /// Standard deviation of a corner along each axis, px.
    pub corner_sigma_px: f64,
    /// Standard deviation of a stripe's point across the stripe, px.
    pub stripe_sigma_px: f64,
    /// How flat boards are: standard deviation of a board's offset at its stripe, m. Zero is a perfect board.
    pub flatness_m: f64,
    /// Prior knowledge of the camera.
    pub camera_prior: Option<CameraPrior>,
}

/// A known camera, with its information.
#[derive(Clone, Debug)]
pub struct CameraPrior {
    mean: CameraVector,
    /// Inverse covariance over the free parameters.
    information: SMatrix<f64, CAMERA_SIZE, CAMERA_SIZE>,
    held: Vec<usize>,
}

impl CameraPrior {
    /// From a camera and the covariance of its parameters; those without variance are held. `None` where the covariance has
    /// no inverse.
    #[must_use]
    pub fn new(camera: &Camera, covariance: &SMatrix<f64, CAMERA_SIZE, CAMERA_SIZE>) -> Option<Self> {
        let held: Vec<usize> = (0..CAMERA_SIZE).filter(|k| covariance[(*k, *k)] <= 0.0).collect();
        let information = inverse_of_free(covariance, &held)?;
        Some(Self { mean: to_vector(camera), information, held })
    }

    /// Parameters that are held.
    #[must_use]
    pub fn held(&self) -> Vec<usize> {
        self.held.clone()
    }

    pub(crate) fn cost(&self, camera: &Camera) -> f64 {
        let off = to_vector(camera) - self.mean;
        0.5 * off.dot(&(self.information * off))
    }

    pub(crate) fn add(&self, camera: &Camera, equations: &mut NormalEquations) {
        let off = to_vector(camera) - self.mean;
        let pull = self.information * off;
        for i in 0..CAMERA_SIZE {
            equations.gradient[i] += pull[i];
            for j in 0..CAMERA_SIZE {
                equations.hessian[(i, j)] += self.information[(i, j)];
            }
        }
        equations.cost += self.cost(camera);
    }
}

impl Bundle {
    /// A state with boards fitted to its camera and plane.
    #[must_use]
    pub fn fitted(&self, mut state: BundleState) -> BundleState {
        let boards = (0..self.pictures.len()).map(|k| self.fit_board(&state, k)).collect();
        state.boards = boards;
        state
    }

    /// Prior of the unknowns that all pictures share.
    pub(crate) fn add_prior(&self, state: &BundleState, equations: &mut NormalEquations) {
        if let Some(prior) = &self.camera_prior {
            prior.add(&state.camera, equations);
        }
        let (information, pull, cost) = state.sheet.prior();
        for k in 0..SHEET_SIZE {
            equations.hessian[(SENSOR_SIZE + k, SENSOR_SIZE + k)] += information[k];
            equations.gradient[SENSOR_SIZE + k] += pull[k];
        }
        equations.cost += cost;
    }

    /// The equations of each picture at a state, for uses beyond their sum.
    #[must_use]
    pub(crate) fn picture_equations(&self, state: &BundleState) -> Vec<PictureEquations> {
        (0..self.pictures.len()).map(|k| self.picture(k).equations(state, &state.boards[k])).collect()
    }

    fn picture(&self, k: usize) -> PictureFit<'_> {
        PictureFit {
            board: &self.board,
            picture: &self.pictures[k],
            corner_sigma_px: self.corner_sigma_px,
            stripe_sigma_px: self.stripe_sigma_px,
            flatness_m: self.flatness_m,
        }
    }

    /// The board's state that fits best, from the one that is there.
    fn fit_board(&self, state: &BundleState, k: usize) -> BoardState {
        let fit = self.picture(k);
        let mut board = state.boards[k];
        let mut equations = fit.equations(state, &board);
        let mut damping = 0.0;
        for _ in 0..MOST_STEPS {
            let Some(step) = equations.own_step(damping) else { break };
            let length = step.dot(&(equations.own * step)).max(0.0).sqrt();
            let next = board.moved(&step);
            let after = fit.equations(state, &next);
            if after.cost <= equations.cost * (1.0 + 1e-13) {
                (board, equations, damping) = (next, after, damping * 0.1);
            } else {
                damping = (damping * 10.0).max(1e-3);
            }
            if length < SETTLED || damping > 1e9 {
                break;
            }
        }
        board
    }
}

impl LeastSquares for Bundle {
    type State = BundleState;

    fn dimension(&self) -> usize {
        SHARED_SIZE
    }

    fn retract(&self, state: &BundleState, step: &DVector<f64>) -> BundleState {
        let moved: CameraVector = to_vector(&state.camera) + step.fixed_rows::<CAMERA_SIZE>(0);
        let plane = state
            .laser_plane_in_camera
            .map(|plane| sheet_tilt::moved(&plane, &step.fixed_rows::<3>(CAMERA_SIZE).into()));
        self.fitted(BundleState {
            camera: from_vector(state.camera.size, &moved),
            laser_plane_in_camera: plane,
            sheet: state.sheet.moved(&step.fixed_rows::<SHEET_SIZE>(SENSOR_SIZE).into()),
            boards: state.boards.clone(),
        })
    }

    fn cost(&self, state: &BundleState) -> f64 {
        let pictures =
            (0..self.pictures.len()).map(|k| self.picture(k).equations(state, &state.boards[k]).cost);
        let of_camera = self.camera_prior.as_ref().map_or(0.0, |prior| prior.cost(&state.camera));
        pictures.sum::<f64>() + of_camera + state.sheet.prior().2
    }

    fn linearize(&self, state: &BundleState, equations: &mut NormalEquations) {
        self.add_prior(state, equations);
        for picture in self.picture_equations(state) {
            equations.cost += picture.cost;
            if let Some((hessian, gradient)) = picture.reduced() {
                equations.hessian +=
                    DMatrix::from_iterator(SHARED_SIZE, SHARED_SIZE, hessian.iter().copied());
                equations.gradient += DVector::from_column_slice(gradient.as_slice());
            } else {
                // A board that its own picture does not fix: nothing can be concluded from it.
                equations.cost = f64::NAN;
            }
        }
    }
}
