//! A board with a stripe on it, as a known camera sees it.

use crate::board::{Board, View};
use crate::homography;
use nalgebra::Vector2;
use trueline_geometry::Pose;
use trueline_model::Camera;

/// A board with a stripe.
#[derive(Clone, Debug)]
pub struct StripedView {
    /// Its corners.
    pub view: View,
    /// Pixels along the stripe.
    pub stripe: Vec<Vector2<f64>>,
}

/// `camera_from_board` of a view by a known camera.
#[must_use]
pub fn pose_of(camera: &Camera, board: &Board, view: &View) -> Option<Pose> {
    let on_board: Vec<Vector2<f64>> =
        view.corners.iter().map(|c| board.corner(c.column, c.row).xy()).collect();
    let ideal: Option<Vec<Vector2<f64>>> =
        view.corners.iter().map(|c| camera.ray(&c.pixel).ok().map(|(ray, _)| ray.xy())).collect();
    homography::pose(&homography::fit(&on_board, &ideal?)?, &Vector2::repeat(1.0), &Vector2::zeros())
}
