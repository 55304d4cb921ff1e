//! Estimates a drift of the time offset, and a step of one of the clocks.
//!
//! Each is one more unknown, a column s·∂r/∂t_d with s rising over the scan or stepping from 0 to 1. Its estimate is one Gauss–Newton step at the
//! solution, with all other unknowns free. Only sums over the observations are needed, so a step can be tried at every frame in linear time.

use crate::problem::layout::Layout;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use crate::problem::row_table::RowTable;
use crate::problem::simd::WhitenedRow;
use crate::problem::unknowns::{LOCAL_ALL, TIME_OFFSET};
use nalgebra::{DMatrix, DVector, SVector};

/// Rate of change of the time offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Change of the time offset over time, parts per million: positive if the image clock runs fast.
    pub ppm: f64,
    /// Its standard deviation.
    pub sigma_ppm: f64,
    /// Stamp at which the reported time offset holds, s.
    pub about_s: f64,
}

/// A sudden change of the offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// First stamp after it, s.
    pub at_s: f64,
    /// New offset minus old, s.
    pub step_s: f64,
    /// Its standard deviation, s.
    pub sigma_s: f64,
}

/// Largest step that network time synchronisation makes, s.
const LARGEST_OF_A_CLOCK_S: f64 = 0.012;

impl Step {
    /// Whether a clock can have made it. A larger step comes from a queue of images, a lost frame count, or a wrong answer.
    #[must_use]
    pub(crate) fn is_of_a_clock(&self) -> bool {
        self.step_s.abs() <= LARGEST_OF_A_CLOCK_S
    }
}

/// Contribution of one observation to the sums.
struct Part {
    stamp_s: f64,
    gradient: f64,
    own: f64,
}

/// The sums of a solution, from which drift and step follow.
pub(crate) struct ClockCheck {
    parts: Vec<Part>,
    /// The products of each with the other unknowns, in the coordinates of their covariance's root.
    with_others: RowTable,
    variance: f64,
}

/// Least fraction of the scan on each side of a step.
const LEAST_SIDE: f64 = 0.05;

impl ClockCheck {
    /// Prepares the sums. `root` is that of H⁻¹. `variance` is the ratio of the offset's actual variance to the nominal one.
    #[must_use]
    pub(crate) fn new(
        problem: &LineProblem<'_>,
        at: &Parameters,
        root: &DMatrix<f64>,
        variance: f64,
    ) -> Self {
        let mut parts = Vec::with_capacity(problem.list.len());
        let mut with_others = RowTable::new(root.nrows());
        problem.for_each_whitened(at, |index, WhitenedRow { residual, jacobian }| {
            let o = &problem.list[index];
            let weight = problem.loss.weight(residual.norm_squared());
            let column = jacobian.column(TIME_OFFSET) * weight;
            let local: SVector<f64, LOCAL_ALL> = jacobian.tr_mul(&column);
            problem.unknowns.add(o.line as usize, local.as_slice(), with_others.push());
            let (gradient, own) = (column.dot(residual), local[TIME_OFFSET]);
            parts.push(Part { stamp_s: o.stamp_s, gradient, own });
        });
        Self { parts, with_others: with_others.in_root(root), variance }
    }

    /// Estimate and variance of the additional unknown with these sums.
    fn estimate(&self, with_others: &DVector<f64>, gradient: f64, own: f64) -> Option<(f64, f64)> {
        let information = own - with_others.norm_squared();
        (information > 1e-6 * own).then(|| (-gradient / information, self.variance / information))
    }

    /// The drift of the time offset. `None` if it is undetermined.
    #[must_use]
    pub(crate) fn drift(&self) -> Option<Drift> {
        let own: f64 = self.parts.iter().map(|p| p.own).sum();
        // About the centre of the information on the offset, both are nearly independent.
        let about_s = self.parts.iter().map(|p| p.own * p.stamp_s).sum::<f64>() / own;
        let mut sums = (DVector::zeros(self.with_others.width()), 0.0, 0.0);
        for (part, with_others) in self.parts.iter().zip(self.with_others.iter()) {
            let elapsed = part.stamp_s - about_s;
            sums.0.axpy(elapsed, &with_others, 1.0);
            sums.1 += elapsed * part.gradient;
            sums.2 += elapsed * elapsed * part.own;
        }
        let (rate, variance) = self.estimate(&sums.0, sums.1, sums.2)?;
        Some(Drift { ppm: rate * 1e6, sigma_ppm: variance.sqrt() * 1e6, about_s })
    }

    /// Ratio of the standard deviations to those from noise alone.
    #[must_use]
    pub(crate) fn inflation(&self) -> f64 {
        self.variance.sqrt()
    }

    /// The most significant step. `None` if it is undetermined.
    #[must_use]
    pub(crate) fn step(&self) -> Option<Step> {
        let significance = |step: &Step| (step.step_s / step.sigma_s).abs();
        self.steps().into_iter().max_by(|a, b| significance(a).total_cmp(&significance(b)))
    }

    /// The step at a stamp. `None` if it is undetermined.
    #[must_use]
    pub(crate) fn step_at(&self, at_s: f64) -> Option<Step> {
        let off = |step: &Step| (step.at_s - at_s).abs();
        self.steps().into_iter().min_by(|a, b| off(a).total_cmp(&off(b)))
    }

    /// The step at each frame with enough of the scan on either side.
    fn steps(&self) -> Vec<Step> {
        let total: f64 = self.parts.iter().map(|p| p.own).sum();
        let mut after = (DVector::zeros(self.with_others.width()), 0.0, 0.0);
        let mut steps = Vec::new();
        for (k, part) in self.parts.iter().enumerate().rev() {
            after.0 += self.with_others.of(k);
            after.1 += part.gradient;
            after.2 += part.own;
            let first_of_frame = k == 0 || self.parts[k - 1].stamp_s != part.stamp_s;
            let share = after.2 / total;
            if !first_of_frame || !(LEAST_SIDE..=1.0 - LEAST_SIDE).contains(&share) {
                continue;
            }
            if let Some((step_s, variance)) = self.estimate(&after.0, after.1, after.2) {
                steps.push(Step { at_s: part.stamp_s, step_s, sigma_s: variance.sqrt() });
            }
        }
        steps
    }
}
