//! Tests the second order of a weak scan against solutions beside its valley, found by differences alone.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::adjustment::adjust::Adjustment;
use crate::adjustment::coloured::Coloured;
use crate::adjustment::columns::Columns;
use crate::adjustment::seam_points::SeamPoints;
use crate::adjustment::sights::Sights;
use crate::adjustment::weights::Weights;
use crate::config::{Config, ResidualKind};
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations;
use crate::input::timestamps::Sampling;
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::{Parameters, ROTATION, TRANSLATION};
use crate::problem::unknowns::LOCAL_ALL;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use trueline_lsq::Loss;
use trueline_sim::{Disturbance, Preset, random_cell, simulate};

/// Noise at which rotations are known only to some degrees.
const LOUD: NoiseLevels = NoiseLevels { robot_sigma_m: 3e-5, stamp_sigma_s: 1e-4, factor: 25.0 };
/// A step of differences: m, s and rad.
const STEP: f64 = 1e-6;
/// Rounds of the search. Each leaves a few hundredths of the error.
const ROUNDS: usize = 12;

/// Whitened residuals of all frames, one below the other.
fn residuals(adjustment: &Adjustment<SeamPoints<'_>, 2, LOCAL_ALL>, at: &Parameters) -> DVector<f64> {
    let frames = adjustment.scan.frames(&adjustment.at);
    let all: Vec<f64> = frames
        .iter()
        .flatten()
        .flat_map(|frame| adjustment.scan.residual(frame, at).unwrap().0.iter().copied().collect::<Vec<_>>())
        .collect();
    DVector::from_vec(all)
}

/// Derivatives of the residuals by all unknowns at the adjustment's state.
fn slopes(adjustment: &Adjustment<SeamPoints<'_>, 2, LOCAL_ALL>) -> DMatrix<f64> {
    let count = adjustment.at.dimension();
    let column = |k: usize| {
        let step = DVector::from_fn(count, |j, _| if j == k { STEP } else { 0.0 });
        let [after, before] =
            [&step, &-&step].map(|step| residuals(adjustment, &adjustment.at.retract(step)));
        (after - before) / (2.0 * STEP)
    };
    DMatrix::from_columns(&(0..count).map(column).collect::<Vec<_>>())
}

/// The state at which the residuals are orthogonal to the slopes, with columns held and without a turn about an axis. Also returns its cost.
fn beside(
    adjustment: &Adjustment<SeamPoints<'_>, 2, LOCAL_ALL>,
    from: &Parameters,
    axis: &Vector3<f64>,
) -> (Parameters, f64) {
    let count = from.dimension();
    let mut of_axis = DVector::zeros(count);
    of_axis.fixed_rows_mut::<3>(ROTATION).copy_from(axis);
    // All directions but that one.
    let plane = DMatrix::identity(count, count) - &of_axis * of_axis.transpose();
    let slopes = slopes(adjustment) * &plane;
    let normal = (slopes.tr_mul(&slopes) + &of_axis * of_axis.transpose()).lu();
    let mut at = from.clone();
    for _ in 0..ROUNDS {
        let gradient = slopes.tr_mul(&residuals(adjustment, &at));
        at = at.retract(&-(&plane * normal.solve(&gradient).unwrap()));
    }
    let cost = residuals(adjustment, &at).norm_squared();
    (at, cost)
}

/// How wide a valley is and how it bends, against solutions on both sides of it.
#[test]
fn a_valley_is_as_wide_and_bends_as_solutions_beside_it_say() {
    let mut scenario = random_cell(&Preset::Good.scenario(), 5, 0.5);
    scenario.timing.duration_s = 4.0;
    scenario.disturbance = Disturbance::default();
    let recording = simulate(&scenario, 5).unwrap();
    let sampling = Sampling::of(&recording, observations::origin_ns(&recording));
    let observed = observations::observe(&recording, &sampling, &Config::default()).unwrap();
    let truth = recording.truth.unwrap();
    let at = Parameters::straight(&truth.parameters, truth.lines);
    let criterion = Criterion { residual: ResidualKind::Sheet, loss: Loss::Squared };
    let problem = LineProblem::new(&observed, &observed.list, criterion, &LOUD, &at);
    let scan = SeamPoints::of(&problem, &at);
    let count = scan.frames(&at).len();
    let columns = Columns::of(&at, &[], Vec::new());
    let mut adjustment = Adjustment {
        scan,
        shape_prior: None,
        unseen: DMatrix::zeros(at.dimension(), 0),
        coefficients: DVector::zeros(columns.estimated()),
        columns,
        at: at.clone(),
        sigmas: [1.0; 2],
        noise: [Coloured::NONE; 2],
        known_noise: None,
        weights: Weights { of: vec![1.0; count], ..Weights::default() },
        threads: 1,
    };
    let frames = adjustment.scan.frames(&at);
    let table = adjustment.table(&frames);
    let sums = adjustment.whitened(&table);
    let equations = adjustment.equations(&[sums[0].sums.clone(), sums[1].sums.clone()]);
    let covariance = equations.solve(&adjustment.prior()).unwrap().covariance();
    let found = adjustment.beyond_linear(&covariance).unwrap();

    let of_rotation: Matrix3<f64> = covariance.fixed_view::<3, 3>(ROTATION, ROTATION).into();
    let eigen = of_rotation.symmetric_eigen();
    let sigma_rad = eigen.eigenvalues.max().sqrt();
    let axis = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let along = covariance.columns(ROTATION, 3) * axis / sigma_rad;
    let least = residuals(&adjustment, &at).norm_squared();
    let [up, down] = [1.0, -1.0].map(|sign| beside(&adjustment, &at.retract(&(&along * sign)), &axis));
    let growth = 0.5 * (up.1 + down.1) - least;
    let place = |of: &Parameters| of.tool_from_camera.translation.vector;
    // The first order is odd about the middle and the bend is even. For a standard normal s the root mean square of s² is √3.
    let bend = (place(&up.0) + place(&down.0) - place(&at) * 2.0) * (0.5 * 3.0_f64.sqrt());
    println!("{:.2}°, growth {growth:.4}, bend {:.3} mm", sigma_rad.to_degrees(), bend.norm() * 1e3);
    let bends = found.bends.fixed_rows::<3>(TRANSLATION).into_owned();
    assert!(bend.norm() > 0.02 * along.rows(TRANSLATION, 3).norm(), "the valley is straight: {bend}");
    // Three steps leave a few hundredths of it.
    assert!((bends - bend).norm() < 0.1 * bend.norm(), "{bends} {bend}");
    let wider = (growth.clamp(1.0 / 9.0, 1.0).recip() - 1.0).sqrt();
    assert!((&found.wider - &along * wider).norm() < 0.1 * along.norm(), "{} {wider}", found.wider);
    assert!(found.wider.dot(&along) >= 0.0);
}
