//! Tests the comparison of two calibrations: chance, motion, and the effect at the seam.

use nalgebra::{SMatrix, SVector, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use trueline_dataset::Guess;
use trueline_geometry::{se3, so3};
use trueline_method::evaluate::difference::{ANSWERS, Estimate, Field, between};

const FIELD: Field = Field { width_m: 0.1, depth_m: 0.04, stand_off_m: 0.3, speed_m_s: 0.05 };

/// 0.02 ms, 0.01° and 0.02 mm, with the correlation from a lever of 0.3 m.
fn covariance() -> SMatrix<f64, ANSWERS, ANSWERS> {
    let mut root = SMatrix::<f64, ANSWERS, ANSWERS>::zeros();
    root[(0, 0)] = 2e-5;
    for k in 0..3 {
        root[(1 + k, 1 + k)] = 1.7e-4;
        root[(4 + k, 4 + k)] = 2e-5;
        root[(4 + k, 1 + (k + 1) % 3)] = 5e-5;
    }
    root * root.transpose()
}

fn estimate(change: &SVector<f64, ANSWERS>) -> Estimate {
    let rotation =
        so3::exp(&Vector3::new(change[1], change[2], change[3])) * so3::exp(&Vector3::new(0.4, -1.1, 0.7));
    let translation = Vector3::new(0.062, -0.018, 0.145) + Vector3::new(change[4], change[5], change[6]);
    Estimate {
        parameters: Guess {
            time_offset_s: 0.0177 + change[0],
            tool_from_camera: se3::from_parts(rotation, translation),
        },
        covariance: covariance(),
    }
}

#[test]
fn chance_alone_moves_nothing_as_often_as_it_should() {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(4);
    let root = covariance().cholesky().unwrap().l();
    let mut draw = || root * SVector::<f64, ANSWERS>::from_fn(|_, _| StandardNormal.sample(&mut random));
    let differences: Vec<_> =
        (0..2000).map(|_| between(&estimate(&draw()), &estimate(&draw()), &FIELD).unwrap()).collect();
    let mean = differences.iter().map(|d| d.z).sum::<f64>() / 2000.0;
    let variance = differences.iter().map(|d| d.z * d.z).sum::<f64>() / 2000.0;
    // A standard normal deviate: 0 ± 0.022 and 1 ± 0.032. The cube root is off by 0.01.
    assert!(mean.abs() < 0.1 && (variance - 1.0).abs() < 0.15, "{mean} {variance}");
    // One in a thousand: 2 ± 1.4 of 2000.
    assert!(differences.iter().filter(|d| d.moved()).count() <= 8);
    let (shift, sigma) = differences.iter().fold((0.0, 0.0), |(shift, sigma), d| {
        (shift + d.seam_shift_rms_m.powi(2) / 2000.0, sigma + d.seam_shift_sigma_m.powi(2) / 2000.0)
    });
    // Both have the same expectation, from 2000 draws.
    assert!((shift / sigma - 1.0).abs() < 0.1, "{shift} {sigma}");
}

#[test]
fn a_moved_bracket_and_a_moved_clock_are_told_apart() {
    let nothing = SVector::zeros();
    let mut bracket = nothing;
    bracket[4] = 0.5e-3;
    let found = between(&estimate(&nothing), &estimate(&bracket), &FIELD).unwrap();
    assert!(found.moved() && found.bracket_moved() && !found.timing_moved());
    // Every point moves by the translation, exactly to first order.
    assert!(
        (found.seam_shift_rms_m - 0.5e-3).abs() < 1e-9 && (found.seam_shift_largest_m - 0.5e-3).abs() < 1e-9
    );
    assert!((found.translation_m.x - 0.5e-3).abs() < 1e-12);
    let mut clock = nothing;
    clock[0] = -1e-3;
    let found = between(&estimate(&nothing), &estimate(&clock), &FIELD).unwrap();
    assert!(found.moved() && found.timing_moved() && !found.bracket_moved());
    assert!((found.time_offset_s + 1e-3).abs() < 1e-15 && found.z_time < 0.0);
    // 1 ms at 50 mm/s.
    assert!((found.seam_shift_rms_m - 5e-5).abs() < 1e-9);
}

#[test]
fn a_turn_shifts_the_seam_by_its_lever() {
    let nothing = SVector::zeros();
    let mut turn = nothing;
    turn[2] = 1e-3;
    let (a, b) = (estimate(&nothing), estimate(&turn));
    let found = between(&a, &b, &FIELD).unwrap();
    // From the transforms themselves, at the corner of the field.
    let corner = nalgebra::Point3::new(0.05, 0.0, 0.32);
    let exact = (b.parameters.tool_from_camera * corner - a.parameters.tool_from_camera * corner).norm();
    assert!(exact <= found.seam_shift_largest_m * (1.0 + 1e-3), "{exact} {found:?}");
    assert!((found.rotation_rad - Vector3::new(0.0, 1e-3, 0.0)).norm() < 1e-12);
}

#[test]
fn without_a_covariance_there_is_no_verdict() {
    let mut unknown = estimate(&SVector::zeros());
    unknown.covariance = SMatrix::zeros();
    assert!(between(&unknown, &unknown, &FIELD).is_none());
}
