//! Optimum without a part of a scan, from sums over its parts.
//!
//! At the optimum of all observations the normal equations of each part are summed once. Those of the rest are the sum of the other parts, and one
//! Newton step leads to the optimum of the rest. A Gauss–Newton step with a re-weighted Hessian would be too short, because the loss redescends. If
//! the step is long, the rest is solved from there.

use crate::problem::layout::Layout;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use crate::problem::simd::WhitenedRow;
use crate::problem::unknowns::LOCAL_ALL;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use std::ops::Range;
use trueline_lsq::{LeastSquares, NormalEquations, SolveOptions, solve};

/// Maximum step in standard deviations of the unknowns for which the sums hold.
const SHORT: f64 = 4.0;

/// The normal equations of the parts of a scan.
pub(crate) struct PartSums<'a, 'b> {
    whole: &'b LineProblem<'a>,
    at: &'b Parameters,
    fixed: &'b [usize],
    parts: Vec<(Range<usize>, Sums)>,
    /// Sums of all parts, with the prior.
    all: Sums,
}

/// Information of a part of a scan on the unknowns, without the prior.
#[derive(Clone)]
struct Sums {
    /// The normal equations.
    equations: NormalEquations,
    /// Contribution of the loss's second derivative to their Hessian: 2 Σ ρ″ (Jᵀr)(Jᵀr)ᵀ.
    bend: DMatrix<f64>,
}

/// The optimum without a part, with its Hessian.
pub(crate) struct LeftOut {
    /// The optimum.
    pub at: Parameters,
    /// The Hessian.
    pub hessian: DMatrix<f64>,
}

impl<'a, 'b> PartSums<'a, 'b> {
    /// From these parts of a problem's list, at a state beside its optimum, with some components held.
    pub(crate) fn of(
        whole: &'b LineProblem<'a>,
        parts: impl Iterator<Item = Range<usize>>,
        at: &'b Parameters,
        fixed: &'b [usize],
    ) -> Self {
        let known = whole.known_beforehand(at);
        let sums = |range: Range<usize>| {
            let part = whole.of_some(&whole.list[range.clone()], &whole.whiteners[range.clone()]);
            (range, Sums::of(&part, at, &known))
        };
        let parts: Vec<_> = parts.map(sums).collect();
        let size = whole.dimension();
        let mut all = Sums { equations: known.clone(), bend: DMatrix::zeros(size, size) };
        for (_, part) in &parts {
            all.add(part, 1.0);
        }
        Self { whole, at, fixed, parts, all }
    }

    /// The optimum without a part. `None` if there is none.
    pub(crate) fn without(&self, part: usize) -> Option<LeftOut> {
        let (range, own) = &self.parts[part];
        let mut rest = self.all.clone();
        rest.add(own, -1.0);
        let step = rest.newton_step(self.fixed);
        let is_short = |step: &DVector<f64>| step.dot(&(&rest.equations.hessian * step)).sqrt() <= SHORT;
        if let Some(step) = step.filter(is_short) {
            return Some(LeftOut { at: self.at.retract(&step), hessian: rest.equations.hessian });
        }
        let (mut list, mut whiteners) = (Vec::new(), Vec::new());
        for others in [0..range.start, range.end..self.whole.list.len()] {
            list.extend_from_slice(&self.whole.list[others.clone()]);
            whiteners.extend_from_slice(&self.whole.whiteners[others]);
        }
        let options = SolveOptions { max_iterations: 20, step_threshold: 1e-2, ..SolveOptions::default() };
        let rest = self.whole.of_some(&list, &whiteners);
        let solution = solve(&rest, self.at.clone(), self.fixed, &options).ok()?;
        Some(LeftOut { at: solution.state, hessian: solution.equations.hessian })
    }
}

impl Sums {
    fn of(part: &LineProblem<'_>, at: &Parameters, known: &NormalEquations) -> Self {
        let size = part.dimension();
        let mut equations = NormalEquations::zeros(size);
        part.linearize(at, &mut equations);
        let mut sums = Self { equations, bend: DMatrix::zeros(size, size) };
        sums.equations.hessian -= &known.hessian;
        sums.equations.gradient -= &known.gradient;
        sums.equations.cost -= known.cost;
        let mut of_lines = vec![SMatrix::<f64, LOCAL_ALL, LOCAL_ALL>::zeros(); part.unknowns.lines];
        part.for_each_whitened(at, |index, WhitenedRow { residual, jacobian }| {
            let slope = part.loss.weight_slope(residual.norm_squared());
            let score: SVector<f64, LOCAL_ALL> = jacobian.tr_mul(residual);
            of_lines[part.list[index].line as usize].ger(2.0 * slope, &score, &score, 1.0);
        });
        for (line, bend) in of_lines.iter().enumerate() {
            part.unknowns.add_square(line, bend, &mut sums.bend);
        }
        sums
    }

    fn add(&mut self, other: &Self, sign: f64) {
        self.equations.hessian += &other.equations.hessian * sign;
        self.equations.gradient += &other.equations.gradient * sign;
        self.equations.cost += other.equations.cost * sign;
        self.bend += &other.bend * sign;
    }

    /// The step to the minimum of the sums' cost. `None` if there is no minimum.
    fn newton_step(&self, fixed: &[usize]) -> Option<DVector<f64>> {
        let size = self.equations.gradient.len();
        let free: Vec<usize> = (0..size).filter(|k| !fixed.contains(k)).collect();
        let of_free = |matrix: &DMatrix<f64>| matrix.select_rows(&free).select_columns(&free);
        let hessian = of_free(&(&self.equations.hessian + &self.bend));
        // Each unknown is scaled to its own unit: seconds, radians and metres.
        let unit = hessian.diagonal().map(|h| h.sqrt().recip());
        let scaled = DMatrix::from_diagonal(&unit) * hessian * DMatrix::from_diagonal(&unit);
        let gradient = self.equations.gradient.select_rows(&free).component_mul(&unit);
        let of_those = -scaled.cholesky()?.solve(&gradient).component_mul(&unit);
        let mut step = DVector::zeros(size);
        for (k, value) in free.iter().zip(of_those.iter()) {
            step[*k] = *value;
        }
        Some(step)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::PartSums;
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
    fn the_sums_predict_the_optimum_of_the_rest() {
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
            assert!((&sums.all.equations.hessian - &all.hessian).amax() < 1e-10 * all.hessian.amax());
            for (k, part) in parts.iter().enumerate() {
                let found = sums.without(k).unwrap();
                let list = [&whole.list[..part.start], &whole.list[part.end..]].concat();
                let whiteners = [&whole.whiteners[..part.start], &whole.whiteners[part.end..]].concat();
                let rest = whole.of_some(&list, &whiteners);
                let solved = solve(&rest, optimum.clone(), &fixed, &SolveOptions::default()).unwrap();
                let covariance =
                    Information::new(&solved.equations.hessian, &fixed, 0.0).unwrap().covariance();
                // Clock and sensor, each in its own standard deviations.
                let sigmas = |state: &Parameters| {
                    let off = state.minus(&solved.state.guess());
                    let free = (0..LINES).filter(|k| !fixed.contains(k));
                    free.map(|k| off[k].abs() / covariance[(k, k)].sqrt()).fold(0.0, f64::max)
                };
                // It ends with a step below 0.01 σ, and steps shrink to less than a third.
                assert!(sigmas(&found.at) < 0.02, "{k} {}", sigmas(&found.at));
                // A quarter of the scan moves an unknown by about σ/√3. The largest of six or seven moves by more.
                assert!(sigmas(&optimum) > 0.2, "{k} {}", sigmas(&optimum));
                let slope = |h: &nalgebra::DMatrix<f64>| h.diagonal();
                let relative = slope(&found.hessian).component_div(&slope(&solved.equations.hessian));
                assert!(relative.iter().all(|r| (r - 1.0).abs() < 0.02), "{k} {relative}");
            }
        }
    }
}
