//! What the plates' forms make of seam points that are the crossing of straight lines.
//!
//! A detector lays a straight line along each arm of a picture and takes their crossing. Of bowed plates that is beside the seam, by as much
//! in all pictures of one attitude, and the seam points' answer does not know of it. How far it is moved says a fit to the same points
//! without what the forms that the stripes show make of them.

use crate::input::observations::Observations;
use crate::problem::parameters::LINES;
use crate::solve::fit::Fit;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use crate::stripe::frame_residual::{linearize_frame, placement};
use crate::stripe::frames::{Sight, StripeFrame, reported};
use crate::stripe::state::StripeState;
use nalgebra::{Matrix2, SVector, Vector2};

/// By how much the seam points' answer moves without what the plates' forms make of it, in the first unknowns. `None` where they make nothing
/// of any seam point, or nothing fits without it.
pub(crate) fn moved_without_forms(
    (observations, settings): (&Observations, &FitSettings<'_>),
    fit: &Fit,
    frames: &[StripeFrame],
    at: &StripeState,
) -> Option<SVector<f64, LINES>> {
    let mut free = observations.clone();
    let mut any = false;
    for frame in frames {
        let Some((observation, beside_m)) = beside_seam(observations, frame, at) else { continue };
        free.list[observation].point_in_camera -= observations.sheet.axes() * beside_m;
        any = true;
    }
    let solver = Solver { observations: &free, settings: *settings };
    let freed = any.then(|| solver.converge(fit).ok()).flatten()?;
    Some(freed.parameters().minus(&fit.parameters().guess()))
}

/// How far the crossing of straight lines through the predicted stripes lies beside that of the stripes, reported sheet coordinates in m,
/// and which observation it is. `None` where plates do not meet, or are not both seen beside their seam point.
fn beside_seam(
    observations: &Observations,
    frame: &StripeFrame,
    at: &StripeState,
) -> Option<(usize, Vector2<f64>)> {
    let Sight::Stripes([Some(one), Some(other)]) = &frame.sight else { return None };
    let seam = frame.edge.filter(|_| at.joints.get(frame.joint).is_some_and(|joint| joint.edge.is_none()))?;
    let placement = placement(observations, frame.stamp_s, at)?;
    let (stripes, _) = linearize_frame(observations, frame, at, &placement)?;
    let of_seam = StripeFrame { sight: Sight::Seam(seam), ..*frame };
    let (crossing, _) = linearize_frame(observations, &of_seam, at, &placement)?;
    let supports = [reported(one), reported(other)];
    let on_line = |plate: usize, k: usize| {
        let row = 2 * plate + k;
        let normal = stripes.d_reported.fixed_rows::<1>(row).transpose();
        supports[plate][k] - normal * (stripes.residual[row] / normal.norm_squared())
    };
    let [[a, b], [c, d]] = [0, 1].map(|plate| [on_line(plate, 0), on_line(plate, 1)]);
    // a + s (b − a) = c + t (d − c)
    let along = Matrix2::from_columns(&[b - a, c - d]).try_inverse()? * (c - a);
    let of_lines = a + (b - a) * along.x;
    let of_stripes = seam.reported - crossing.residual.fixed_rows::<2>(0);
    Some((seam.observation, of_lines - of_stripes))
}
