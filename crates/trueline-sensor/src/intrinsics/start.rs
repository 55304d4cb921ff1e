//! A camera to begin with, in closed form: no distortion, the principal point in the middle.
//!
//! With ω = diag(1/fx², 1/fy², 1) and columns h₁, h₂ of a homography, h₁ᵀωh₂ = 0 and h₁ᵀωh₁ = h₂ᵀωh₂ \[Zhang2000, Eqs. 3
//! and 4\]: two linear equations in 1/fx² and 1/fy² for every picture.

use crate::board::{Board, View};
use crate::bundle::{BoardState, BundleState};
use crate::homography;
use crate::sheet::SheetShape;
use nalgebra::{Matrix2, Matrix3, Vector2};
use trueline_model::{BrownConrady, Camera};

/// Trial focal lengths, in picture widths, if the pictures do not determine one: from wide to tele.
const TYPICAL_FOCAL_WIDTHS: f64 = 1.2;

/// A state to begin with: a camera, and where each board is. `None` where a picture gives no pose.
#[must_use]
pub(super) fn start(size: [u32; 2], board: &Board, views: &[View]) -> Option<BundleState> {
    let homographies: Option<Vec<Matrix3<f64>>> =
        views.iter().map(|view| homography_of(board, view)).collect();
    let homographies = homographies?;
    let camera = camera(size, &homographies);
    let pose = |h: &Matrix3<f64>| Some(BoardState::flat(homography::pose(h, &camera.focal, &camera.centre)?));
    let boards: Option<Vec<BoardState>> = homographies.iter().map(pose).collect();
    Some(BundleState { camera, laser_plane_in_camera: None, sheet: SheetShape::default(), boards: boards? })
}

/// The homography of a view.
#[must_use]
pub(crate) fn homography_of(board: &Board, view: &View) -> Option<Matrix3<f64>> {
    let on_board: Vec<Vector2<f64>> =
        view.corners.iter().map(|c| board.corner(c.column, c.row).xy()).collect();
    let pixels: Vec<Vector2<f64>> = view.corners.iter().map(|c| c.pixel).collect();
    homography::fit(&on_board, &pixels)
}

fn camera(size: [u32; 2], homographies: &[Matrix3<f64>]) -> Camera {
    let centre = Vector2::new(f64::from(size[0]) - 1.0, f64::from(size[1]) - 1.0) * 0.5;
    let width = f64::from(size[0]);
    let focal = focal_lengths(homographies, &centre, width)
        .unwrap_or_else(|| Vector2::repeat(TYPICAL_FOCAL_WIDTHS * width));
    Camera { size, focal, centre, distortion: BrownConrady::default() }
}

/// Focal lengths by least squares; `None` where the pictures do not show them, as with boards square to the view.
fn focal_lengths(homographies: &[Matrix3<f64>], centre: &Vector2<f64>, width: f64) -> Option<Vector2<f64>> {
    // Pixels from the middle in picture widths, so that both unknowns are near one.
    let to_unit =
        Matrix3::new(1.0 / width, 0.0, -centre.x / width, 0.0, 1.0 / width, -centre.y / width, 0.0, 0.0, 1.0);
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for homography in homographies {
        let h = to_unit * homography;
        // Both columns in one scale; their own length is that of the board's unit and does not matter.
        let size = h.column(0).norm();
        let (a, b) = (h.column(0) / size, h.column(1) / size);
        let (p, m) = (a + b, a - b);
        for (row, value) in [
            (Vector2::new(a.x * b.x, a.y * b.y), -a.z * b.z),
            // h₁ᵀωh₁ − h₂ᵀωh₂ = (h₁ + h₂)ᵀω(h₁ − h₂)
            (Vector2::new(p.x * m.x, p.y * m.y), -p.z * m.z),
        ] {
            normal += row * row.transpose();
            right += row * value;
        }
    }
    let inverse_squares = normal.try_inverse()? * right;
    let focal = inverse_squares.map(|x| width / x.sqrt());
    // Between a fish eye and a telescope; outside of that the equations showed nothing.
    focal.iter().all(|f| *f > 0.2 * width && *f < 50.0 * width).then_some(focal)
}
