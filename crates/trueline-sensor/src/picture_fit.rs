//! One picture's part of the joint fit: its corners, its stripe and its board.
//!
//! A corner's residual is its pixel predicted by the board, less the measured one. A point of the stripe lies on the
//! ray of its pixel, on the board and on the laser plane: the ray meets the board in X, and n·X = d. Its residual is
//! how far the pixel is from where the stripe should run, across the stripe.

use crate::board::{Board, FoundCorner};
use crate::bundle_state::{BoardState, BundleState, PICTURE_SIZE, SENSOR_SIZE, SHARED_SIZE};
use crate::projection::{CAMERA_SIZE, project_from_board};
use crate::sheet::SHEET_SIZE;
use crate::stripe_residual::{Sheet, StripePixel, StripePoint};
use nalgebra::{SMatrix, SVector};

/// Reach for a twist: no board sees one metre of it.
pub(crate) const TWIST_REACH_M: f64 = 0.05;

/// Measurements of one picture, with their noise.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Corners: where on the board, and the pixel.
    pub corners: Vec<FoundCorner>,
    /// Pixels on the laser's stripe.
    pub stripe: Vec<StripePixel>,
}

/// Sums over one picture, split into the shared unknowns and its own.
#[derive(Clone, Debug)]
pub(crate) struct PictureEquations {
    /// Shared with shared.
    pub shared: SMatrix<f64, SHARED_SIZE, SHARED_SIZE>,
    /// Shared with own.
    pub across: SMatrix<f64, SHARED_SIZE, PICTURE_SIZE>,
    /// Own with own.
    pub own: SMatrix<f64, PICTURE_SIZE, PICTURE_SIZE>,
    /// Gradient of the shared unknowns.
    pub shared_gradient: SVector<f64, SHARED_SIZE>,
    /// Gradient of its own unknowns.
    pub own_gradient: SVector<f64, PICTURE_SIZE>,
    /// ½ Σ r².
    pub cost: f64,
}

impl PictureEquations {
    fn zero() -> Self {
        Self {
            shared: SMatrix::zeros(),
            across: SMatrix::zeros(),
            own: SMatrix::zeros(),
            shared_gradient: SVector::zeros(),
            own_gradient: SVector::zeros(),
            cost: 0.0,
        }
    }

    fn add<const N: usize>(
        &mut self,
        residual: &SVector<f64, N>,
        d_shared: &SMatrix<f64, N, SHARED_SIZE>,
        d_own: &SMatrix<f64, N, PICTURE_SIZE>,
    ) {
        self.shared += d_shared.transpose() * d_shared;
        self.across += d_shared.transpose() * d_own;
        self.own += d_own.transpose() * d_own;
        self.shared_gradient += d_shared.transpose() * residual;
        self.own_gradient += d_own.transpose() * residual;
        self.cost += 0.5 * residual.norm_squared();
    }

    /// The step of the picture's own unknowns, damped.
    #[must_use]
    pub(crate) fn own_step(&self, damping: f64) -> Option<SVector<f64, PICTURE_SIZE>> {
        let mut matrix = self.own;
        for k in 0..PICTURE_SIZE {
            matrix[(k, k)] *= 1.0 + damping;
        }
        // Radians and metres differ by orders: scaled to a unit diagonal first.
        let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
        let scaled =
            SMatrix::<f64, PICTURE_SIZE, PICTURE_SIZE>::from_fn(|i, j| matrix[(i, j)] * scale[i] * scale[j]);
        let step = nalgebra::Cholesky::new(scaled)?.solve(&(-self.own_gradient).component_mul(&scale));
        Some(step.component_mul(&scale))
    }

    /// Own unknowns as a linear function of the shared ones at the best fit: −own⁻¹ acrossᵀ.
    #[must_use]
    pub(crate) fn own_from_shared(&self) -> Option<SMatrix<f64, PICTURE_SIZE, SHARED_SIZE>> {
        Some(-self.own.cholesky()?.solve(&self.across.transpose()))
    }

    /// Hessian and gradient of the shared unknowns, after the own unknowns are eliminated (Schur complement).
    #[must_use]
    pub(crate) fn reduced(
        &self,
    ) -> Option<(SMatrix<f64, SHARED_SIZE, SHARED_SIZE>, SVector<f64, SHARED_SIZE>)> {
        let own = self.own.cholesky()?;
        let hessian = self.shared - self.across * own.solve(&self.across.transpose());
        let gradient = self.shared_gradient - self.across * own.solve(&self.own_gradient);
        // Rounding must not make it asymmetric.
        Some(((hessian + hessian.transpose()) * 0.5, gradient))
    }
}

/// One picture in its problem.
pub(crate) struct PictureFit<'a> {
    /// The board.
    pub board: &'a Board,
    /// The picture.
    pub picture: &'a Picture,
    /// Standard deviation of a corner along each axis, px.
    pub corner_sigma_px: f64,
    /// Standard deviation of a stripe's point across the stripe, px.
    pub stripe_sigma_px: f64,
    /// Standard deviation of a board's offset at its stripe, m. Zero is a perfect board.
    pub flatness_m: f64,
}

impl PictureFit<'_> {
    /// The equations at a state of all and of its board. A corner that the state cannot see makes the cost infinite.
    #[must_use]
    pub(crate) fn equations(&self, state: &BundleState, board: &BoardState) -> PictureEquations {
        let mut equations = PictureEquations::zero();
        self.add_corners(state, board, &mut equations);
        if let Some(plane) = &state.laser_plane_in_camera {
            self.add_stripe(state, plane, board, &mut equations);
        }
        self.add_flatness(board, &mut equations);
        equations
    }

    fn add_corners(&self, state: &BundleState, board: &BoardState, equations: &mut PictureEquations) {
        let weight = 1.0 / self.corner_sigma_px;
        for corner in &self.picture.corners {
            let (point, d_sheet) = state.sheet.corner(self.board, corner.column, corner.row);
            let Some(seen) = project_from_board(&state.camera, &board.camera_from_board, &point) else {
                equations.cost = f64::INFINITY;
                return;
            };
            let mut d_shared = SMatrix::<f64, 2, SHARED_SIZE>::zeros();
            d_shared.fixed_columns_mut::<CAMERA_SIZE>(0).copy_from(&(seen.d_camera * weight));
            // A move of the point in the board's frame is one of the board by as much, in the camera's.
            let d_point = seen.d_pose.fixed_columns::<3>(3)
                * board.camera_from_board.rotation.to_rotation_matrix().matrix();
            d_shared.fixed_columns_mut::<SHEET_SIZE>(SENSOR_SIZE).copy_from(&(d_point * d_sheet * weight));
            let mut d_own = SMatrix::<f64, 2, PICTURE_SIZE>::zeros();
            d_own.fixed_columns_mut::<6>(0).copy_from(&(seen.d_pose * weight));
            equations.add(&((seen.pixel - corner.pixel) * weight), &d_shared, &d_own);
        }
    }

    fn add_stripe(
        &self,
        state: &BundleState,
        plane: &trueline_geometry::Plane,
        board: &BoardState,
        equations: &mut PictureEquations,
    ) {
        for stripe in &self.picture.stripe {
            let sheet = Sheet { board: self.board, shape: &state.sheet };
            let Some(point) = StripePoint::of(&state.camera, plane, (board, sheet), stripe) else {
                equations.cost = f64::INFINITY;
                return;
            };
            let weight = stripe.px_per_m / self.stripe_sigma_px;
            let residual = SVector::<f64, 1>::new(point.distance_m * weight);
            equations.add(&residual, &(point.d_shared * weight), &(point.d_own * weight));
        }
    }

    /// Prior knowledge of the board's flatness.
    fn add_flatness(&self, board: &BoardState, equations: &mut PictureEquations) {
        let values = [board.bulge_m, board.twist];
        for ((index, information), value) in
            [6, 7].into_iter().zip(flatness_information(self.flatness_m)).zip(values)
        {
            equations.own[(index, index)] += information;
            equations.own_gradient[index] += value * information;
            equations.cost += 0.5 * value * value * information;
        }
    }
}

/// Information of offset and twist of boards with this flatness, m.
#[must_use]
pub(crate) fn flatness_information(flatness_m: f64) -> [f64; 2] {
    // A perfect board has no bulge at all; here it has a millionth of a millimetre.
    let sigma_m = flatness_m.max(1e-9);
    [1.0 / sigma_m.powi(2), (TWIST_REACH_M / sigma_m).powi(2)]
}
