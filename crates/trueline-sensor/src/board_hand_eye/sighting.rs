//! One picture of a board as a measurement of its pose.
//!
//! The pose's uncertainty is far below its nonlinearity: within a picture the problem is linear to a thousandth of this
//! uncertainty. So pose and covariance hold all information of the corners.

use super::pose_sighting::Sighting;
use crate::board::{Board, FoundCorner, View};
use crate::bundle::{BoardState, Bundle, BundleState, Picture};
use crate::laser_plane::striped_view::pose_of;
use crate::projection::CAMERA_SIZE;
use crate::sheet::SheetShape;
use nalgebra::{Matrix6, SMatrix, Vector3};
use std::f64::consts::FRAC_PI_2;
use trueline_geometry::{Pose, se3, so3};
use trueline_model::Camera;

/// The pose of a board in one picture.
#[derive(Clone, Copy, Debug)]
pub struct BoardSighting {
    /// `camera_from_board`.
    pub camera_from_board: Pose,
    /// Covariance of (δ, δt) of it, perturbed on the left, rad² and m², from the noise of the corners.
    pub covariance: Matrix6<f64>,
    /// How it follows the camera's parameters fx … k3.
    pub d_camera: SMatrix<f64, 6, CAMERA_SIZE>,
    /// Σ of squared residuals of the corners, in standard deviations.
    pub squares: f64,
    /// Corners.
    pub corners: usize,
}

impl Sighting for BoardSighting {
    fn camera_from_target(&self) -> &Pose {
        &self.camera_from_board
    }

    fn covariance(&self) -> &Matrix6<f64> {
        &self.covariance
    }

    fn d_camera(&self) -> Option<&SMatrix<f64, 6, CAMERA_SIZE>> {
        Some(&self.d_camera)
    }
}

impl BoardSighting {
    /// The pose that fits corners best. `None` if they do not determine one.
    #[must_use]
    pub fn of(camera: &Camera, board: &Board, corners: &[FoundCorner], corner_sigma_px: f64) -> Option<Self> {
        let view = View { corners: corners.to_vec(), complete: true };
        let start = BoardState::flat(pose_of(camera, board, &view)?);
        let bundle = Bundle {
            board: *board,
            pictures: vec![Picture { corners: view.corners, stripe: Vec::new() }],
            corner_sigma_px,
            stripe_sigma_px: 1.0,
            flatness_m: 0.0,
            camera_prior: None,
        };
        let state = bundle.fitted(BundleState {
            camera: *camera,
            laser_plane_in_camera: None,
            sheet: SheetShape::default(),
            boards: vec![start],
        });
        let equations = bundle.picture_equations(&state).pop()?;
        let information = equations.own.fixed_view::<6, 6>(0, 0).into_owned();
        let d_shared = equations.own_from_shared()?;
        Some(Self {
            camera_from_board: state.boards.first()?.camera_from_board,
            covariance: information.cholesky()?.inverse(),
            d_camera: d_shared.fixed_view::<6, CAMERA_SIZE>(0, 0).into_owned(),
            squares: 2.0 * equations.cost,
            corners: corners.len(),
        })
        .filter(|seen| seen.covariance.iter().chain(seen.d_camera.iter()).all(|x| x.is_finite()))
    }

    /// The same with another noise of the corners, in units of the original noise.
    fn with_noise(self, factor: f64) -> Self {
        Self {
            covariance: self.covariance * (factor * factor),
            squares: self.squares / (factor * factor),
            ..self
        }
    }

    /// The same picture with the board counted from another of its corners: a plain board looks the same when it is turned
    /// by half a turn, a square one by a quarter. `quarters` counts quarter turns; the middle of the board stays.
    #[must_use]
    pub fn turned(&self, board: &Board, quarters: usize) -> Self {
        let turn = so3::exp(&(Vector3::z() * (FRAC_PI_2 * quarters as f64)));
        let middle = board.middle();
        let board_from_turned = se3::from_parts(turn, middle - turn * middle);
        // The origin of the turned board is elsewhere: perturbations of pose and origin go with it.
        let origin = self.camera_from_board.rotation * board_from_turned.translation.vector;
        let mut carry = Matrix6::identity();
        carry.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-so3::hat(&origin)));
        Self {
            camera_from_board: self.camera_from_board * board_from_turned,
            covariance: carry * self.covariance * carry.transpose(),
            d_camera: carry * self.d_camera,
            ..*self
        }
    }
}

/// Pictures with a scatter of corners this many times the usual one do not show a sharp board.
const BLURRED: f64 = 3.0;

/// Pose of a board from its views.
#[derive(Clone, Debug)]
pub struct Sightings {
    /// One for each view; `None` where corners are missing, fix no pose, or scatter far more than usual.
    pub list: Vec<Option<BoardSighting>>,
    /// Noise of a corner along each axis, px, measured over all views.
    pub corner_sigma_px: f64,
}

impl Sightings {
    /// Sightings of complete views by one camera; the noise of the corners is the median over the views. In a view with
    /// missing corners it is unknown which are missing, so its board has no place.
    #[must_use]
    pub fn of(camera: &Camera, board: &Board, views: &[View]) -> Self {
        let of_view = |view: &View| {
            view.complete.then(|| BoardSighting::of(camera, board, &view.corners, 1.0)).flatten()
        };
        let rough: Vec<Option<BoardSighting>> = views.iter().map(of_view).collect();
        let own_sigma = |seen: &BoardSighting| (seen.squares / (2.0 * seen.corners as f64 - 6.0)).sqrt();
        let mut sigmas: Vec<f64> = rough.iter().flatten().map(own_sigma).collect();
        sigmas.sort_by(f64::total_cmp);
        let corner_sigma_px = sigmas.get(sigmas.len() / 2).copied().unwrap_or(0.0);
        let sharp = |seen: &BoardSighting| own_sigma(seen) <= BLURRED * corner_sigma_px;
        let list = rough.into_iter().map(|seen| Some(seen.filter(sharp)?.with_noise(corner_sigma_px)));
        Self { list: list.collect(), corner_sigma_px }
    }
}

/// Quarter turns that make a board look as before.
#[must_use]
pub(crate) fn symmetries(board: &Board) -> &'static [usize] {
    if board.columns == board.rows { &[0, 1, 2, 3] } else { &[0, 2] }
}
