//! Holding a direction at a guess: derivatives against numerical ones.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{DVector, Vector3};
use trueline_dataset::Guess;
use trueline_geometry::{Line, se3, so3};
use trueline_lsq::{LeastSquares, NormalEquations, check};
use trueline_method::Parameters;
use trueline_method::problem::prior::Prior;

struct PriorAlone(Prior);

impl LeastSquares for PriorAlone {
    type State = Parameters;
    fn dimension(&self) -> usize {
        11
    }
    fn retract(&self, state: &Parameters, step: &DVector<f64>) -> Parameters {
        state.retract(step)
    }
    fn cost(&self, state: &Parameters) -> f64 {
        self.0.cost(state)
    }
    fn linearize(&self, state: &Parameters, equations: &mut NormalEquations) {
        self.0.add_to(state, equations);
    }
}

#[test]
fn gradient_is_the_derivative_of_the_cost() {
    let guess = Guess {
        time_offset_s: 0.01,
        tool_from_camera: se3::from_parts(
            so3::exp(&Vector3::new(0.3, -0.4, 0.2)),
            Vector3::new(0.1, 0.0, 0.05),
        ),
    };
    // 1.1 rad off, so that the logarithm's Jacobian is far from the unit matrix.
    let away = so3::exp(&Vector3::new(0.7, -0.5, 0.7));
    let state = Parameters {
        time_offset_s: -0.2,
        tool_from_camera: se3::from_parts(
            away * guess.tool_from_camera.rotation,
            guess.tool_from_camera.translation.vector + Vector3::new(0.02, -0.03, 0.01),
        ),
        lines: vec![Line::new(Vector3::new(1.0, 0.2, 0.3), &Vector3::x_axis())],
        curvatures: Vec::new(),
        shape: None,
    };
    let mut prior = Prior::at(&guess);
    prior.hold_time_offset();
    prior.hold_rotation(&[0.6, 0.0, 0.8]);
    prior.hold_rotation(&[0.0, 1.0, 0.0]);
    prior.hold_translation(&[0.0, 0.6, -0.8]);
    let problem = PriorAlone(prior);
    let steps = DVector::from_element(11, 1e-3);
    // Deviations of 0.1 in units of 1e-9 make gradients of 1e8 sigmas; the five-point stencil at 1e-3 is right to
    // 1e-3⁴/30 = 3e-14 of that and rounding to eps/1e-3 = 2e-13 of the cost over the step, 2e-5: 1e-3 is ample, and a
    // Jacobian without the logarithm's is off by 1e7.
    let error = check::gradient_error(&problem, &state, &steps);
    assert!(error < 1e-3, "{error}");
}
