//! Tests the restricted likelihood and the error budget of a solution against dense formulas.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::adjustment::coloured::{Coloured, Tick, whiten};
use crate::adjustment::equations::{Equations, Prior};
use nalgebra::{DMatrix, DVector};

const ROWS: usize = 30;
/// Two unknowns, three coefficients of a block.
const UNKNOWNS: usize = 2;
const BLOCK: usize = 3;

fn row(direction: usize, k: usize) -> Vec<f64> {
    (0..UNKNOWNS + BLOCK + 1).map(|c| ((k * 7 + c * 3 + direction * 5) as f64 * 0.37).sin()).collect()
}

/// −2 log of the restricted likelihood of residuals, with unknowns without a prior and the block in the covariance.
#[test]
fn the_restricted_likelihood_is_that_of_the_whole_covariance() {
    let noise = Coloured { amplitude: 2.0, lasts_s: 0.5, long: 0.0 };
    let (sigmas, variance) = ([0.7, 1.3], 0.4);
    let ticks: Vec<Tick> =
        (0..ROWS).map(|k| Tick { since_s: if k == 0 { f64::INFINITY } else { 0.1 }, weight: 1.0 }).collect();
    let rows = |direction: usize| (0..ROWS).flat_map(|k| row(direction, k)).collect::<Vec<f64>>();
    let sums = [0, 1].map(|d| whiten(&rows(d), UNKNOWNS + BLOCK + 1, &ticks, noise).sums);
    let estimated = UNKNOWNS + BLOCK;
    let equations = Equations::of([&sums[0], &sums[1]], sigmas, estimated);
    let mut information = DMatrix::zeros(estimated, estimated);
    (UNKNOWNS..estimated).for_each(|k| information[(k, k)] = 1.0 / variance);
    let prior = Prior {
        information,
        gradient: DVector::zeros(estimated),
        square: 0.0,
        log_determinant: BLOCK as f64 * f64::ln(variance),
    };
    let solved = equations.solve(&prior).unwrap();
    // Densely: both directions below each other.
    let all: Vec<Vec<f64>> = (0..2).flat_map(|d| (0..ROWS).map(move |k| row(d, k))).collect();
    let covariance = DMatrix::from_fn(2 * ROWS, 2 * ROWS, |i, j| {
        let block: f64 = (0..BLOCK).map(|c| all[i][UNKNOWNS + c] * all[j][UNKNOWNS + c] * variance).sum();
        if i / ROWS != j / ROWS {
            return block;
        }
        let apart_s = 0.1 * ((i % ROWS) as f64 - (j % ROWS) as f64).abs();
        let lasting = noise.amplitude * (-apart_s / noise.lasts_s).exp() + f64::from(u8::from(i == j));
        block + lasting * f64::powi(sigmas[i / ROWS], 2)
    });
    let columns = DMatrix::from_fn(2 * ROWS, UNKNOWNS, |i, j| all[i][j]);
    let residual = DVector::from_fn(2 * ROWS, |i, _| all[i][estimated]);
    let factor = covariance.cholesky().unwrap();
    let normal = columns.transpose() * factor.solve(&columns);
    let step = -normal.clone().cholesky().unwrap().solve(&(columns.transpose() * factor.solve(&residual)));
    let moved = &residual + &columns * &step;
    let logs = |l: &DMatrix<f64>| 2.0 * l.diagonal().map(f64::ln).sum();
    let expected =
        logs(&factor.l()) + logs(&normal.cholesky().unwrap().l()) + moved.dot(&factor.solve(&moved));
    // Sixty rows of about one: rounding.
    assert!((solved.twice_negative_log - expected).abs() < 1e-9, "{} {expected}", solved.twice_negative_log);
    assert!((solved.step.rows(0, UNKNOWNS) - step).norm() < 1e-11);
}

/// The noise and the prior share the covariance between them.
#[test]
fn shares_of_noise_and_prior_add_up_to_the_covariance() {
    let ticks: Vec<Tick> = (0..ROWS).map(|_| Tick { since_s: 0.1, weight: 0.8 }).collect();
    let rows = |direction: usize| (0..ROWS).flat_map(|k| row(direction, k)).collect::<Vec<f64>>();
    let sums = [0, 1].map(|d| whiten(&rows(d), UNKNOWNS + BLOCK + 1, &ticks, Coloured::NONE).sums);
    let estimated = UNKNOWNS + BLOCK;
    let equations = Equations::of([&sums[0], &sums[1]], [1.0; 2], estimated);
    let information =
        DMatrix::from_diagonal(&DVector::from_fn(estimated, |k, _| if k < UNKNOWNS { 0.0 } else { 5.0 }));
    let prior = Prior {
        information: information.clone(),
        gradient: DVector::zeros(estimated),
        square: 0.0,
        log_determinant: 0.0,
    };
    let covariance = equations.solve(&prior).unwrap().covariance();
    let variances = equations.solve(&prior).unwrap().variances();
    assert!((covariance.diagonal() - variances).amax() < 1e-12);
    let both = &covariance * (&equations.of_scan + information) * &covariance;
    assert!((both - &covariance).amax() < 1e-12);
    let sigmas = equations.solve(&prior).unwrap().sigmas(UNKNOWNS);
    for (k, sigma) in sigmas.into_iter().enumerate() {
        assert!((sigma - covariance[(k, k)].sqrt()).abs() < 1e-12);
    }
}
