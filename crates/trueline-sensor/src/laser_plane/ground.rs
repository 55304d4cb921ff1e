//! Surface under the laser: the squares of a board, the sheet around them, or a plain plate.

use crate::board::Board;
use nalgebra::Vector2;
use trueline_geometry::Pose;
use trueline_model::Camera;
use trueline_vision::pieces::Paint;

/// Part of a board's sheet on which the stripe is searched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StripeOn {
    /// On the squares only.
    Board,
    /// Anywhere on the sheet: on the squares and on the paper around them.
    #[default]
    Sheet,
}

/// A board or a plate in a picture.
#[derive(Clone, Debug)]
pub struct Ground {
    camera: Camera,
    squares: Option<(Board, Pose)>,
    on: StripeOn,
}

/// One paint of the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shown {
    /// A square, counted from the first inner corner.
    Square([i64; 2]),
    /// The paper around the squares, or a plain plate.
    Plain,
}

impl Ground {
    /// A board at `camera_from_board`.
    #[must_use]
    pub fn board(camera: &Camera, board: &Board, camera_from_board: &Pose, on: StripeOn) -> Self {
        Self { camera: *camera, squares: Some((*board, *camera_from_board)), on }
    }

    /// A plain plate that fills the picture.
    #[must_use]
    pub fn plate(camera: &Camera) -> Self {
        Self { camera: *camera, squares: None, on: StripeOn::Sheet }
    }

    /// Part of the ground at a pixel; `None` if it is off the ground.
    fn shown(&self, pixel: &Vector2<f64>) -> Option<Shown> {
        let Some((board, pose)) = &self.squares else { return Some(Shown::Plain) };
        let (ray, _) = self.camera.ray(pixel).ok()?;
        let board_from_camera = pose.inverse();
        let (from, along) = (board_from_camera.translation.vector, board_from_camera.rotation * ray);
        let depth = -from.z / along.z;
        if !(depth > 0.0 && depth.is_finite()) {
            return None;
        }
        let place = (from + along * depth) / board.square_m;
        let square = [place.x.floor() as i64, place.y.floor() as i64];
        let inside = |at: i64, corners: usize| at >= -1 && at < corners as i64;
        match (inside(square[0], board.columns) && inside(square[1], board.rows), self.on) {
            (true, _) => Some(Shown::Square(square)),
            (false, StripeOn::Sheet) => Some(Shown::Plain),
            (false, StripeOn::Board) => None,
        }
    }
}

impl Paint for Ground {
    /// Whether nothing is printed between two pixels. At the edge of a square a stripe's middle is shifted.
    fn is_plain_between(&self, a: &Vector2<f64>, b: &Vector2<f64>) -> bool {
        matches!((self.shown(a), self.shown(b)), (Some(a), Some(b)) if a == b)
    }
}
