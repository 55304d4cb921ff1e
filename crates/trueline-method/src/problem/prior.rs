//! Directions of time offset and hand-eye that are held at a guess, because they are unobservable.

use crate::problem::parameters::{LINES, Parameters, ROTATION, TIME_OFFSET, TRANSLATION};
use nalgebra::{DVector, SVector, Vector3};
use trueline_dataset::Guess;
use trueline_geometry::so3;
use trueline_lsq::NormalEquations;

/// Standard deviation of a held direction: a nanosecond, a nanometre, a nanoradian, far below any estimated one.
const SIGMA: f64 = 1e-9;

/// A guess and the directions in which it is held.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    guess: Guess,
    directions: Vec<SVector<f64, LINES>>,
}

impl Prior {
    /// Holds nothing yet.
    #[must_use]
    pub fn at(guess: &Guess) -> Self {
        Self { guess: *guess, directions: Vec::new() }
    }

    /// Holds the time offset.
    pub fn hold_time_offset(&mut self) {
        self.hold(TIME_OFFSET, &[1.0]);
    }

    /// Holds the rotation about a direction in the tool frame.
    pub fn hold_rotation(&mut self, direction: &[f64; 3]) {
        self.hold(ROTATION, direction);
    }

    /// Holds the translation along a direction in the tool frame.
    pub fn hold_translation(&mut self, direction: &[f64; 3]) {
        self.hold(TRANSLATION, direction);
    }

    /// Clock and sensor moved to the guess in the held directions only.
    #[must_use]
    pub(crate) fn nearest_to(&self, at: &Parameters) -> Parameters {
        let off = at.minus(&self.guess);
        let mut step = DVector::zeros(at.dimension());
        for direction in &self.directions {
            (0..LINES).for_each(|k| step[k] -= direction[k] * direction.dot(&off));
        }
        at.retract(&step)
    }

    fn hold(&mut self, first: usize, values: &[f64]) {
        let mut direction = SVector::<f64, LINES>::zeros();
        direction.as_mut_slice()[first..first + values.len()].copy_from_slice(values);
        self.directions.push(direction);
    }

    /// Cost ½ Σ (d · (x − guess) / σ)² at a state.
    #[must_use]
    pub fn cost(&self, at: &Parameters) -> f64 {
        let off = at.minus(&self.guess);
        self.directions.iter().map(|d| 0.5 * (d.dot(&off) / SIGMA).powi(2)).sum()
    }

    /// Adds cost, gradient and Hessian.
    pub fn add_to(&self, at: &Parameters, equations: &mut NormalEquations) {
        let off = at.minus(&self.guess);
        let turn: Vector3<f64> = off.fixed_rows::<3>(ROTATION).into();
        // A left perturbation δ moves Log(R R_guessᵀ) by J_l⁻¹ δ.
        let log_from_step = so3::left_jacobian_inverse(&turn);
        for direction in &self.directions {
            let mut row = *direction;
            let rotation: Vector3<f64> = direction.fixed_rows::<3>(ROTATION).into();
            row.fixed_rows_mut::<3>(ROTATION).copy_from(&(log_from_step.transpose() * rotation));
            row /= SIGMA;
            let residual = direction.dot(&off) / SIGMA;
            equations.cost += 0.5 * residual * residual;
            for i in 0..LINES {
                equations.gradient[i] += row[i] * residual;
                for j in 0..LINES {
                    equations.hessian[(i, j)] += row[i] * row[j];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueline_geometry::se3;

    #[test]
    fn only_held_directions_move_to_the_guess() {
        let turned = so3::exp(&Vector3::new(0.4, -0.3, 0.9));
        let guess = Guess {
            time_offset_s: 0.01,
            tool_from_camera: se3::from_parts(turned, Vector3::new(0.1, 0.2, 0.3)),
        };
        let off_axis = Vector3::new(0.6, 0.0, 0.8);
        let shift = Vector3::new(0.01, -0.02, 0.03);
        let at = Parameters::straight(
            &Guess {
                time_offset_s: 0.04,
                // Rotated about the held axis, so that the rotation back is exact.
                tool_from_camera: se3::retract_decoupled(&guess.tool_from_camera, &(off_axis * 0.2), &shift),
            },
            Vec::new(),
        );
        let off = |prior: &Prior| prior.nearest_to(&at).minus(&guess);
        let all = SVector::<f64, LINES>::from([0.03, 0.12, 0.0, 0.16, 0.01, -0.02, 0.03]);
        let without = |first: usize, count: usize| {
            let mut left = all;
            left.fixed_rows_mut::<7>(0).rows_mut(first, count).fill(0.0);
            left
        };
        // Numbers of 1, a dozen roundings.
        let same = |a: SVector<f64, LINES>, b: SVector<f64, LINES>| (a - b).norm() < 1e-15;
        assert!(same(off(&Prior::at(&guess)), all));
        let mut prior = Prior::at(&guess);
        prior.hold_time_offset();
        assert!(same(off(&prior), without(TIME_OFFSET, 1)));
        let mut prior = Prior::at(&guess);
        prior.hold_rotation(&off_axis.into());
        assert!(same(off(&prior), without(ROTATION, 3)));
        let mut prior = Prior::at(&guess);
        prior.hold_translation(&[0.0, 1.0, 0.0]);
        assert!(same(off(&prior), without(TRANSLATION + 1, 1)));
        // 30 mm held to a nanometre.
        let mut prior = Prior::at(&guess);
        prior.hold_translation(&[0.0, 0.0, -1.0]);
        assert!((prior.cost(&at) / (0.5 * 3e7_f64.powi(2)) - 1.0).abs() < 1e-12);
    }
}
