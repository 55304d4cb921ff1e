//! Board and stripe in one picture, or in one with and one without the laser.

use crate::board::{Board, FoundCorner, View};
use crate::chessboard::{self, NoBoard};
use crate::gray::Gray;
use crate::laser_plane::ground::{Ground, StripeOn};
use crate::laser_plane::striped_view::pose_of;
use nalgebra::{Matrix2, Vector2};
use trueline_model::Camera;
use trueline_vision::pieces::{PieceFinder, StripePiece};
use trueline_vision::{Picture, PictureRegion};

/// A straight bright line of a picture: its appearance and its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Width at half of its height, px.
    pub width_px: f64,
    /// Length, px.
    pub length_px: f64,
    /// Column and row of its middle, px.
    pub middle_px: [f64; 2],
}

impl Seen {
    fn of(piece: &StripePiece) -> Self {
        let [first, last] =
            [piece.pixels.first(), piece.pixels.last()].map(|p| p.copied().unwrap_or_default());
        Self {
            width_px: piece.width_px,
            length_px: piece.length_px,
            middle_px: ((first + last) * 0.5).into(),
        }
    }
}

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
    /// No piece of a stripe.
    #[error("no stripe: no straight line clear of printed edges is brighter than both of its sides")]
    Nothing,
    /// The bright line is not the laser's.
    #[error(
        "no stripe: the clearest bright line, {:.1} px wide and {:.0} px long at column {:.0}, row {:.0}, is not in the laser plane of \
         the other pictures", seen.width_px, seen.length_px, seen.middle_px[0], seen.middle_px[1]
    )]
    Elsewhere {
        /// The clearest line of the picture.
        seen: Seen,
    },
}

impl NoStripe {
    /// From a picture without the laser's line.
    pub(crate) fn among(pieces: &[StripePiece]) -> Self {
        clearest(pieces).map_or(Self::Nothing, |piece| Self::Elsewhere { seen: Seen::of(piece) })
    }
}

/// A board, and all in its picture that may be the stripe.
#[derive(Clone, Debug)]
pub struct BoardPicture {
    /// Its corners.
    pub view: View,
    /// Straight bright lines, in no order.
    pub pieces: Vec<StripePiece>,
    /// Whether the corners are of a picture without laser.
    pub is_dark: bool,
}

/// A corner is measured by the light within this part of the way to its nearest neighbour, or this many pixels at most
/// (`chessboard`).
const WINDOW_PART: f64 = chessboard::REACH_PART;
const WINDOW_PX: f64 = chessboard::FARTHEST_REACH_PX as f64;

/// This many corners are enough for a pose; with fewer beside the stripe those on it are kept.
const ENOUGH_CORNERS: usize = 12;

/// Pieces of a stripe on one plate lie this near to one line, as a part of its width, or px.
const ON_LINE_PART: f64 = 0.5;
const ON_LINE_PX: f64 = 2.0;

/// A piece with fewer middles has no information.
const FEWEST_MIDDLES: usize = 8;

/// A piece is believed where its middles scatter by less than this part of its width.
const MOST_SCATTER: f64 = 0.25;

/// Searches the board and all possible stripes in a picture with the laser on. The board is searched in a picture without
/// laser if there is one of the same pose.
///
/// # Errors
/// [`NoStripe`], if there is no board or no line at all.
pub fn look(
    lit: &Gray,
    dark: Option<&Gray>,
    camera: &Camera,
    (board, on): (&Board, StripeOn),
) -> Result<BoardPicture, NoStripe> {
    let view = chessboard::find(dark.unwrap_or(lit), board)?;
    let pose = pose_of(camera, board, &view).ok_or(NoStripe::NoPose)?;
    let shown = match dark {
        Some(dark) => lit.less(dark).ok_or(NoStripe::OtherSize)?,
        None => lit.clone(),
    };
    let pieces = pieces(&shown, camera, &Ground::board(camera, board, &pose, on));
    if pieces.is_empty() {
        return Err(NoStripe::Nothing);
    }
    Ok(BoardPicture { view, pieces, is_dark: dark.is_some() })
}

/// All straight bright lines on a ground.
#[must_use]
pub fn pieces(picture: &Gray, camera: &Camera, ground: &Ground) -> Vec<StripePiece> {
    let (levels, levels_per_step) = picture.steps();
    let (width, height) = (picture.width(), picture.height());
    let whole = PictureRegion::rectangle([-1.0, width as f64], [-1.0, height as f64]);
    let (Some(picture), Some(whole)) = (Picture::new(width, height, &levels), whole) else {
        return Vec::new();
    };
    let mut pieces = PieceFinder::new(camera).find(&picture, &whole, ground);
    pieces.retain(|piece| {
        piece.pixels.len() >= FEWEST_MIDDLES && piece.sigma_px < MOST_SCATTER * piece.width_px
    });
    for piece in &mut pieces {
        piece.contrast *= levels_per_step;
    }
    pieces
}

/// The piece with the most light.
fn clearest(pieces: &[StripePiece]) -> Option<&StripePiece> {
    pieces.iter().max_by(|a, b| (a.length_px * a.contrast).total_cmp(&(b.length_px * b.contrast)))
}

/// The corners without light of the stripe in their windows; the stripe ends `width_px` beside its middle. The stripe's
/// light moves a whole row of corners to one side. The shift is smaller than an outlier, but larger than the board's noise,
/// because it is one error and not one for each corner.
pub(crate) fn beside(view: &View, stripe: &[Vector2<f64>], width_px: f64) -> View {
    let Some(line) = PixelLine::through(stripe) else { return view.clone() };
    // A bent sheet bends the stripe.
    let bow_px = stripe.iter().map(|pixel| line.distance(pixel)).fold(0.0, f64::max);
    let is_free = |corner: &FoundCorner| {
        let others = view.corners.iter().filter(|other| *other != corner);
        let nearest_px =
            others.map(|other| (other.pixel - corner.pixel).norm()).fold(f64::INFINITY, f64::min);
        let window_px = (WINDOW_PART * nearest_px).min(WINDOW_PX) + 1.0;
        line.distance(&corner.pixel) > window_px + width_px + bow_px
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
        view.clone()
    }
}

/// A straight line through pixels.
struct PixelLine {
    middle: Vector2<f64>,
    along: Vector2<f64>,
}

impl PixelLine {
    fn through(pixels: &[Vector2<f64>]) -> Option<Self> {
        if pixels.is_empty() {
            return None;
        }
        let middle = pixels.iter().sum::<Vector2<f64>>() / pixels.len() as f64;
        let moments: Matrix2<f64> = pixels.iter().map(|p| (p - middle) * (p - middle).transpose()).sum();
        let eigen = moments.symmetric_eigen();
        Some(Self { middle, along: eigen.eigenvectors.column(eigen.eigenvalues.imax()).into() })
    }

    /// From the line to a pixel, px.
    fn distance(&self, pixel: &Vector2<f64>) -> f64 {
        self.along.perp(&(pixel - self.middle)).abs()
    }
}

/// Finds the stripe in a picture of a plain plate: the clearest line, and its continuation.
///
/// # Errors
/// [`NoStripe::Nothing`].
pub fn on_plate(lit: &Gray, camera: &Camera) -> Result<Vec<Vector2<f64>>, NoStripe> {
    let pieces = pieces(lit, camera, &Ground::plate(camera));
    let best = clearest(&pieces).ok_or(NoStripe::Nothing)?;
    // A lens bends the line: it is straight in the ideal picture.
    let ideal = |pixel: &Vector2<f64>| Some(camera.ray(pixel).ok()?.0.xy().component_mul(&camera.focal));
    let of = |piece: &StripePiece| piece.pixels.iter().filter_map(ideal).collect::<Vec<_>>();
    let line = PixelLine::through(&of(best)).ok_or(NoStripe::Nothing)?;
    let most_px = (ON_LINE_PART * best.width_px).max(ON_LINE_PX);
    let is_on = |piece: &&StripePiece| {
        piece.factor == best.factor && of(piece).iter().all(|pixel| line.distance(pixel) < most_px)
    };
    let mut stripe = best.pixels.clone();
    for piece in pieces.iter().filter(is_on).filter(|piece| *piece != best) {
        stripe.extend_from_slice(&piece.pixels);
    }
    Ok(stripe)
}
