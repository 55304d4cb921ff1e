//! Tests holding at a guess: derivatives against numerical ones, and the uncertainty of held values.

use nalgebra::{DVector, Vector3};
use trueline_dataset::Guess;
use trueline_geometry::{Line, se3, so3};
use trueline_lsq::{LeastSquares, NormalEquations, check};
use trueline_method::problem::prior::Prior;
use trueline_method::{Calibration, Config, HeldSigma, Hold, Parameters, calibrate};
use trueline_sim::{Preset, simulate};

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
    // 1.1 rad off, so that the logarithm's Jacobian differs clearly from the identity.
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
    // Deviations of 0.1 in units of 1e-9 make gradients of 1e8 sigmas. The five-point stencil at 1e-3 is right to
    // 1e-3⁴/30 = 3e-14 of this, and rounding to eps/1e-3 = 2e-13 of the cost over the step, 2e-5. So 1e-3 is ample,
    // and a Jacobian without the logarithm's is off by 1e7.
    let error = check::gradient_error(&problem, &state, &steps);
    assert!(error < 1e-3, "{error}");
}

/// Against the estimate itself, moved by the held value: to first order the added covariance is the square of the move.
#[test]
fn uncertain_held_values_widen_the_covariance() {
    let recording = simulate(&Preset::Quick.scenario(), 4).unwrap();
    let truth = recording.truth.as_ref().unwrap().parameters;
    let (moved_s, moved_m) = (50e-6, 0.1e-3);
    let at = |offset_s: f64, shift_m: f64, hold: Hold, held_sigma: HeldSigma| {
        let mut guess = truth;
        guess.time_offset_s += offset_s;
        guess.tool_from_camera.translation.vector.y += shift_m;
        let config = Config { hold: vec![hold], held_sigma, ..Config::noise_only() };
        calibrate(&recording, Some(&guess), &config).unwrap()
    };
    let exact = HeldSigma::default();
    let known = HeldSigma { time_s: Some(moved_s), ..exact };
    let (here, there, unsure) = (
        at(0.0, 0.0, Hold::TimeOffset, exact),
        at(moved_s, 0.0, Hold::TimeOffset, exact),
        at(0.0, 0.0, Hold::TimeOffset, known),
    );
    let moved = there.best_fit().minus(&here.best_fit().guess());
    let added = unsure.best_fit_covariance() - here.best_fit_covariance();
    for (i, j) in (0..7).flat_map(|i| (0..7).map(move |j| (i, j))) {
        let scale = (added[(i, i)] * added[(j, j)]).sqrt();
        // Other weights, and a motion of a tenth of a weave's millimetre: a percent of the largest.
        assert!((added[(i, j)] - moved[i] * moved[j]).abs() < 0.03 * scale, "{i} {j}: {added}");
    }
    assert_eq!(here.best_fit(), unsure.best_fit());
    let held = |c: &Calibration| c.findings.checks.seam_error.unwrap().budget_m.held;
    assert!(held(&here) == 0.0 && held(&unsure) > 0.0);
    // A held hand-eye transform is off by its stated accuracy, along each axis.
    let known = HeldSigma { translation_m: Some(moved_m), ..exact };
    let unsure = at(0.0, 0.0, Hold::HandEye, known);
    assert!((held(&unsure) - moved_m * 3_f64.sqrt()).abs() < 0.2 * moved_m, "{}", held(&unsure));
}
