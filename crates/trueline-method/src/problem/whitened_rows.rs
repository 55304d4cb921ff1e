//! Whitened residual and Jacobian of each observation, for statistics over a scan.
//!
//! They are computed four side by side, a block of observations at a time, and equal those of [`LineProblem::whitened`] up to rounding.

use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use crate::problem::simd::{Mounting, Rows, Scan, WhitenedRow, sweep};

/// Observations whose rows are computed at once, so that they stay in a near cache.
const BLOCK: usize = 256;

impl LineProblem<'_> {
    /// Passes the index in the list and the row of each observation that can be evaluated, in the list's order.
    pub(crate) fn for_each_whitened(&self, at: &Parameters, mut take: impl FnMut(usize, &WhitenedRow)) {
        let sheet_from_tool = Mounting::new(&self.observations.sheet, at).sheet_from_tool;
        let mut rows = vec![None; BLOCK.min(self.list.len())];
        for (block, list) in self.list.chunks(BLOCK).enumerate() {
            let first = block * BLOCK;
            let rows = &mut rows[..list.len()];
            let scan = Scan { observations: self.observations, list, at, residual: self.residual };
            let whiteners = &self.whiteners[first..first + list.len()];
            sweep(&scan, &mut Rows::new(whiteners, sheet_from_tool, rows));
            for (k, row) in rows.iter().enumerate() {
                if let Some(row) = row {
                    take(first + k, row);
                }
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use crate::config::{Config, ResidualKind};
    use crate::input::noise_levels::NoiseLevels;
    use crate::input::observations::{observe, origin_ns};
    use crate::input::timestamps::Sampling;
    use crate::problem::line_problem::{Criterion, LineProblem};
    use crate::problem::parameters::Parameters;
    use crate::solve::seam_chart::{with_bows, with_shape};
    use trueline_lsq::Loss;
    use trueline_sim::{Preset, simulate};

    /// Against one at a time, for two lines: straight, bowed and with a shape. Some observations lie outside the robot's recording.
    #[test]
    fn rows_are_those_of_one_observation_at_a_time() {
        let mut scenario = Preset::TwoLines.scenario();
        scenario.timing.duration_s = 6.0;
        let recording = simulate(&scenario, 3).unwrap();
        let sampling = Sampling::of(&recording, origin_ns(&recording));
        let observed = observe(&recording, &sampling, &Config::default()).unwrap();
        let truth = recording.truth.clone().unwrap();
        let mut straight = Parameters::straight(&truth.parameters, truth.lines);
        straight.time_offset_s += 0.3;
        let mut shaped = with_shape(&observed, with_bows(&observed, &observed.list, straight.clone()));
        shaped.curvatures[0].bow_m = [1e-4, -2e-4];
        let noise = NoiseLevels { robot_sigma_m: 2e-5, stamp_sigma_s: 1e-4, factor: 1.2 };
        for (at, residual) in [
            (&straight, ResidualKind::Sheet),
            (&shaped, ResidualKind::Sheet),
            (&straight, ResidualKind::PointToLine),
        ] {
            let criterion = Criterion { residual, loss: Loss::Squared };
            let problem = LineProblem::new(&observed, &observed.list, criterion, &noise, at);
            let mut plain: Vec<_> = problem.selected().map(|pair| problem.whitened(pair, at)).collect();
            assert!(plain.iter().any(Option::is_none) && plain.iter().any(Option::is_some));
            let (mut last, mut largest) = (None, 0.0_f64);
            problem.for_each_whitened(at, |index, row| {
                assert!(last.is_none_or(|last| last < index));
                last = Some(index);
                let (residual, jacobian) = plain[index].take().unwrap();
                // Rounding of lengths of a metre times a whitener of some 1e5/m.
                assert!((row.residual - residual).amax() < 1e-8, "{index}");
                let scale = jacobian.amax();
                assert!((row.jacobian - jacobian).amax() < 1e-12 * scale, "{index}");
                largest = largest.max(scale);
            });
            assert!(largest > 0.0 && plain.iter().all(Option::is_none));
        }
    }
}
