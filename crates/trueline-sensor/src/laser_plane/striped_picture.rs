//! Board and stripe in one picture, or in one with and one without the laser.

use crate::board::Board;
use crate::chessboard::{self, NoBoard};
use crate::gray::Gray;
use crate::laser_plane::ground::Ground;
use crate::laser_plane::joint::{StripedView, pose_of};
use crate::laser_plane::stripe;
use nalgebra::Vector2;
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
    let stripe = stripe::find(&shown, camera, &Ground::board(camera, board, &pose));
    if stripe.is_empty() { Err(NoStripe::NoStripe) } else { Ok(StripedView { view, stripe }) }
}

/// Looks for the stripe in a picture of a plain plate.
///
/// # Errors
/// [`NoStripe::NoStripe`].
pub fn on_plate(lit: &Gray, camera: &Camera) -> Result<Vec<Vector2<f64>>, NoStripe> {
    let stripe = stripe::find(lit, camera, &Ground::plate(camera));
    if stripe.is_empty() { Err(NoStripe::NoStripe) } else { Ok(stripe) }
}
