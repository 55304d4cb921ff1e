//! The camera from corners: truth, honesty of the covariance, wrong corners, distortion chosen by evidence.
#![allow(clippy::print_stdout, reason = "figures of the statistics, shown by --nocapture")]

use crate::scenes;

use nalgebra::{DMatrix, DVector, Vector2};
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use scenes::{board, camera, poses, view};
use trueline_sensor::intrinsics::{
    CameraFit, DistortionModel, Sensitivity, cross_validation, fit, next_picture,
};
use trueline_sensor::projection::to_vector;
use trueline_sensor::{Error, View, verdict};

fn views(count: usize, noise_px: f64, seed: u64) -> Vec<View> {
    let mut random = ChaCha12Rng::seed_from_u64(seed);
    poses(count).iter().map(|pose| view(&camera(), pose, noise_px, &mut random)).collect()
}

fn fitted(views: &[View], model: Option<DistortionModel>) -> CameraFit {
    fit(camera().size, &board(), views, model).unwrap()
}

#[test]
fn a_camera_is_recovered_from_corners_without_noise() {
    let fit = fitted(&views(10, 1e-9, 1), Some(DistortionModel::K1K2P1P2));
    let off = to_vector(&fit.state.camera) - to_vector(&camera());
    // Noise of 1e-9 px is one part in 2e8 of that of the test below, where focal lengths are known to half a pixel.
    assert!(off.fixed_rows::<4>(0).norm() < 1e-6, "{off}");
    assert!(off.fixed_rows::<5>(4).norm() < 1e-8, "{off}");
    assert!(fit.rms_px < 1e-8);
}

#[test]
fn a_board_that_no_picture_shows_whole_is_told() {
    let mut views = views(3, 0.1, 2);
    assert_eq!(verdict::never_whole(&views, &board()), None);
    for view in &mut views {
        view.complete = false;
        view.corners.retain(|corner| corner.column < 4);
    }
    let stated = [board().columns, board().rows];
    let told = verdict::never_whole(&views, &board());
    assert_eq!(told, Some(verdict::Remark::BoardNeverWhole { stated, seen: [4, stated[1]] }));
}

#[test]
fn the_covariance_is_honest() {
    // 60 sets: the mean of squared errors by their covariance, over its dimension, has a spread of
    // sqrt(2 / (60 × 8)) = 0.065 about one; 0.2 is three of them.
    let (sets, model) = (60, DistortionModel::K1K2P1P2);
    let (mut sum, mut inside, mut count) = (0.0, 0, 0);
    for seed in 0..sets {
        let fit = fitted(&views(8, 0.2, 100 + seed), Some(model));
        let off = to_vector(&fit.state.camera) - to_vector(&camera());
        let free = 8;
        let covariance = DMatrix::from_fn(free, free, |i, j| fit.covariance[(i, j)]);
        let step = DVector::from_fn(free, |k, _| off[k]);
        sum += step.dot(&covariance.clone().cholesky().unwrap().solve(&step)) / free as f64;
        for k in 0..free {
            inside += usize::from(step[k].abs() < 1.96 * covariance[(k, k)].sqrt());
            count += 1;
        }
    }
    let nees = sum / sets as f64;
    println!("NEES {nees}");
    assert!((nees - 1.0).abs() < 0.2, "NEES {nees}");
    // 480 intervals, eight of each set correlated: a spread of about sqrt(0.95 × 0.05 / 240) = 1.4 %.
    let part = f64::from(inside as u32) / f64::from(count as u32);
    println!("{part} of the intervals hold the truth");
    assert!((part - 0.95).abs() < 0.04, "{part} of the intervals hold the truth");
}

#[test]
fn the_distortion_is_chosen_by_evidence() {
    let fit = fitted(&views(12, 0.1, 5), None);
    assert!(fit.model >= DistortionModel::K1K2P1P2, "{:?}: tangential distortion was there", fit.model);
    assert_eq!(fit.evidence.len(), 5);
    let held = fitted(&views(12, 0.1, 5), Some(DistortionModel::None));
    assert!(held.rms_px > 3.0 * fit.rms_px, "a lens without its distortion does not fit");
    assert!(held.sigma()[4..].iter().all(|s| *s == 0.0));
}

#[test]
fn wrong_corners_and_a_wrong_picture_are_left_out() {
    let mut views = views(10, 0.1, 9);
    for k in 0..10 {
        views[3].corners[4 * k].pixel += Vector2::new(6.0, -8.0);
    }
    // A picture whose corners are all off by chance: motion blur, or a bent board.
    let mut random = ChaCha12Rng::seed_from_u64(77);
    views[7] = view(&camera(), &poses(10)[7], 3.0, &mut random);
    let fit = fitted(&views, Some(DistortionModel::K1K2P1P2));
    assert!(!fit.used[7].contains(&true), "the blurred picture is left out");
    let wrong = |n: usize| n.is_multiple_of(4) && n < 40;
    for (n, used) in fit.used[3].iter().enumerate() {
        assert_eq!(*used, !wrong(n), "corner {n}");
    }
    let off = to_vector(&fit.state.camera) - to_vector(&camera());
    for k in 0..4 {
        assert!(off[k].abs() < 4.0 * fit.sigma()[k], "{off}");
    }
    let (reasons, warnings) = verdict::of_camera(&fit, None);
    assert!(reasons.is_empty());
    assert_eq!(warnings[0].code(), "pictures-left-out");
}

#[test]
fn boards_square_to_the_view_do_not_show_the_focal_length() {
    let mut random = ChaCha12Rng::seed_from_u64(3);
    let flat: Vec<View> = (0..6)
        .map(|k| {
            let aside = nalgebra::Vector3::new(0.01 * f64::from(k) - 0.03, 0.0, 0.4);
            let pose = trueline_geometry::se3::from_parts(
                nalgebra::UnitQuaternion::identity(),
                aside - board().middle(),
            );
            view(&camera(), &pose, 0.2, &mut random)
        })
        .collect();
    match fit(camera().size, &board(), &flat, Some(DistortionModel::None)) {
        Ok(fit) => {
            let (reasons, _) = verdict::of_camera(&fit, None);
            assert_eq!(reasons[0].code(), "focal-length-uncertain");
        }
        Err(error) => assert!(matches!(error, Error::NotFixed | Error::NoPose), "{error}"),
    }
    let few = fit(camera().size, &board(), &flat[..2], None).unwrap_err();
    assert_eq!(few, Error::TooFewPictures { found: 2, needed: 3 });
}

#[test]
fn halves_agree_within_their_covariance_and_a_new_picture_helps() {
    let views = views(14, 0.2, 21);
    let fit = fitted(&views, Some(DistortionModel::K1K2P1P2));
    let halves = cross_validation::halves(camera().size, &board(), &views, fit.model).unwrap();
    // Eight degrees of freedom: chi-squared over eight is below 3.3 in 999 of 1000 cases.
    assert!(halves.normalized < 3.3, "{}", halves.normalized);
    let uncertainty = Sensitivity::of(&fit.state.camera).uncertainty(&fit.covariance);
    let next = next_picture::best(&fit, &board()).unwrap();
    assert!((next.now_px - uncertainty.rms_px()).abs() < 1e-12);
    assert!(next.then_px < next.now_px && next.then_px > 0.3 * next.now_px, "{next:?}");
}

#[test]
fn turning_the_camera_is_no_uncertainty() {
    // The principal point moves pixels as a rotation does, but for the perspective of the edges: of 10 px hardly any stays.
    let mut camera = camera();
    camera.distortion = trueline_model::BrownConrady::default();
    camera.focal *= 10.0;
    let sensitivity = Sensitivity::of(&camera);
    let mut step = to_vector(&camera) * 0.0;
    step[2] = 10.0;
    // The picture is 0.12 rad wide here: second order of that, 0.06² × 10 px / 2, is 0.02 px.
    assert!(sensitivity.movement(&step).rms_px() < 0.05);
    let mut focal = to_vector(&camera) * 0.0;
    focal[0] = 53.3;
    // One per cent of the width: 3.2 px at the edge, and nothing that a rotation could undo.
    assert!(sensitivity.movement(&focal).rms_px() > 1.5);
}
