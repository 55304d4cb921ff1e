//! Refines all unknowns of a scan with axes from a start: robust Gauss–Newton steps, with a wide scale first \[Yang2020\].

use crate::axes::scan::{AxisScan, Reading};
use crate::axes::state::{OWN, State};
use nalgebra::{DMatrix, DVector, Vector2};

/// Steps of the differences: s, rad and m.
const STEP: f64 = 1e-6;
/// Initial damping of a step, relative to the diagonal.
const DAMPING: f64 = 1e-3;
/// Prior standard deviation of everything in units of a residual's scale, rad, m and s: undetermined quantities stay
/// constant.
const LOOSE: f64 = 30.0;

/// Result of a refinement.
#[derive(Clone, Debug)]
pub(crate) struct Refined {
    /// Mean loss, between 0 for no residual and 1 for outliers.
    pub loss: f64,
    /// The unknowns.
    pub state: State,
}

/// Solves from a start through scales of the loss, m. `None` if hardly any reading can be placed.
#[must_use]
pub(crate) fn follow(
    scan: &AxisScan,
    readings: &[Reading],
    start: State,
    scales_m: &[f64],
    steps: usize,
) -> Option<Refined> {
    let mut at = start;
    let mut loss = 1.0;
    for scale_m in scales_m {
        let problem = Problem { scan, readings, scale_m: *scale_m };
        Refined { loss, state: at } = problem.refined(at, steps)?;
    }
    Some(Refined { loss, state: at })
}

struct Problem<'a> {
    scan: &'a AxisScan,
    readings: &'a [Reading],
    scale_m: f64,
}

/// Least fraction of the readings that can be placed.
const PLACED: f64 = 0.5;

impl Problem<'_> {
    fn off(&self, at: &State) -> Vec<Option<Vector2<f64>>> {
        self.readings.iter().map(|reading| self.scan.off_m(at, reading)).collect()
    }

    /// Mean loss of Geman and McClure; a reading without a place counts as an outlier.
    fn loss(&self, off: &[Option<Vector2<f64>>]) -> f64 {
        let of = |off: &Option<Vector2<f64>>| {
            off.map_or(1.0, |off| {
                let square = (off / self.scale_m).norm_squared();
                square / (1.0 + square)
            })
        };
        off.iter().map(of).sum::<f64>() / off.len().max(1) as f64
    }

    /// The loss with the prior of a state: undetermined quantities return to their usual values.
    fn cost(&self, at: &State, loss: f64) -> f64 {
        loss + at.unusual() / self.readings.len().max(1) as f64
    }

    fn refined(&self, start: State, steps: usize) -> Option<Refined> {
        let free = start.of_axes();
        let mut at = start;
        let mut off = self.off(&at);
        let mut loss = self.loss(&off);
        let mut damping = DAMPING;
        for _ in 0..steps {
            let placed = off.iter().flatten().count();
            if (placed as f64) < PLACED * off.len() as f64 {
                return None;
            }
            let (hessian, gradient) = self.equations(&at, &free, &off);
            let mut is_better = false;
            for _ in 0..4 {
                let mut damped = hessian.clone();
                for k in 0..damped.nrows() {
                    damped[(k, k)] *= 1.0 + damping;
                }
                let Some(factor) = damped.cholesky() else { break };
                let next = at.moved(&free, &-factor.solve(&gradient));
                let next_off = self.off(&next);
                let next_loss = self.loss(&next_off);
                let (cost, next_cost) = (self.cost(&at, loss), self.cost(&next, next_loss));
                if next_cost < cost {
                    is_better = cost - next_cost > 1e-6 * cost;
                    (at, off, loss) = (next, next_off, next_loss);
                    damping = (0.2 * damping).max(1e-9);
                    break;
                }
                damping *= 8.0;
            }
            if !is_better {
                break;
            }
        }
        Some(Refined { loss, state: at })
    }

    fn equations(
        &self,
        at: &State,
        free: &[(usize, usize)],
        off: &[Option<Vector2<f64>>],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let count = OWN + free.len();
        let columns: Vec<Vec<Option<Vector2<f64>>>> = (0..count)
            .map(|k| {
                let step = DVector::from_fn(count, |j, _| if j == k { STEP } else { 0.0 });
                self.off(&at.moved(free, &step))
            })
            .collect();
        let mut hessian = DMatrix::identity(count, count) * LOOSE.powi(-2);
        let mut gradient = DVector::zeros(count);
        let mut slopes = vec![Vector2::zeros(); count];
        for (k, place) in free.iter().enumerate() {
            let [pull, weight] = at.known(*place);
            gradient[OWN + k] += pull;
            hessian[(OWN + k, OWN + k)] += weight;
        }
        for (i, own) in off.iter().enumerate() {
            let Some(own) = own else { continue };
            let mut is_whole = true;
            for (slope, column) in slopes.iter_mut().zip(&columns) {
                match column[i] {
                    Some(moved) => *slope = (moved - own) / (STEP * self.scale_m),
                    None => is_whole = false,
                }
            }
            if !is_whole {
                continue;
            }
            let residual = own / self.scale_m;
            let weight = (1.0 + residual.norm_squared()).powi(-2);
            for (j, slope) in slopes.iter().enumerate() {
                gradient[j] += weight * slope.dot(&residual);
                for (k, other) in slopes[..=j].iter().enumerate() {
                    hessian[(j, k)] += weight * slope.dot(other);
                }
            }
        }
        hessian.fill_upper_triangle_with_lower_triangle();
        if self.scan.at_stops {
            // There is no time offset.
            hessian.row_mut(0).fill(0.0);
            hessian.column_mut(0).fill(0.0);
            (hessian[(0, 0)], gradient[0]) = (1.0, 0.0);
        }
        (hessian, gradient)
    }
}
