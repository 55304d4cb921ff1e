//! Finds a chessboard of known size in a picture, its corners to a fraction of a pixel.
//!
//! `response` (possible corners) → `edge` (pairs of neighbours) → `grid` (columns and rows) → `saddle` (sub-pixel).

mod edge;
mod grid;
mod response;
mod saddle;

use crate::board::{Board, FoundCorner, View};
use crate::gray::Gray;
use grid::Place;
use nalgebra::Vector2;
use std::collections::BTreeMap;

/// The window of the sub-pixel corner reaches at most this far, px.
pub(crate) const FARTHEST_REACH_PX: i32 = 5;

/// And at most this part of the way to the next corner, so that it sees one corner only.
pub(crate) const REACH_PART: f64 = 0.35;

/// Less than this part of a board is not used.
const LEAST_PART: f64 = 0.5;

/// A line of the grid with less than this part of its corners counts as clutter if the board has fewer lines.
const SPARSE_LINE: f64 = 0.5;

/// Pictures smaller than this along a side are not halved any further, px.
const LEAST_SIDE_PX: usize = 200;

/// Reasons why there is no board.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoBoard {
    /// Nothing like a board.
    #[error("no board is visible")]
    Nothing,
    /// A part of the board.
    #[error("only {found} of {expected} corners are visible")]
    TooFew {
        /// Corners found.
        found: usize,
        /// Corners of the board.
        expected: usize,
    },
    /// A board of another size.
    #[error(
        "the board has {columns} x {rows} inner corners or more, not {expected_columns} x {expected_rows}"
    )]
    OtherSize {
        /// Columns found.
        columns: usize,
        /// Rows found.
        rows: usize,
        /// Columns of the stated board.
        expected_columns: usize,
        /// Rows of the stated board.
        expected_rows: usize,
    },
    /// The board where another picture has it.
    #[error("it shows the board at the same place as {of}: a repeated picture adds no information")]
    Repeated {
        /// The other picture.
        of: String,
    },
}

/// Finds the board. Large or blurred pictures are searched in smaller versions too; the corners are always measured in
/// the picture itself.
///
/// # Errors
/// The reason why there is no board; of several sizes of picture, that with the most corners.
pub fn find(picture: &Gray, board: &Board) -> Result<View, NoBoard> {
    let mut best: Result<View, NoBoard> = Err(NoBoard::Nothing);
    let (mut level, mut scale) = (picture.clone(), 1.0);
    loop {
        let found = find_in(picture, &level, scale, board);
        match (&found, &best) {
            (Ok(view), _) if view.complete => return found,
            (Ok(view), Ok(other)) if view.corners.len() <= other.corners.len() => {}
            (Err(_), Ok(_)) | (Err(NoBoard::Nothing), Err(_)) => {}
            _ => best = found,
        }
        let Some(smaller) = level.halved().filter(|s| s.width().min(s.height()) >= LEAST_SIDE_PX) else {
            return best;
        };
        level = smaller;
        scale *= 2.0;
    }
}

/// Finds the board in a picture that is `scale` times smaller, and measures its corners in the picture itself.
fn find_in(picture: &Gray, level: &Gray, scale: f64, board: &Board) -> Result<View, NoBoard> {
    let rough = response::candidates(level);
    let places = grid::largest(level, &rough);
    if places.len() < 4 {
        return Err(NoBoard::Nothing);
    }
    let lines = Lines::within(&places, board)?;
    let in_picture: BTreeMap<Place, Vector2<f64>> = places
        .iter()
        .filter(|(place, _)| lines.holds(**place))
        .map(|(place, index)| (*place, rough[*index] * scale + Vector2::repeat(0.5 * (scale - 1.0))))
        .collect();
    let mut corners = Vec::new();
    for (place, pixel) in &in_picture {
        let reach = reach(&in_picture, *place, pixel);
        // A halved picture places its corners to two of these pixels: first a window that is wide enough for that.
        let Some(refined) = saddle::refine(picture, pixel, reach.max(scale as i32 + 2))
            .and_then(|near| saddle::refine(picture, &near, reach))
        else {
            continue;
        };
        let (column, row) = lines.place_on_board(*place);
        corners.push(FoundCorner { column, row, pixel: refined });
    }
    corners.sort_by_key(|corner| (corner.row, corner.column));
    let expected = board.corners();
    if (corners.len() as f64) < LEAST_PART * expected as f64 {
        return Err(NoBoard::TooFew { found: corners.len(), expected });
    }
    Ok(View { complete: corners.len() == expected, corners })
}

/// How far the window around a corner may reach.
fn reach(corners: &BTreeMap<Place, Vector2<f64>>, (i, j): Place, pixel: &Vector2<f64>) -> i32 {
    let neighbours = [(i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)];
    let nearest = neighbours
        .iter()
        .filter_map(|place| corners.get(place))
        .map(|other| (other - pixel).norm())
        .fold(f64::INFINITY, f64::min);
    ((REACH_PART * nearest) as i32).clamp(2, FARTHEST_REACH_PX)
}

/// Which lines of the grid are the board's.
struct Lines {
    first: Place,
    last: Place,
    /// The grid's first direction is the board's second.
    transposed: bool,
    /// The last row of the grid, counted from the first. Rows are counted from there if directions are swapped, so
    /// that the board is not mirrored.
    rows_span: i32,
}

impl Lines {
    fn within(places: &BTreeMap<Place, usize>, board: &Board) -> Result<Self, NoBoard> {
        let mut first = (i32::MAX, i32::MAX);
        let mut last = (i32::MIN, i32::MIN);
        for (i, j) in places.keys() {
            first = (first.0.min(*i), first.1.min(*j));
            last = (last.0.max(*i), last.1.max(*j));
        }
        let wanted = (board.columns as i32, board.rows as i32);
        loop {
            let spans = (last.0 - first.0 + 1, last.1 - first.1 + 1);
            let upright = spans.0 <= wanted.0 && spans.1 <= wanted.1;
            let lying = spans.0 <= wanted.1 && spans.1 <= wanted.0;
            if upright || lying {
                return Ok(Self { first, last, transposed: !upright, rows_span: spans.0 - 1 });
            }
            if !drop_sparsest(places, &mut first, &mut last) {
                return Err(NoBoard::OtherSize {
                    columns: spans.0.max(spans.1) as usize,
                    rows: spans.0.min(spans.1) as usize,
                    expected_columns: board.columns,
                    expected_rows: board.rows,
                });
            }
        }
    }

    fn holds(&self, (i, j): Place) -> bool {
        (self.first.0..=self.last.0).contains(&i) && (self.first.1..=self.last.1).contains(&j)
    }

    /// Column and row on the board. The grid turns as pictures do, from u to v; swapping two directions alone would
    /// mirror it, so one of them is reversed.
    fn place_on_board(&self, (i, j): Place) -> (usize, usize) {
        let (a, b) = (i - self.first.0, j - self.first.1);
        if self.transposed { (b as usize, (self.rows_span - a) as usize) } else { (a as usize, b as usize) }
    }
}

/// Drops the emptiest outer line of a grid that is too large; false if no outer line is sparse.
fn drop_sparsest(places: &BTreeMap<Place, usize>, first: &mut Place, last: &mut Place) -> bool {
    let inside = |(i, j): &Place| (first.0..=last.0).contains(i) && (first.1..=last.1).contains(j);
    let part = |on_line: &dyn Fn(&Place) -> bool, length: i32| {
        places.keys().filter(|p| inside(p) && on_line(p)).count() as f64 / f64::from(length)
    };
    let (columns, rows) = (last.0 - first.0 + 1, last.1 - first.1 + 1);
    let (f, l) = (*first, *last);
    let parts = [
        part(&|p| p.0 == f.0, rows),
        part(&|p| p.0 == l.0, rows),
        part(&|p| p.1 == f.1, columns),
        part(&|p| p.1 == l.1, columns),
    ];
    let Some((line, least)) = parts.iter().copied().enumerate().min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return false;
    };
    if least >= SPARSE_LINE {
        return false;
    }
    match line {
        0 => first.0 += 1,
        1 => last.0 -= 1,
        2 => first.1 += 1,
        _ => last.1 -= 1,
    }
    true
}
