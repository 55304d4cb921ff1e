//! What the laser's stripe falls on: where it is in the picture, and where its paint changes.

use crate::board::Board;
use crate::projection::project_from_board;
use nalgebra::{Vector2, Vector3};
use trueline_geometry::Pose;
use trueline_model::Camera;

/// From the inner corners to the edge of the outer squares, in squares.
const BEYOND: f64 = 1.0;

/// How far beside the stripe the ground is looked at, px: least and most, and as a part of a square.
const BESIDE_PX: [u32; 2] = [3, 5];
const BESIDE_PART: f64 = 0.25;

/// A board or a plate in a picture.
#[derive(Clone, Debug)]
pub struct Ground {
    camera: Camera,
    /// Corners in order around it, px.
    pub(super) outline: Vec<Vector2<f64>>,
    /// How far beside the stripe the ground is looked at, px.
    pub(super) beside_px: u32,
    squares: Option<(Board, Pose)>,
}

impl Ground {
    /// A board at `camera_from_board`.
    #[must_use]
    pub fn board(camera: &Camera, board: &Board, camera_from_board: &Pose) -> Self {
        let (last_column, last_row) = ((board.columns - 1) as f64, (board.rows - 1) as f64);
        let [left, right, top, bottom] = [-BEYOND, last_column + BEYOND, -BEYOND, last_row + BEYOND];
        let outline =
            [(left, top), (right, top), (right, bottom), (left, bottom)].into_iter().filter_map(|(x, y)| {
                let point = Vector3::new(x, y, 0.0) * board.square_m;
                Some(project_from_board(camera, camera_from_board, &point)?.pixel)
            });
        let distance_m = (camera_from_board * nalgebra::Point3::from(board.middle())).z;
        let square_px = camera.focal.min() * board.square_m / distance_m;
        let beside_px = ((BESIDE_PART * square_px) as u32).clamp(BESIDE_PX[0], BESIDE_PX[1]);
        Self {
            camera: *camera,
            outline: outline.collect(),
            beside_px,
            squares: Some((*board, *camera_from_board)),
        }
    }

    /// A plain plate that fills the picture.
    #[must_use]
    pub fn plate(camera: &Camera) -> Self {
        let [right, bottom] = camera.size.map(|n| f64::from(n) - 1.0);
        let outline = [(0.0, 0.0), (right, 0.0), (right, bottom), (0.0, bottom)];
        Self {
            camera: *camera,
            outline: outline.map(|(x, y)| Vector2::new(x, y)).to_vec(),
            squares: None,
            beside_px: BESIDE_PX[1],
        }
    }

    /// Whether nothing is printed between two pixels: both show one square. Narrow white squares between black ones look like a
    /// stripe, and at an edge a stripe's middle is shifted.
    #[must_use]
    pub(super) fn is_plain_between(&self, a: &Vector2<f64>, b: &Vector2<f64>) -> bool {
        let Some((board, pose)) = &self.squares else { return true };
        match (square(&self.camera, board, pose, a), square(&self.camera, board, pose, b)) {
            (Some(a), Some(b)) => a == b,
            _ => false,
        }
    }
}

/// The square that a pixel shows, counted from the first inner corner; `None` on the paper around them, where a white margin
/// looks like a stripe.
fn square(camera: &Camera, board: &Board, pose: &Pose, pixel: &Vector2<f64>) -> Option<[i64; 2]> {
    let (ray, _) = camera.ray(pixel).ok()?;
    let board_from_camera = pose.inverse();
    let (from, along) = (board_from_camera.translation.vector, board_from_camera.rotation * ray);
    let depth = -from.z / along.z;
    if !(depth > 0.0 && depth.is_finite()) {
        return None;
    }
    let place = (from + along * depth) / board.square_m;
    let square = [place.x.floor() as i64, place.y.floor() as i64];
    let inside = |at: i64, corners: usize| at >= -1 && at < corners as i64;
    (inside(square[0], board.columns) && inside(square[1], board.rows)).then_some(square)
}
