//! The laser plane from pictures of a board: which of the bright lines are the laser's, and the joint fit to these.
//!
//! The lines are chosen twice. First with a plane through the flat boards; bent sheets move a stripe from it by some pixels.
//! Then with the joint fit's plane, camera and sheet; the stripe lies off these by its noise only.

use crate::board::{Board, View};
use crate::bundle_state::BoardState;
use crate::error::Error;
use crate::laser_plane::joint::{JointFit, fit_joint};
use crate::laser_plane::known_camera::KnownCamera;
use crate::laser_plane::seen_boards::{self, SeenBoards};
use crate::laser_plane::shared_plane::{self, GROSS, HALF_PX, NEAR_PX};
use crate::laser_plane::striped_picture::{BoardPicture, NoStripe, beside};
use crate::laser_plane::striped_view::StripedView;
use crate::stripe_residual::{Sheet, StripePixel, StripePoint};
use nalgebra::Vector2;
use trueline_geometry::Plane;
use trueline_geometry::statistics::median;
use trueline_model::Camera;
use trueline_vision::pieces::StripePiece;

/// A scale is fine enough if it shows this part of the longest stripe: the finest of these measures best.
const WHOLE: f64 = 0.8;

/// Pieces with less than this part at the stripe's predicted place cross it.
const ALONG: f64 = 0.5;

/// A stripe of fewer pixels has no information.
const FEWEST_PIXELS: usize = 8;

/// A laser plane from pictures, and the result of each.
#[derive(Clone, Debug)]
pub struct PicturesFit {
    /// The fit.
    pub fit: JointFit,
    /// Data of the fit: corners and stripe of the pictures with a stripe in the plane of most, by their places.
    pub views: Vec<(usize, StripedView)>,
    /// For each picture, whether its stripe counts, and if not why.
    pub pictures: Vec<Result<(), NoStripe>>,
}

/// Fits the plane to the pictures of a board.
///
/// # Errors
/// Too few pictures with a stripe in one plane, or stripes that fix no plane.
pub fn fit_pictures(
    known: &KnownCamera,
    board: &Board,
    pictures: &[BoardPicture],
) -> Result<PicturesFit, Error> {
    if pictures.len() < super::FEWEST_BOARDS {
        return Err(Error::TooFewBoards { found: pictures.len(), needed: super::FEWEST_BOARDS });
    }
    let corners: Vec<&View> = pictures.iter().map(|picture| &picture.view).collect();
    let seen = seen_boards::of_corners(known, board, &corners)?;
    let plane = shared_plane::of_pieces(&known.camera, board, &seen, pictures)?;
    let begin = Sight { camera: known.camera, plane, board: *board, seen };
    let (views, _) = begin.chosen(pictures)?;
    let rough = fit_joint(known, board, &views)?;
    let plane = rough.plane().ok_or(Error::OneLine)?;
    let clear = begin.corners_clear_of_stripe(pictures);
    let clear: Vec<&View> = clear.iter().collect();
    let seen = seen_boards::at(&rough.state.camera, board, rough.state.sheet, &clear)?;
    let better = Sight { camera: rough.state.camera, plane, seen, ..begin };
    let (views, numbers) = better.chosen(pictures)?;
    let fit = fit_joint(known, board, &views)?;
    let counting: Vec<usize> = fit.counting.iter().map(|k| numbers[*k]).collect();
    let of_picture = |(k, picture): (usize, &BoardPicture)| {
        if counting.contains(&k) { Ok(()) } else { Err(NoStripe::among(&picture.pieces)) }
    };
    let of_pictures = pictures.iter().enumerate().map(of_picture).collect();
    Ok(PicturesFit { views: numbers.into_iter().zip(views).collect(), pictures: of_pictures, fit })
}

/// Predicted place of the stripe.
struct Sight {
    camera: Camera,
    plane: Plane,
    board: Board,
    seen: SeenBoards,
}

impl Sight {
    /// The pictures with the stripe that each shows, and their numbers.
    fn chosen(&self, pictures: &[BoardPicture]) -> Result<(Vec<StripedView>, Vec<usize>), Error> {
        let off: Vec<Vec<Vec<f64>>> =
            pictures.iter().zip(&self.seen.boards).map(|(picture, at)| self.off_px(picture, at)).collect();
        let best =
            pictures.iter().zip(&off).filter_map(|(picture, off)| Some(likeliest(&picture.pieces, off)?.1));
        let most_px = GROSS * median(best).unwrap_or(f64::INFINITY).max(NEAR_PX);
        let (mut views, mut numbers) = (Vec::new(), Vec::new());
        for (number, (picture, off)) in pictures.iter().zip(&off).enumerate() {
            if let Some(view) = striped(picture, off, most_px) {
                views.push(view);
                numbers.push(number);
            }
        }
        if views.len() < super::FEWEST_BOARDS {
            return Err(Error::NoCommonPlane { found: views.len(), needed: super::FEWEST_BOARDS });
        }
        Ok((views, numbers))
    }

    /// The corners of each picture without those that its likeliest stripe displaces.
    fn corners_clear_of_stripe(&self, pictures: &[BoardPicture]) -> Vec<View> {
        let of_picture = |(picture, at): (&BoardPicture, &BoardState)| {
            let off = self.off_px(picture, at);
            match likeliest(&picture.pieces, &off) {
                Some((piece, _)) if !picture.is_dark => beside(&picture.view, &piece.pixels, piece.width_px),
                _ => picture.view.clone(),
            }
        };
        pictures.iter().zip(&self.seen.boards).map(of_picture).collect()
    }

    /// For each piece and pixel of a picture, how far it lies from where the plane shows the stripe, px.
    fn off_px(&self, picture: &BoardPicture, at: &BoardState) -> Vec<Vec<f64>> {
        let of_piece =
            |piece: &StripePiece| piece.pixels.iter().map(|pixel| self.off_pixel_px(at, pixel)).collect();
        picture.pieces.iter().map(of_piece).collect()
    }

    fn off_pixel_px(&self, at: &BoardState, pixel: &Vector2<f64>) -> f64 {
        let sheet = Sheet { board: &self.board, shape: &self.seen.sheet };
        let stripe = StripePixel { pixel: *pixel, px_per_m: 1.0, along_m: 0.0 };
        StripePoint::of(&self.camera, &self.plane, (at, sheet), &stripe)
            .map_or(f64::INFINITY, |point| (point.distance_m * point.px_per_m).abs())
    }
}

/// The piece of a picture that is worth most as the stripe, and its typical distance from where the plane shows it, px.
fn likeliest<'a>(pieces: &'a [StripePiece], off: &[Vec<f64>]) -> Option<(&'a StripePiece, f64)> {
    let typical = pieces.iter().zip(off).filter_map(|(piece, off)| {
        let off_px = median(off.iter().copied())?;
        let worth = piece.length_px * piece.contrast / (1.0 + (off_px / HALF_PX).powi(2));
        Some((worth, piece, off_px))
    });
    let most = typical.max_by(|a, b| a.0.total_cmp(&b.0));
    most.map(|(_, piece, off_px)| (piece, off_px))
}

/// A picture's stripe: all pixels near its predicted place, of the finest scale that shows most of it.
fn striped(picture: &BoardPicture, off: &[Vec<f64>], most_px: f64) -> Option<StripedView> {
    let near: Vec<(&StripePiece, Vec<Vector2<f64>>)> = picture
        .pieces
        .iter()
        .zip(off)
        .map(|(piece, off)| {
            let pixels = piece.pixels.iter().zip(off).filter(|(_, off_px)| **off_px <= most_px);
            (piece, pixels.map(|(pixel, _)| *pixel).collect::<Vec<_>>())
        })
        .filter(|(piece, pixels)| pixels.len() as f64 >= ALONG * piece.pixels.len() as f64)
        .collect();
    let length_px = |factor: usize| {
        let of_factor = near.iter().filter(|(piece, _)| piece.factor == factor);
        of_factor.map(|(_, pixels)| (pixels.len() * factor) as f64).sum::<f64>()
    };
    let factors = || near.iter().map(|(piece, _)| piece.factor);
    let longest_px = factors().map(length_px).fold(0.0, f64::max);
    let factor = factors().filter(|factor| length_px(*factor) >= WHOLE * longest_px).min()?;
    let of_factor = || near.iter().filter(|(piece, _)| piece.factor == factor);
    let stripe: Vec<Vector2<f64>> = of_factor().flat_map(|(_, pixels)| pixels).copied().collect();
    if stripe.len() < FEWEST_PIXELS {
        return None;
    }
    let width_px = of_factor().map(|(piece, _)| piece.width_px).fold(0.0, f64::max);
    let view = if picture.is_dark { picture.view.clone() } else { beside(&picture.view, &stripe, width_px) };
    Some(StripedView { view, stripe })
}
