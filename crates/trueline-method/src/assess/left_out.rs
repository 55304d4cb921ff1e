//! The optimum without a part of a scan, from where sums over its parts say that it is.
//!
//! At the optimum of all observations the normal equations of each part are summed once. Those of the rest are the sum of the others,
//! and a step of Gauss and Newton leads to the neighbourhood of the rest's optimum. With a loss that redescends it falls short, for
//! its Hessian is the re-weighted one; so the rest is solved for from there, which takes few steps.

use crate::input::noise_levels::Whitener;
use crate::input::observations::Observation;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;
use trueline_lsq::{LeastSquares, NormalEquations, SolveOptions, solve};

/// A step of more standard deviations of the unknowns is further than the sums hold.
const SHORT: f64 = 4.0;

/// The normal equations of the parts of a scan.
pub(crate) struct PartSums<'a, 'b> {
    whole: &'b LineProblem<'a>,
    at: &'b Parameters,
    fixed: &'b [usize],
    /// Of each part, what is known beforehand left out.
    parts: Vec<(Range<usize>, NormalEquations)>,
    /// Of all, with what is known beforehand.
    all: NormalEquations,
}

/// Where the rest of a scan has its optimum, and its Hessian there.
pub(crate) struct LeftOut {
    /// The optimum.
    pub at: Parameters,
    /// The Hessian.
    pub hessian: DMatrix<f64>,
}

impl<'a, 'b> PartSums<'a, 'b> {
    /// Of these parts of a problem's list, at a state beside its optimum; some components are held.
    pub(crate) fn of(
        whole: &'b LineProblem<'a>,
        parts: impl Iterator<Item = Range<usize>>,
        at: &'b Parameters,
        fixed: &'b [usize],
    ) -> Self {
        let known = whole.known_beforehand(at);
        let mut all = known.clone();
        let sums = |range: Range<usize>| {
            let mut own = NormalEquations::zeros(whole.dimension());
            some(whole, &whole.list[range.clone()], &whole.whiteners[range.clone()]).linearize(at, &mut own);
            subtract(&mut own, &known);
            (range, own)
        };
        let parts: Vec<_> = parts.map(sums).collect();
        for (_, part) in &parts {
            all.hessian += &part.hessian;
            all.gradient += &part.gradient;
            all.cost += part.cost;
        }
        Self { whole, at, fixed, parts, all }
    }

    /// The optimum without a part; `None` if there is none.
    pub(crate) fn without(&self, part: usize) -> Option<LeftOut> {
        let (range, own) = &self.parts[part];
        let mut rest = self.all.clone();
        subtract(&mut rest, own);
        let quadratic = Quadratic(&rest);
        let options = SolveOptions { max_iterations: 20, step_threshold: 1e-2, ..SolveOptions::default() };
        let step = solve(&quadratic, DVector::zeros(rest.gradient.len()), self.fixed, &options).ok()?.state;
        let length = step.dot(&(&rest.hessian * &step)).max(0.0).sqrt();
        let start = if length <= SHORT { self.at.retract(&step) } else { self.at.clone() };
        let (mut list, mut whiteners) = (Vec::new(), Vec::new());
        for others in [0..range.start, range.end..self.whole.list.len()] {
            list.extend_from_slice(&self.whole.list[others.clone()]);
            whiteners.extend_from_slice(&self.whole.whiteners[others]);
        }
        let solution = solve(&some(self.whole, &list, &whiteners), start, self.fixed, &options).ok()?;
        Some(LeftOut { at: solution.state, hessian: solution.equations.hessian })
    }
}

/// The same problem over some of its observations, whitened as they are.
fn some<'c>(whole: &'c LineProblem<'_>, list: &'c [Observation], whiteners: &[Whitener]) -> LineProblem<'c> {
    LineProblem {
        observations: whole.observations,
        list,
        whiteners: whiteners.to_vec(),
        prior: whole.prior.clone(),
        ..*whole
    }
}

fn subtract(from: &mut NormalEquations, what: &NormalEquations) {
    from.hessian -= &what.hessian;
    from.gradient -= &what.gradient;
    from.cost -= what.cost;
}

/// A quadratic cost: what normal equations stand for.
struct Quadratic<'a>(&'a NormalEquations);

impl LeastSquares for Quadratic<'_> {
    type State = DVector<f64>;

    fn dimension(&self) -> usize {
        self.0.gradient.len()
    }

    fn retract(&self, state: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
        state + step
    }

    fn cost(&self, state: &DVector<f64>) -> f64 {
        self.0.cost + self.0.gradient.dot(state) + 0.5 * state.dot(&(&self.0.hessian * state))
    }

    fn linearize(&self, state: &DVector<f64>, equations: &mut NormalEquations) {
        equations.hessian += &self.0.hessian;
        equations.gradient += &self.0.gradient + &self.0.hessian * state;
        equations.cost += self.cost(state);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::{PartSums, some};
    use crate::config::Config;
    use crate::input::noise_levels::NoiseLevels;
    use crate::input::observations::{observe, origin_ns};
    use crate::input::timestamps::Sampling;
    use crate::problem::line_problem::{Criterion, LineProblem};
    use crate::problem::parameters::{LINES, Parameters};
    use crate::solve::seam_chart::with_bows;
    use trueline_lsq::{Information, LeastSquares, Loss, NormalEquations, SolveOptions, solve};
    use trueline_sim::{Preset, simulate};

    /// Against a solve of the rest, with a component held and with none.
    #[test]
    fn what_the_sums_say_is_where_the_rest_has_its_optimum() {
        let mut scenario = Preset::Quick.scenario();
        scenario.timing.frame_period_s = 0.005;
        let recording = simulate(&scenario, 4).unwrap();
        let sampling = Sampling::of(&recording, origin_ns(&recording));
        let observed = observe(&recording, &sampling, &Config::default()).unwrap();
        let truth = recording.truth.clone().unwrap();
        let at = with_bows(&observed, &observed.list, Parameters::straight(&truth.parameters, truth.lines));
        let criterion =
            Criterion { residual: Config::default().residual, loss: Loss::GemanMcClure { scale: 5.0 } };
        let noise = NoiseLevels { robot_sigma_m: 1e-5, stamp_sigma_s: 1e-4, factor: 1.0 };
        let whole = LineProblem::new(&observed, &observed.list, criterion, &noise, &at);
        for fixed in [vec![], vec![2]] {
            let optimum = solve(&whole, at.clone(), &fixed, &SolveOptions::default()).unwrap().state;
            let parts: Vec<_> =
                (0..4).map(|k| k * whole.list.len() / 4..(k + 1) * whole.list.len() / 4).collect();
            let sums = PartSums::of(&whole, parts.iter().cloned(), &optimum, &fixed);
            let mut all = NormalEquations::zeros(whole.dimension());
            whole.linearize(&optimum, &mut all);
            // Thousands of products of numbers, summed in another order.
            assert!((&sums.all.hessian - &all.hessian).amax() < 1e-10 * all.hessian.amax());
            for (k, part) in parts.iter().enumerate() {
                let found = sums.without(k).unwrap();
                let list = [&whole.list[..part.start], &whole.list[part.end..]].concat();
                let whiteners = [&whole.whiteners[..part.start], &whole.whiteners[part.end..]].concat();
                let rest = some(&whole, &list, &whiteners);
                let solved = solve(&rest, optimum.clone(), &fixed, &SolveOptions::default()).unwrap();
                let covariance =
                    Information::new(&solved.equations.hessian, &fixed, 0.0).unwrap().covariance();
                // Of clock and sensor, each in its own standard deviations.
                let sigmas = |state: &Parameters| {
                    let off = state.minus(&solved.state.guess());
                    let free = (0..LINES).filter(|k| !fixed.contains(k));
                    free.map(|k| off[k].abs() / covariance[(k, k)].sqrt()).fold(0.0, f64::max)
                };
                // It ends with a step below 0.01 σ, and steps shrink to less than a third.
                assert!(sigmas(&found.at) < 0.02, "{k} {}", sigmas(&found.at));
                // A fourth of the scan moves an unknown by σ/√3 or so, the most of six or seven by more.
                assert!(sigmas(&optimum) > 0.2, "{k} {}", sigmas(&optimum));
                let slope = |h: &nalgebra::DMatrix<f64>| h.diagonal();
                let relative = slope(&found.hessian).component_div(&slope(&solved.equations.hessian));
                assert!(relative.iter().all(|r| (r - 1.0).abs() < 0.02), "{k} {relative}");
            }
        }
    }
}
