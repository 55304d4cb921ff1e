//! Whether the stripes show a robot as bad as the seam points seem to.
//!
//! A seam that is not straight and a robot that wanders move seam points alike. Stripes tell them apart: plates have the forms that
//! [`crate::stripe::state::SURFACE_SIGMA_M`] allows them, and what these take up is left to nobody.

use crate::assess::robot_accuracy::{SAMPLE, Scores, modes};
use crate::assess::robot_field::RobotSigmas;
use crate::assess::row_products::RowProducts;
use crate::stripe::fit::StripeFit;
use crate::stripe::problem::{ROWS, linearize_frame};
use crate::stripe::systematic::robot_columns;
use nalgebra::DVectorViewMut;
use trueline_geometry::Pose;
use trueline_lsq::{Information, NormalEquations};

/// The errors that the residuals of the stripes show, as for seam points; `None` where they are not plainly larger than those that were
/// taken.
#[must_use]
pub(crate) fn shown(
    fit: &StripeFit<'_>,
    information: &Information,
    taken: RobotSigmas,
) -> Option<RobotSigmas> {
    let (problem, at) = (&fit.problem, fit.state());
    let every = problem.frames.len().div_ceil(SAMPLE).max(1);
    let mut hint = 0;
    let placed: Vec<_> = problem
        .frames
        .iter()
        .step_by(every)
        .filter_map(|weighed| Some((weighed, weighed.placement(problem.observations, at, &mut hint)?)))
        .collect();
    let poses: Vec<Pose> = placed.iter().map(|(_, placement)| placement.base_from_tool).collect();
    let field = modes(&poses)?;
    let root_rows = information.covariance_root().transpose();
    let (modes, unknowns) = (6 * field.modes(), root_rows.nrows());
    let mut products = RowProducts::new(modes + unknowns + 1);
    for (weighed, placement) in &placed {
        let Some(parts) = linearize_frame(problem.observations, &weighed.frame, at, placement) else {
            continue;
        };
        let columns = robot_columns(&field, weighed, &parts, placement);
        let residual = weighed.whitener * (parts.residual + weighed.pose_error.in_residual);
        let jacobian = weighed.whitener * parts.jacobian;
        for row in 0..ROWS {
            let (of_modes, rest) = products.next_row().split_at_mut(modes);
            of_modes.copy_from_slice(columns.row(row).transpose().as_slice());
            let (slopes, last) = rest.split_at_mut(unknowns);
            slopes.fill(0.0);
            let mut slopes = DVectorViewMut::from_slice(slopes, unknowns);
            for local in 0..problem.unknowns.local() {
                let Some(place) = problem.unknowns.place(local, weighed.frame.joint) else { continue };
                slopes.axpy(jacobian[(row, local)], &root_rows.column(place), 1.0);
            }
            last[0] = residual[row];
        }
    }
    let mut known = NormalEquations::zeros(problem.unknowns.dimension());
    known.hessian = at.prior_information(problem.shape_prior.as_ref());
    known.gradient = &known.hessian * at.about_prior();
    Scores::from_products(&products.sums(), modes, known, &root_rows)?.shown(taken)
}
