//! Proposes the next picture: the one that reduces the camera's uncertainty over its field most.

use super::field::Sensitivity;
use super::fit::CameraFit;
use crate::board::{Board, FoundCorner};
use crate::bundle::{BoardState, Bundle, BundleState, Picture};
use crate::inverse_of_free::inverse_of_free;
use crate::projection::{CAMERA_SIZE, project_from_board};
use nalgebra::{SMatrix, UnitQuaternion, Vector2, Vector3};
use trueline_geometry::{Pose, se3};

/// Tilts that are tried, rad: about 30°, beyond which squares are seen too narrow.
const TILT_RAD: f64 = 0.52;

/// Parts of the picture's width that the board fills.
const WIDTHS: [f64; 2] = [0.35, 0.6];

/// Less than this part of the board in the picture does not count as a picture of it.
const LEAST_VISIBLE: f64 = 0.999;

/// A picture worth taking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextPicture {
    /// Place of the board's middle in the picture, in thirds: (−1, −1) upper left, (0, 0) middle, (1, 1) lower right.
    pub third: (i32, i32),
    /// Tilt about the picture's horizontal axis (its upper edge comes nearer where positive), rad.
    pub pitch_rad: f64,
    /// Tilt about the vertical axis (its left edge comes nearer where positive), rad.
    pub yaw_rad: f64,
    /// Width of the board as a part of the picture's.
    pub width: f64,
    /// Present uncertainty over the picture, root mean square, px.
    pub now_px: f64,
    /// And with that picture, px.
    pub then_px: f64,
}

/// The best of a set of pictures: nine places, five tilts, two distances. `None` if none is possible.
#[must_use]
pub fn best(fit: &CameraFit, board: &Board) -> Option<NextPicture> {
    let camera = &fit.state.camera;
    let sensitivity = Sensitivity::of(camera);
    let now_px = sensitivity.uncertainty(&fit.covariance).rms_px();
    let fixed = fit.model.fixed();
    let information = inverse_of_free(&fit.covariance, &fixed)?;
    let thirds = (-1..=1).flat_map(|row| (-1..=1).map(move |column| (column, row)));
    let tilts = [(0.0, 0.0), (TILT_RAD, 0.0), (-TILT_RAD, 0.0), (0.0, TILT_RAD), (0.0, -TILT_RAD)];
    thirds
        .flat_map(|third| tilts.into_iter().flat_map(move |tilt| WIDTHS.map(|width| (third, tilt, width))))
        .filter_map(|(third, (pitch_rad, yaw_rad), width)| {
            let pose = pose(fit, board, third, (pitch_rad, yaw_rad), width)?;
            let added = information_of(fit, board, &pose)?;
            let covariance = inverse_of_free(&(information + added), &fixed)?;
            let then_px = sensitivity.uncertainty(&covariance).rms_px();
            Some(NextPicture { third, pitch_rad, yaw_rad, width, now_px, then_px })
        })
        .min_by(|a, b| a.then_px.total_cmp(&b.then_px))
}

/// Pose of the board: tilted about its middle, which lies in the middle of a third of the picture.
fn pose(fit: &CameraFit, board: &Board, third: (i32, i32), tilt: (f64, f64), width: f64) -> Option<Pose> {
    let camera = &fit.state.camera;
    let (w, h) = (f64::from(camera.size[0]), f64::from(camera.size[1]));
    let pixel = Vector2::new(w * (0.5 + 0.25 * f64::from(third.0)), h * (0.5 + 0.25 * f64::from(third.1)));
    let (ray, _) = camera.ray(&pixel).ok()?;
    let depth = camera.focal.x * (board.columns + 1) as f64 * board.square_m / (width * w);
    let (pitch, yaw) = tilt;
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::y() * -yaw)
        * UnitQuaternion::from_scaled_axis(Vector3::x() * pitch);
    Some(se3::from_parts(rotation, ray * depth - rotation * board.middle()))
}

/// Information of a picture on the camera.
fn information_of(
    fit: &CameraFit,
    board: &Board,
    pose: &Pose,
) -> Option<SMatrix<f64, CAMERA_SIZE, CAMERA_SIZE>> {
    let camera = fit.state.camera;
    let (w, h) = (f64::from(camera.size[0]), f64::from(camera.size[1]));
    let mut corners = Vec::new();
    for row in 0..board.rows {
        for column in 0..board.columns {
            let seen = project_from_board(&camera, pose, &board.corner(column, row));
            let inside = |p: &Vector2<f64>| p.x > 5.0 && p.y > 5.0 && p.x < w - 6.0 && p.y < h - 6.0;
            if let Some(seen) = seen.filter(|seen| inside(&seen.pixel)) {
                corners.push(FoundCorner { column, row, pixel: seen.pixel });
            }
        }
    }
    if (corners.len() as f64) < LEAST_VISIBLE * board.corners() as f64 {
        return None;
    }
    let bundle = Bundle {
        board: *board,
        pictures: vec![Picture { corners, stripe: Vec::new() }],
        corner_sigma_px: fit.corner_sigma_px,
        stripe_sigma_px: 1.0,
        flatness_m: 0.0,
        camera_prior: None,
    };
    let state = BundleState {
        camera,
        laser_plane_in_camera: None,
        sheet: fit.state.sheet,
        boards: vec![BoardState::flat(*pose)],
    };
    let (hessian, _) = bundle.picture_equations(&state).first()?.reduced()?;
    Some(hessian.fixed_view::<CAMERA_SIZE, CAMERA_SIZE>(0, 0).into())
}
