//! The plane that most boards' stripes share, found without trusting any of them: what was taken for a stripe on the others was
//! none.

use crate::board::Board;
use crate::bundle_state::BoardState;
use crate::error::Error;
use crate::laser_plane::striped_view::{StripedView, on_board, pose_of};
use crate::stripe_residual::{StripePixel, StripePoint};
use nalgebra::Vector3;
use trueline_geometry::statistics::median;
use trueline_geometry::{Plane, fit};
use trueline_model::Camera;

/// A stripe that is farther off the plane than so many times what is typical is none.
const GROSS: f64 = 10.0;

/// Stripes this near a plane are on it, px.
const NEAR_PX: f64 = 0.1;

/// The boards whose stripes lie on the plane that most of them share, and that plane.
///
/// # Errors
/// A board without a pose, or stripes that all lie on one line.
pub(crate) fn of_most<'a>(
    camera: &Camera,
    board: &Board,
    views: &[&'a StripedView],
) -> Result<(Vec<&'a StripedView>, Plane), Error> {
    let boards: Option<Vec<BoardState>> =
        views.iter().map(|view| pose_of(camera, board, &view.view).map(BoardState::flat)).collect();
    let boards = boards.ok_or(Error::NoPose)?;
    let distances = |plane: &Plane| -> Vec<f64> {
        views.iter().zip(&boards).map(|(view, board)| distance_px(camera, plane, board, view)).collect()
    };
    let typical = |plane: &Plane| median(distances(plane).into_iter()).unwrap_or(f64::INFINITY);
    // A plane through each two boards: the one from which the boards' median is the least.
    let on_boards: Vec<Vec<Vector3<f64>>> = (views.iter().zip(&boards))
        .map(|(view, state)| view.stripe.iter().filter_map(|pixel| on_board(camera, state, pixel)).collect())
        .collect();
    let pairs = (0..views.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let (typical_px, plane) = pairs
        .filter_map(|(i, j)| Some(fit::plane(&[on_boards[i].as_slice(), &on_boards[j]].concat())?.plane))
        .map(|plane| (typical(&plane), plane))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .ok_or(Error::OneLine)?;
    let most_px = GROSS * typical_px.max(NEAR_PX);
    let near = views.iter().zip(distances(&plane)).filter(|(_, px)| *px <= most_px).map(|(view, _)| *view);
    Ok((near.collect(), plane))
}

/// Root mean square distance of a stripe from where a plane would show it on its board, px.
fn distance_px(camera: &Camera, plane: &Plane, board: &BoardState, view: &StripedView) -> f64 {
    let square = |pixel| {
        let pixel = StripePixel { pixel, px_per_m: 1.0, along_m: 0.0 };
        let point = StripePoint::of(camera, plane, board, &pixel)?;
        Some((point.distance_m * point.px_per_m).powi(2))
    };
    let sum: Option<f64> = view.stripe.iter().map(|pixel| square(*pixel)).sum();
    sum.map_or(f64::INFINITY, |sum| (sum / view.stripe.len() as f64).sqrt())
}
