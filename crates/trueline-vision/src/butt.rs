//! The gap of a butt joint: the middle between the ends of the stripe on two plates in one plane.

use crate::detector::{Evidence, Workspace};
use crate::edge::BANDS;
use crate::lap::{edge_point, plate_end};
use crate::line::Line2;
use crate::picture::Level;
use crate::pieces::{Piece, Run};
use crate::seam::{Lengths, MOST_SIGMA_PX, NotFound, Seam};
use nalgebra::{Matrix2, Vector2};

/// The plates are in line to within this, rad in the picture.
const IN_LINE: f64 = 0.05;
/// And to within this beside each other at the gap, px.
const BESIDE_PX: f64 = 12.0;
/// A cut with less than this part of the usual light is dark.
const DARK: f64 = 0.3;
/// Where an end is looked for, px.
const SEARCH_PX: f64 = 30.0;
/// Narrowest gap, px: speckle makes the stripe dark for less.
const NARROWEST_PX: f64 = 5.0;
/// Widest gap, px.
const WIDEST_PX: f64 = 300.0;
/// A second gap of this part of the widest one's width makes it doubtful.
const RIVAL: f64 = 0.6;

/// The ends of two plates, each with a line that leads to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Gap {
    ends: [Line2; 2],
    lengths: [f64; 2],
    sigmas_px: [f64; 2],
    width_px: f64,
}

/// Finds the middle of the gap.
///
/// # Errors
/// Why there is none.
pub fn find<L: Level>(evidence: &Evidence<'_, L>, work: &mut Workspace) -> Result<Seam, NotFound> {
    let lengths = Lengths::of(evidence.lens);
    let pieces = evidence.pieces;
    let mut gaps = Vec::new();
    for (number, first) in pieces.iter().enumerate() {
        gaps.extend(holes(first, &lengths, evidence, work));
        gaps.extend(pieces[number + 1..].iter().filter_map(|second| between(first, second, &lengths)));
    }
    gaps.sort_by(|a, b| b.width_px.total_cmp(&a.width_px));
    let best = *gaps.first().ok_or(match pieces.len() {
        1 => NotFound::OnePiece,
        _ => NotFound::NotThisJoint,
    })?;
    if gaps.get(1).is_some_and(|rival| rival.width_px > RIVAL * best.width_px) {
        return Err(NotFound::Ambiguous);
    }
    let scene = (evidence.picture, evidence.lens);
    let mut points = [(Vector2::zeros(), Matrix2::zeros()); 2];
    let mut quality = 1.0_f64;
    for k in 0..2 {
        let plate = (best.lengths[k], best.sigmas_px[k]);
        // The search for one end must not reach the other plate.
        let search_px = SEARCH_PX.min(0.35 * best.width_px).max(3.0);
        let (edge, fit) = plate_end(&mut work.meter, &best.ends[k], plate, (search_px, [true; BANDS]), scene)?;
        points[k] = edge_point(&fit, &edge);
        quality = quality.min(fit.present);
    }
    middle(evidence, &points, quality)
}

/// Stretches of a piece without light.
fn holes<L: Level>(
    piece: &Piece,
    lengths: &Lengths,
    evidence: &Evidence<'_, L>,
    work: &mut Workspace,
) -> Vec<Gap> {
    let span = piece.span();
    if span[1] - span[0] < lengths.shorter_px + lengths.longer_px {
        return Vec::new();
    }
    let scene = (evidence.picture, evidence.lens);
    let Some((line, template)) = work.meter.learn(&piece.line, span, piece.sigma_px, scene) else {
        return Vec::new();
    };
    let start = line.station(&piece.line.point);
    work.meter.cut(&line, [span[0] + start, span[1] + start], &template, scene);
    let dark = work.meter.dark_stretches(DARK);
    let (first, last) = (span[0] + start, span[1] + start);
    let gaps = dark.into_iter().filter(|[from, to]| {
        to - from > NARROWEST_PX && lengths.suffice([from - first, last - to])
    });
    let turned = Line2 { along: -line.along, ..line };
    gaps.map(|[from, to]| Gap {
        ends: [
            Line2 { point: line.at(from), ..line },
            Line2 { point: line.at(to), ..turned },
        ],
        lengths: [from - first, last - to],
        sigmas_px: [piece.sigma_px; 2],
        width_px: to - from,
    })
    .filter(|gap| gap.width_px < WIDEST_PX)
    .collect()
}

/// The middle in the sheet, where lengths are true.
fn middle<L: Level>(
    evidence: &Evidence<'_, L>,
    [(a, a_covariance), (b, b_covariance)]: &[(Vector2<f64>, Matrix2<f64>); 2],
    quality: f64,
) -> Result<Seam, NotFound> {
    let lens = evidence.lens;
    let ((on_a, _), (on_b, _)) = lens.on_sheet(a).zip(lens.on_sheet(b)).ok_or(NotFound::OutOfView)?;
    let (ideal, _) = lens.from_sheet(&(0.5 * (on_a + on_b))).ok_or(NotFound::OutOfView)?;
    let covariance = 0.25 * (a_covariance + b_covariance);
    if covariance.trace() > MOST_SIGMA_PX.powi(2) {
        return Err(NotFound::Uncertain);
    }
    let seam = Seam::from_ideal(lens, &ideal, &covariance, quality)?;
    Ok(Seam { gap_m: (on_a - on_b).norm(), ..seam })
}

/// The gap between two pieces nearly in line.
fn between(first: &Piece, second: &Piece, lengths: &Lengths) -> Option<Gap> {
    if first.line.along.perp(&second.line.along).abs() > IN_LINE {
        return None;
    }
    let whole = |piece: &Piece| {
        let [from, to] = piece.span();
        Run { span: [from, to], covered_px: piece.covered_px(from, to) }
    };
    let (a, b) = (whole(first), whole(second));
    if !lengths.suffice([a.covered_px, b.covered_px]) {
        return None;
    }
    let found = gap([(first, a), (second, b)]);
    let beside = found.ends[0].distance(&found.ends[1].point).abs();
    let facing = beside < BESIDE_PX && found.ends[0].along.dot(&found.ends[1].along) < 0.0;
    (facing && (NARROWEST_PX..WIDEST_PX).contains(&found.width_px)).then_some(found)
}

/// The gap between two runs: each line is turned towards the other run.
fn gap(runs: [(&Piece, Run); 2]) -> Gap {
    let middle = runs.map(|(piece, run)| piece.line.at(0.5 * (run.span[0] + run.span[1])));
    let end = |k: usize| {
        let (piece, run) = runs[k];
        let forward = piece.line.along.dot(&(middle[1 - k] - middle[k])) > 0.0;
        let (s, along) =
            if forward { (run.span[1], piece.line.along) } else { (run.span[0], -piece.line.along) };
        Line2 { point: piece.line.at(s), along }
    };
    let ends = [end(0), end(1)];
    Gap {
        ends,
        lengths: runs.map(|(_, run)| run.span[1] - run.span[0]),
        sigmas_px: runs.map(|(piece, _)| piece.sigma_px),
        width_px: ends[0].station(&ends[1].point),
    }
}
