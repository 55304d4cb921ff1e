//! The statements about each unknown, against plain inverses of the corresponding matrices.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use trueline_lsq::Information;

const SIZE: usize = 6;

/// A well-conditioned information matrix of unknowns whose units differ by up to a million: S (I + ¼ AᵀA) S.
fn hessian() -> impl Strategy<Value = DMatrix<f64>> {
    let numbers = prop::collection::vec(-1.0..1.0_f64, SIZE * SIZE);
    let units = prop::collection::vec(-3.0..3.0_f64, SIZE);
    (numbers, units).prop_map(|(numbers, units)| {
        let a = DMatrix::from_vec(SIZE, SIZE, numbers);
        let scale =
            DMatrix::from_diagonal(&DVector::from_iterator(SIZE, units.iter().map(|u| 10_f64.powf(*u))));
        &scale * (DMatrix::identity(SIZE, SIZE) + a.transpose() * a * 0.25) * &scale
    })
}

/// √H_kk, the scale of each unknown.
fn roots(hessian: &DMatrix<f64>) -> DVector<f64> {
    hessian.diagonal().map(f64::sqrt)
}

/// Largest difference of two covariances in units of the second's standard deviations.
fn differ(of: &DMatrix<f64>, expected: &DMatrix<f64>) -> f64 {
    let sigma = expected.diagonal().map(|x| if x > 0.0 { x.sqrt() } else { 1.0 });
    DMatrix::from_fn(SIZE, SIZE, |i, j| (of[(i, j)] - expected[(i, j)]).abs() / (sigma[i] * sigma[j])).max()
}

// The scaled matrices have eigenvalues between 1/(1 + SIZE²/4) and SIZE: condition numbers below 60. Two inversions differ by a few times condition
// × eps × SIZE: 1e-13.
const ROUNDING: f64 = 1e-11;

proptest! {
    #[test]
    fn the_covariance_is_the_inverse_of_what_is_free(hessian in hessian(), held in 0..SIZE) {
        let free = Information::new(&hessian, &[held], 1e-9).unwrap();
        let rest = hessian.clone().remove_row(held).remove_column(held).try_inverse().unwrap();
        let expected = rest.insert_row(held, 0.0).insert_column(held, 0.0);
        prop_assert!(differ(&free.covariance(), &expected) < ROUNDING);
        prop_assert_eq!((free.size(), free.rank(), free.null_space().ncols()), (SIZE - 1, SIZE - 1, 0));
        // C½ᵀ H C½ = I.
        let root = free.covariance_root();
        let unit = root.transpose() * &hessian * root - DMatrix::identity(SIZE - 1, SIZE - 1);
        prop_assert!(unit.abs().max() < ROUNDING);
        // Their squares are the eigenvalues of the scaled matrix, which has a unit diagonal. They are in decreasing order.
        let values = free.singular_values();
        prop_assert!((values.norm_squared() - (SIZE - 1) as f64).abs() < ROUNDING);
        prop_assert!(values.as_slice().windows(2).all(|pair| pair[0] >= pair[1]));
        prop_assert!((free.condition() - values[0] / values[SIZE - 2]).abs() < ROUNDING);
    }

    #[test]
    fn beside_known_unknowns_the_covariance_is_of_all_and_the_rank_of_what_is_left(
        hessian in hessian(), first in 0..SIZE - 2, count in 1_usize..3,
    ) {
        let known = first..first + count;
        let all = Information::beside(&hessian, &[], known.clone(), 1e-9).unwrap();
        prop_assert!(differ(&all.covariance(), &hessian.clone().try_inverse().unwrap()) < ROUNDING);
        prop_assert_eq!((all.size(), all.rank()), (SIZE, SIZE));
        // The remainder for the others is the inverse of their block of the covariance.
        let others: Vec<usize> = (0..SIZE).filter(|k| !known.contains(k)).collect();
        let block = hessian.clone().try_inverse().unwrap().select_rows(&others).select_columns(&others);
        let left = Information::new(&block.try_inverse().unwrap(), &[], 1e-9).unwrap();
        prop_assert!((all.singular_values() - left.singular_values()).abs().max() < ROUNDING);
        let root = all.covariance_root();
        let unit = root.transpose() * &hessian * root - DMatrix::identity(SIZE, SIZE);
        prop_assert!(unit.abs().max() < ROUNDING);
    }

    /// Kept directions stay unchanged. The others become directions without information: perpendicular to the kept ones, of
    /// unit length in comparable unknowns, and next to the fixed ones.
    #[test]
    fn dropped_directions_become_null_directions(hessian in hessian(), held in 0..SIZE, turn in 0.1..3.0_f64) {
        let all = Information::new(&hessian, &[held], 1e-9).unwrap();
        // Two orthonormal columns of five, neither along an axis.
        let (sin, cos) = turn.sin_cos();
        let kept = DMatrix::from_columns(&[
            DVector::from_vec(vec![cos, 0.6 * sin, 0.0, 0.8 * sin, 0.0]),
            DVector::from_vec(vec![-sin, 0.6 * cos, 0.0, 0.8 * cos, 0.0]),
        ]);
        let some = all.keeping(&kept);
        let root = all.covariance_root() * &kept;
        prop_assert!((some.covariance_root() - &root).abs().max() == 0.0);
        let null = some.null_space();
        prop_assert_eq!((some.rank(), null.shape()), (2, (SIZE, SIZE - 3)));
        prop_assert!(null.row(held).abs().max() < ROUNDING);
        let unit = null.transpose() * null - DMatrix::identity(SIZE - 3, SIZE - 3);
        prop_assert!(unit.abs().max() < ROUNDING);
        // As steps of the unknowns they do not move the kept directions.
        let steps = DMatrix::from_fn(SIZE, SIZE - 3, |i, j| null[(i, j)] / roots(&hessian)[i]);
        prop_assert!((root.transpose() * &hessian * steps).abs().max() < ROUNDING);
    }
}

#[test]
fn two_unknowns_that_go_together_have_the_condition_of_their_correlation() {
    let hessian = DMatrix::from_row_slice(2, 2, &[4.0, 0.6 * 20.0, 0.6 * 20.0, 100.0]);
    let information = Information::new(&hessian, &[], 1e-9).unwrap();
    // Scaled matrix: [1 c; c 1] with eigenvalues 1 ± c.
    assert!((information.condition() - (1.6_f64 / 0.4).sqrt()).abs() < 1e-14);
    assert_eq!(Information::new(&hessian, &[0, 1], 1e-9).unwrap().condition(), 1.0);
}

#[test]
fn a_direction_that_nothing_depends_on_is_null_and_the_threshold_decides() {
    // (1, −1) of the scaled unknowns has no effect, and neither has unknown 2.
    let hessian = DMatrix::from_row_slice(3, 3, &[4.0, 20.0, 0.0, 20.0, 100.0, 0.0, 0.0, 0.0, 0.0]);
    let information = Information::new(&hessian, &[], 1e-6).unwrap();
    assert_eq!((information.rank(), information.null_space().ncols()), (1, 2));
    assert!(information.condition() > 1e7);
    let steps = DMatrix::from_fn(3, 2, |i, j| information.null_space()[(i, j)] / [2.0, 10.0, 1.0][i]);
    // Rounding of the sums: 100 × eps.
    assert!((&hessian * steps).abs().max() < 1e-13);
    // The seen part has a variance of ¼ of a half of each alone: the pseudo-inverse of [1 1; 1 1] is a quarter of it.
    assert!((information.covariance()[(0, 0)] - 0.25 / 4.0).abs() < 1e-15);

    // Strongly correlated: the smaller singular value is √(0.01/1.99) = 0.071 of the larger.
    let near = DMatrix::from_row_slice(2, 2, &[1.0, 0.99, 0.99, 1.0]);
    let rank = |threshold| Information::new(&near, &[], threshold).unwrap().rank();
    assert_eq!([rank(0.07), rank(0.072)], [2, 1]);

    assert!(Information::new(&DMatrix::from_element(2, 2, f64::NAN), &[], 1e-9).is_none());
    assert!(Information::beside(&DMatrix::from_element(2, 2, f64::NAN), &[], 0..1, 1e-9).is_none());
    assert!(Information::beside(&hessian, &[], 2..3, 1e-9).is_none(), "nothing is known of it");
    assert_eq!(Information::beside(&near, &[], 1..1, 1e-9).unwrap().size(), 2, "nothing is known beforehand");
}

/// A threshold of zero leaves out exactly unseen directions, and no others; if nothing is seen, everything is left out.
#[test]
fn exactly_unobservable_unknowns_are_dropped_at_any_threshold() {
    let hessian = DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 0.0, 1e-20]));
    let information = Information::new(&hessian, &[], 0.0).unwrap();
    assert_eq!((information.size(), information.rank(), information.null_space().ncols()), (3, 2, 1));
    assert_eq!(information.null_space().column(0).iamax(), 1);
    let expected = DMatrix::from_diagonal(&DVector::from_vec(vec![0.25, 0.0, 1e20]));
    // Roots and squares of exact numbers.
    assert!((information.covariance() - expected).abs().max() < 1e5);
    assert!(information.condition().is_infinite());
    for threshold in [0.0, 1e-9] {
        let nothing = Information::new(&DMatrix::zeros(2, 2), &[], threshold).unwrap();
        assert_eq!((nothing.size(), nothing.rank(), nothing.null_space().ncols()), (2, 0, 2));
        assert_eq!(nothing.covariance(), DMatrix::zeros(2, 2));
    }
}
