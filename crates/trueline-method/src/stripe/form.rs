//! Form of the plates along the seam beyond their surface terms: hat functions in the height of each surface, of the size of the seam's own form.
//!
//! The seam is where two surfaces meet, so a form of the seam is one of the surfaces. Their own seven terms follow a bend of the whole plate. Heat and
//! tacks bend it within a few centimetres.

use crate::adjustment::form::Hats;
use crate::stripe::fit::StripeFit;
use crate::stripe::frame_residual::{EDGE_ROW, FrameGradients, ROWS, linearize_frame};
use crate::stripe::frames::{Sight, StripeFrame};
use crate::stripe::state::StripeState;
use crate::stripe::systematic::{MOST_FRAMES, Moved, with_shape};
use crate::stripe::unknowns::{OFFSET_OF_PLANE, local_of_surface};
use crate::stripe::weighed_frame::WeighedFrame;
use crate::thinning::stride;
use nalgebra::{DMatrix, Vector2};
use trueline_lsq::Information;
use trueline_model::Placement;

/// Spacing of the hats, m.
const APART_M: f64 = 0.020;

/// Effect of forms on the estimate, in columns of unit variance: of each joint, by surface and hat. The directions of a seam's form are the heights
/// of its surfaces, with `sigma_m` for each.
#[must_use]
pub(crate) fn effect(fit: &StripeFit<'_>, information: &Information, sigma_m: f64) -> DMatrix<f64> {
    let root = information.covariance_root();
    let none = DMatrix::zeros(root.nrows(), 0);
    if sigma_m <= 0.0 {
        return none;
    }
    let (problem, at) = (&fit.problem, with_shape(fit));
    let every = stride(problem.frames.len(), MOST_FRAMES);
    let seen = problem.frames.iter().step_by(every).filter_map(|weighed| {
        let placement = weighed.placement(problem.observations, &at)?;
        let along_m = along_m(fit, &weighed.frame, &at, &placement);
        Some(Seen { weighed, placement, along_m })
    });
    let seen: Vec<Seen<'_>> = seen.collect();
    let of_joints = (0..at.joints.len()).map(|joint| {
        let of_joint: Vec<&Seen<'_>> = seen.iter().filter(|seen| seen.weighed.frame.joint == joint).collect();
        let Some(hats) = hats(&of_joint, at.joints.len()) else { return none.clone() };
        let surfaces = problem.unknowns.surfaces();
        let mut moved = Moved::zeros(&problem.unknowns, surfaces * hats.count);
        for seen in of_joint {
            let weighed = seen.weighed;
            let linearized = linearize_frame(problem.observations, &weighed.frame, &at, &seen.placement);
            let Some((_, gradients)) = linearized else { continue };
            let mut whitened = DMatrix::zeros(ROWS, surfaces * hats.count);
            let columns = columns(&gradients, &seen.along_m, (&hats, surfaces));
            whitened.copy_from(&(weighed.whitener * columns * sigma_m));
            moved.add(joint, &(gradients * weighed.whitener.transpose()), &whitened);
        }
        moved.over_all(&problem.unknowns) * every as f64
    });
    let sums: Vec<DMatrix<f64>> = of_joints.collect();
    let mut all = none.resize_horizontally(sums.iter().map(DMatrix::ncols).sum(), 0.0);
    let mut first = 0;
    for sum in sums {
        all.columns_mut(first, sum.ncols()).copy_from(&-(root * (root.transpose() * &sum)));
        first += sum.ncols();
    }
    all
}

/// A frame with the place of each of its rows along the seam, m.
struct Seen<'a> {
    weighed: &'a WeighedFrame,
    placement: Placement,
    along_m: [f64; ROWS],
}

/// Hats over the places of a joint's rows. `None` without rows.
fn hats(of_joint: &[&Seen<'_>], joints: usize) -> Option<Hats> {
    let places = || of_joint.iter().flat_map(|seen| seen.along_m);
    let (from, to) = (places().fold(f64::INFINITY, f64::min), places().fold(f64::NEG_INFINITY, f64::max));
    (from < to).then(|| Hats::over([from, to], APART_M, joints))
}

/// Place of the points of a frame along its seam, by row. A row without a point has that of another.
fn along_m(fit: &StripeFit<'_>, frame: &StripeFrame, at: &StripeState, placement: &Placement) -> [f64; ROWS] {
    let (sheet, chart) = (&fit.problem.observations.sheet, &at.joints[frame.joint].plates[0].chart);
    let place = |reported: &Vector2<f64>| {
        let there = at.shape.map_or(*reported, |shape| shape.corrected(reported).0);
        chart.along.dot(&(placement.point_in_base(&sheet.point(&there)) - chart.centre))
    };
    match &frame.sight {
        Sight::Seam(seam) => [place(&seam.reported); ROWS],
        Sight::Stripes(stripes) => {
            let places = |plate: usize| Some(stripes[plate]?.map(|support| place(&support.reported)));
            let own = [places(0), places(1)];
            let other = own[0].or(own[1]).unwrap_or_default();
            let [[a, b], [c, d]] = own.map(|own| own.unwrap_or(other));
            let mut all = [a, b, c, d, a];
            if let Some(edge) = &frame.edge {
                all[EDGE_ROW] = place(&edge.reported);
            }
            all
        }
    }
}

/// Residuals of a frame by the height of each surface at each hat, before whitening. A form moves a surface as its offset does.
fn columns(
    gradients: &FrameGradients,
    along_m: &[f64; ROWS],
    (hats, surfaces): (&Hats, usize),
) -> DMatrix<f64> {
    let mut columns = DMatrix::zeros(ROWS, surfaces * hats.count);
    for (row, place_m) in along_m.iter().enumerate() {
        let (first, parts) = hats.at(*place_m);
        for surface in 0..surfaces {
            let by_offset = gradients[(local_of_surface(surface)[0] + OFFSET_OF_PLANE, row)];
            for (k, part) in parts.iter().enumerate().filter(|(k, _)| first + k < hats.count) {
                columns[(row, surface * hats.count + first + k)] = by_offset * part;
            }
        }
    }
    columns
}
