//! Tests whether the stripes confirm the robot errors that the seam points seem to show.
//!
//! A curved seam and robot errors move seam points alike. Stripes separate them: the plates' forms are estimated with the prior
//! [`crate::stripe::state::SURFACE_SIGMA_M`], and only the remainder is attributed to the robot.

use crate::assess::robot_accuracy::{MOST_OBSERVATIONS, Scores, modes};
use crate::assess::robot_field::RobotSigmas;
use crate::problem::layout::Layout;
use crate::problem::row_products::RowProducts;
use crate::stripe::fit::StripeFit;
use crate::stripe::frame_residual::{ROWS, linearize_frame};
use crate::stripe::systematic::robot_columns;
use crate::thinning::stride;
use nalgebra::DVectorViewMut;
use trueline_geometry::Pose;
use trueline_lsq::Information;

/// Robot errors estimated from the stripes' residuals, as for seam points. `None` unless they are clearly larger than the assumed ones.
#[must_use]
pub(crate) fn shown(
    fit: &StripeFit<'_>,
    information: &Information,
    taken: RobotSigmas,
) -> Option<RobotSigmas> {
    scores(fit, information)?.shown(taken)
}

fn scores(fit: &StripeFit<'_>, information: &Information) -> Option<Scores> {
    let (problem, at) = (&fit.problem, fit.state());
    let every = stride(problem.frames.len(), MOST_OBSERVATIONS);
    let placed: Vec<_> = problem
        .frames
        .iter()
        .step_by(every)
        .filter_map(|weighed| Some((weighed, weighed.placement(problem.observations, at)?)))
        .collect();
    let poses: Vec<Pose> = placed.iter().map(|(_, placement)| placement.base_from_tool).collect();
    let field = modes(&poses)?;
    let root_rows = information.covariance_root().transpose();
    let (modes, unknowns) = (6 * field.modes(), root_rows.nrows());
    let mut products = RowProducts::new(modes + unknowns + 1);
    for (weighed, placement) in &placed {
        let Some(linearized) = linearize_frame(problem.observations, &weighed.frame, at, placement) else {
            continue;
        };
        let columns = robot_columns(&field, weighed, &linearized.0, placement);
        let (residual, gradients) = weighed.whitened(&linearized);
        for row in 0..ROWS {
            let (of_modes, rest) = products.next_row().split_at_mut(modes);
            of_modes.copy_from_slice(columns.row(row).transpose().as_slice());
            let (slopes, last) = rest.split_at_mut(unknowns);
            slopes.fill(0.0);
            let mut slopes = DVectorViewMut::from_slice(slopes, unknowns);
            let by_local = gradients.column(row);
            let joint = weighed.frame.joint;
            problem.unknowns.add_in_root(joint, (by_local.as_slice(), 1.0), &root_rows, &mut slopes);
            last[0] = residual[row];
        }
    }
    Scores::from_products(&products.sums(), modes, problem.known_beforehand(at), &root_rows)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::assess::observability::RANK_THRESHOLD;
    use crate::config::{Config, Measurements};
    use crate::input::noise_levels::NoiseLevels;
    use crate::input::observations::{observe, origin_ns};
    use crate::input::timestamps::Sampling;
    use crate::problem::parameters::Parameters;
    use crate::stripe::fit::StripeSolver;
    use crate::stripe::frames::frames;
    use crate::stripe::start;
    use crate::stripe::whitening::SharedNoise;
    use trueline_sim::{PlateForm, Plates, Preset, scan_plates};

    /// At the optimum the gradients of rows and prior cancel: the solver ends with a step of 1e-6 σ, and the sum is as small in these coordinates.
    /// Bowed plates pull against their prior, so each gradient alone is a thousand times the tolerance.
    #[test]
    fn rows_and_what_is_known_beforehand_balance_at_the_optimum() {
        let bowed = PlateForm::of_term(2, 5e-4);
        let plates = Plates { forms: [bowed; 2], ..Plates::default() };
        let recording = scan_plates(&Preset::Good.scenario(), &plates, 3).unwrap();
        let config = Config::default();
        let sampling = Sampling::of(&recording, origin_ns(&recording));
        let observations = observe(&recording, &sampling, &config).unwrap();
        let frames = frames(&recording, &observations, Measurements::Stripe, &config).unwrap();
        assert!(frames.list.len() < MOST_OBSERVATIONS, "all are looked at");
        let truth = recording.truth.as_ref().unwrap();
        let like = Parameters::straight(&truth.parameters, truth.lines.clone());
        let begin = start::start(&observations, &frames, &like, None).unwrap();
        let levels = NoiseLevels { robot_sigma_m: 3e-5, stamp_sigma_s: 0.0, factor: 1.0 };
        let shared = SharedNoise { levels, robot_sigma_rad: 1e-5 };
        let fixed = start::held(&begin, &frames.without_plates);
        let solver = StripeSolver {
            observations: &observations,
            frames: &frames.list,
            shared,
            shape_prior: None,
            fixed: &fixed,
            loss: crate::Config::default().final_loss(),
        };
        let fit = solver.fit(begin).unwrap();
        let information = fit.information(&fixed, RANK_THRESHOLD).unwrap();
        let root = information.covariance_root();
        let known = root.transpose() * fit.problem.known_beforehand(fit.state()).gradient;
        assert!(known.norm() > 0.1, "{known:?}");
        let pull = scores(&fit, &information).unwrap().others().norm();
        assert!(pull < 1e-4, "{pull}");
    }
}
