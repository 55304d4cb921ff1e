//! Boards and the bend of their sheet from corners alone, before the laser is known.

use crate::board::{Board, View};
use crate::bundle::{Bundle, BundleState, CameraPrior, Picture, SENSOR_SIZE, SHARED_SIZE};
use crate::bundle_state::BoardState;
use crate::error::Error;
use crate::laser_plane::known_camera::KnownCamera;
use crate::laser_plane::striped_view::pose_of;
use crate::projection::CAMERA_SIZE;
use crate::sheet::SheetShape;
use trueline_lsq::{SolveOptions, solve};
use trueline_model::Camera;

/// Noise of corners that is assumed, px.
const CORNER_PX: f64 = 0.2;

/// The sheet, and its pose in each picture.
#[derive(Clone, Debug)]
pub(crate) struct SeenBoards {
    /// The sheet of all boards.
    pub sheet: SheetShape,
    /// `camera_from_board` of each picture.
    pub boards: Vec<BoardState>,
}

/// Poses of the boards from a known camera.
///
/// # Errors
/// A board without a pose.
pub(crate) fn of_corners(known: &KnownCamera, board: &Board, views: &[&View]) -> Result<SeenBoards, Error> {
    let prior = CameraPrior::new(&known.camera, &known.covariance).ok_or(Error::NotFixed)?;
    let mut fixed = prior.held();
    fixed.extend(CAMERA_SIZE..if SheetShape::is_seen_on(board) { SENSOR_SIZE } else { SHARED_SIZE });
    let bundle = bundle(board, views, Some(prior));
    let begin = bundle.fitted(state(&known.camera, board, SheetShape::default(), views)?);
    let solved = solve(&bundle, begin, &fixed, &SolveOptions::default()).map_err(|_| Error::NoPose)?.state;
    Ok(SeenBoards { sheet: solved.sheet, boards: solved.boards })
}

/// The boards' poses by a known camera and sheet.
///
/// # Errors
/// A board without a pose.
pub(crate) fn at(
    camera: &Camera,
    board: &Board,
    sheet: SheetShape,
    views: &[&View],
) -> Result<SeenBoards, Error> {
    let fitted = bundle(board, views, None).fitted(state(camera, board, sheet, views)?);
    Ok(SeenBoards { sheet, boards: fitted.boards })
}

fn bundle(board: &Board, views: &[&View], camera_prior: Option<CameraPrior>) -> Bundle {
    let pictures = views.iter().map(|view| Picture { corners: view.corners.clone(), stripe: Vec::new() });
    Bundle {
        board: *board,
        pictures: pictures.collect(),
        corner_sigma_px: CORNER_PX,
        stripe_sigma_px: 1.0,
        flatness_m: 0.0,
        camera_prior,
    }
}

fn state(camera: &Camera, board: &Board, sheet: SheetShape, views: &[&View]) -> Result<BundleState, Error> {
    let poses: Option<Vec<BoardState>> =
        views.iter().map(|view| pose_of(camera, board, view).map(BoardState::flat)).collect();
    Ok(BundleState {
        camera: *camera,
        laser_plane_in_camera: None,
        sheet,
        boards: poses.ok_or(Error::NoPose)?,
    })
}
