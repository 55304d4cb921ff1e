//! Board and stripe in one picture, or in one with and one without the laser.

use crate::board::{Board, FoundCorner, View};
use crate::chessboard::{self, NoBoard};
use crate::gray::Gray;
use crate::laser_plane::ground::Ground;
use crate::laser_plane::joint::{StripedView, pose_of};
use crate::laser_plane::stripe;
use nalgebra::{Matrix2, Vector2};
use trueline_model::Camera;

/// Why a picture gives nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoStripe {
    /// There is no board.
    #[error(transparent)]
    NoBoard(#[from] NoBoard),
    /// The board is seen, and its pose does not follow.
    #[error("the board's pose cannot be found")]
    NoPose,
    /// The two pictures do not belong together.
    #[error("the picture without laser has another size")]
    OtherSize,
    /// The laser does not meet the board.
    #[error("no stripe")]
    NoStripe,
}

/// A corner is measured by the light within this part of the way to its nearest neighbour, or this many pixels at most
/// (`chessboard`).
const WINDOW_PART: f64 = chessboard::REACH_PART;
const WINDOW_PX: f64 = chessboard::FARTHEST_REACH_PX as f64;

/// So many corners are enough for a pose; with fewer beside the stripe those on it are kept.
const ENOUGH_CORNERS: usize = 12;

/// Looks for board and stripe in a picture with the laser on; the board is looked for without laser where there is such a
/// picture of the same pose.
///
/// # Errors
/// [`NoStripe`].
pub fn look(
    lit: &Gray,
    dark: Option<&Gray>,
    camera: &Camera,
    board: &Board,
) -> Result<StripedView, NoStripe> {
    let view = chessboard::find(dark.unwrap_or(lit), board)?;
    let pose = pose_of(camera, board, &view).ok_or(NoStripe::NoPose)?;
    let shown = match dark {
        Some(dark) => lit.less(dark).ok_or(NoStripe::OtherSize)?,
        None => lit.clone(),
    };
    let ground = Ground::board(camera, board, &pose);
    let stripe = stripe::find(&shown, camera, &ground);
    if stripe.is_empty() {
        return Err(NoStripe::NoStripe);
    }
    let view = if dark.is_some() { view } else { beside(view, &stripe, f64::from(ground.beside_px)) };
    Ok(StripedView { view, stripe })
}

/// The corners in whose windows there is no light of the stripe, which ends `width_px` beside its middle. That light moves a
/// whole row of corners to one side: by less than stands out, and by more than noise moves the board, for it is one error and not
/// one for each corner.
fn beside(view: View, stripe: &[Vector2<f64>], width_px: f64) -> View {
    let is_free = |corner: &FoundCorner| {
        let others = view.corners.iter().filter(|other| *other != corner);
        let nearest_px =
            others.map(|other| (other.pixel - corner.pixel).norm()).fold(f64::INFINITY, f64::min);
        let window_px = (WINDOW_PART * nearest_px).min(WINDOW_PX) + 1.0;
        stripe_distance(stripe, &corner.pixel) > window_px + width_px
    };
    let corners: Vec<FoundCorner> = view.corners.iter().copied().filter(is_free).collect();
    // One row alone leaves the board free to turn about it.
    let first = corners.first().copied();
    let spreads = corners.iter().any(|corner| first.is_some_and(|first| corner.row != first.row))
        && corners.iter().any(|corner| first.is_some_and(|first| corner.column != first.column));
    let enough = spreads && corners.len() >= ENOUGH_CORNERS;
    if enough {
        View { complete: view.complete && corners.len() == view.corners.len(), corners }
    } else {
        view
    }
}

/// From the line of a stripe to a pixel, px. A lens bends the line by less than the window is wide.
fn stripe_distance(stripe: &[Vector2<f64>], pixel: &Vector2<f64>) -> f64 {
    let middle = stripe.iter().sum::<Vector2<f64>>() / stripe.len() as f64;
    let moments: Matrix2<f64> = stripe.iter().map(|p| (p - middle) * (p - middle).transpose()).sum();
    let eigen = moments.symmetric_eigen();
    let along: Vector2<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
    along.perp(&(pixel - middle)).abs()
}

/// Looks for the stripe in a picture of a plain plate.
///
/// # Errors
/// [`NoStripe::NoStripe`].
pub fn on_plate(lit: &Gray, camera: &Camera) -> Result<Vec<Vector2<f64>>, NoStripe> {
    let stripe = stripe::find(lit, camera, &Ground::plate(camera));
    if stripe.is_empty() { Err(NoStripe::NoStripe) } else { Ok(stripe) }
}
