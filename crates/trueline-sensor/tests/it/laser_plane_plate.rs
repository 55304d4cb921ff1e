//! The laser plane from a plain plate before a robot.

use crate::scenes;

use nalgebra::{DVector, SMatrix, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use scenes::plate::{NONE, USUAL, base_from_plate, stops, tool_from_camera};
use scenes::{camera, plane};
use trueline_geometry::{Plane, Pose, se3};
use trueline_lsq::LeastSquares;
use trueline_lsq::check::gradient_error;
use trueline_sensor::bundle::CameraPrior;
use trueline_sensor::laser_plane::KnownCamera;
use trueline_sensor::laser_plane::plate::{PlateFit, PlateProblem, PlateState, SIZE, Support, fit_plate};
use trueline_sensor::projection::{CAMERA_SIZE, CameraVector};
use trueline_sensor::sheet_tilt;

/// Tilts of a good set of stops, rad.
const TILT_RAD: f64 = 0.45;

fn exact() -> KnownCamera {
    KnownCamera { camera: camera(), covariance: SMatrix::zeros() }
}

/// A guess of the hand-eye transform that is off by so much about and along some direction.
fn guess(turn_rad: f64, shift_m: f64, random: &mut ChaCha12Rng) -> Pose {
    let mut direction = || Vector3::from_fn(|_, _| random.random_range(-1.0..1.0_f64)).normalize();
    se3::retract_decoupled(&tool_from_camera(), &(direction() * turn_rad), &(direction() * shift_m))
}

/// (θ₁, θ₂, offset) of the truth, counted from the estimate.
fn off(fit: &PlateFit) -> Vector3<f64> {
    let tilt = sheet_tilt::axes(&fit.plane()).transpose() * plane().normal().into_inner();
    Vector3::new(tilt[0], tilt[1], plane().offset() - fit.plane().offset())
}

#[test]
fn the_gradient_is_that_of_the_cost() {
    let known = SMatrix::<f64, CAMERA_SIZE, CAMERA_SIZE>::from_diagonal(&CameraVector::from_column_slice(&[
        2.0, 2.0, 2.0, 2.0, 1e-3, 1e-2, 1e-6, 1e-6, 1e-2,
    ]));
    let supports: Vec<Support> =
        stops(9, TILT_RAD, USUAL, 3).iter().map(|stop| Support::of(&camera(), stop).unwrap()).collect();
    let problem = PlateProblem {
        sigmas_m: (0..9).map(|k| [1e-4, 5e-5 * (1.0 + f64::from(k))]).collect(),
        stops: supports,
        camera_prior: CameraPrior::new(&camera(), &known).unwrap(),
        rough_tool_from_camera: guess(0.3, 0.04, &mut ChaCha12Rng::seed_from_u64(1)),
    };
    let plate = base_from_plate();
    let normal = plate.rotation * Vector3::z();
    let state = PlateState {
        camera: camera(),
        laser_plane_in_camera: plane(),
        tool_from_camera: tool_from_camera(),
        plate_in_base: Plane::new(normal, normal.dot(&plate.translation.vector)).unwrap(),
    };
    // Everything off by something, so that no term vanishes.
    let some = DVector::from_fn(SIZE, |k, _| {
        let size = if k < 4 {
            1.0
        } else if k < 9 {
            1e-3
        } else {
            2e-3
        };
        size * (1.0 + k as f64).sin()
    });
    let state = problem.retract(&state, &some);
    // Steps of about a standard deviation of each unknown and less; gradients of up to 1e3 standard deviations.
    let steps = DVector::from_fn(SIZE, |k, _| {
        if k < 4 {
            1e-2
        } else if k < 9 {
            1e-4
        } else {
            1e-5
        }
    });
    let error = gradient_error(&problem, &state, &steps);
    assert!(error < 1e-5, "{error} standard deviations");
}

#[test]
fn without_noise_plane_and_hand_eye_are_found_from_any_guess_within_ten_degrees_and_thirty_millimetres() {
    let mut random = ChaCha12Rng::seed_from_u64(11);
    for seed in 0..20 {
        let rough = guess(10_f64.to_radians(), 0.030, &mut random);
        let fit = fit_plate(&exact(), &rough, &stops(15, TILT_RAD, NONE, seed)).unwrap();
        // Stops are never taken for better than 1 µm, so the offset's σ is 3 µm, and the rough guess pulls by (3 µm/50 mm)² of
        // 30 mm: 1e-10 m; less where the spread goes on to zero.
        let off = off(&fit);
        assert!(off.norm() < 1e-8, "{seed}: {off:?}");
        let (turn, shift) = se3::difference_decoupled(&fit.state.tool_from_camera, &tool_from_camera());
        assert!(turn.norm() < 1e-8 && shift.norm() < 1e-8, "{seed}: {turn:?} {shift:?}");
    }
}

#[test]
fn errors_are_as_large_as_they_are_said_to_be() {
    let mut random = ChaCha12Rng::seed_from_u64(5);
    let (sets, mut sum, mut inside) = (100, 0.0, 0);
    for seed in 0..sets {
        let rough = guess(0.1, 0.02, &mut random);
        let fit = fit_plate(&exact(), &rough, &stops(20, TILT_RAD, USUAL, 1000 + seed)).unwrap();
        let (off, covariance) = (off(&fit), fit.plane_covariance());
        sum += off.dot(&(covariance.try_inverse().unwrap() * off)) / 3.0;
        inside += (0..3).filter(|k| off[*k].abs() < 1.96 * covariance[(*k, *k)].sqrt()).count();
    }
    let nees = sum / f64::from(sets as u32);
    let part = inside as f64 / (3 * sets) as f64;
    // The mean over 100 sets of three numbers is good to √(2/300) = 0.08, the part of intervals to 1.3 %.
    assert!((0.75..1.3).contains(&nees), "{nees}");
    assert!((0.91..0.98).contains(&part), "{part}");
}

#[test]
fn at_one_attitude_the_offset_stays_unknown_however_the_tool_moves() {
    let rough = guess(0.05, 0.01, &mut ChaCha12Rng::seed_from_u64(2));
    let one = fit_plate(&exact(), &rough, &stops(20, 0.0, USUAL, 4)).unwrap();
    let many = fit_plate(&exact(), &rough, &stops(20, TILT_RAD, USUAL, 4)).unwrap();
    assert!(one.tilts_rad[0] < 1e-3 && many.tilts_rad[1] > 0.1, "{:?} {:?}", one.tilts_rad, many.tilts_rad);
    // The remainder is the rough hand-eye transform's 50 mm and 0.2 rad at 0.4 m.
    assert!(one.middle_sigma_m() > 5e-3, "{}", one.middle_sigma_m());
    assert!(many.middle_sigma_m() < 0.3e-3, "{}", many.middle_sigma_m());
}

#[test]
fn a_stop_with_the_pose_of_another_is_left_out() {
    let rough = guess(0.05, 0.01, &mut ChaCha12Rng::seed_from_u64(2));
    let mut stops = stops(20, TILT_RAD, USUAL, 8);
    stops[6].base_from_tool = stops[7].base_from_tool;
    let fit = fit_plate(&exact(), &rough, &stops).unwrap();
    let left_out: Vec<usize> = (0..20).filter(|k| !fit.stops[*k].used).collect();
    assert_eq!(left_out, [6]);
    let (off, covariance) = (off(&fit), fit.plane_covariance());
    for k in 0..3 {
        // Three numbers, none beyond 4.5 standard deviations.
        assert!(off[k].abs() < 4.5 * covariance[(k, k)].sqrt(), "{k}: {off:?}");
    }
}

#[test]
fn too_few_stops_and_stripes_of_no_plate_are_refused() {
    let rough = tool_from_camera();
    let error = fit_plate(&exact(), &rough, &stops(7, TILT_RAD, USUAL, 1)).unwrap_err();
    assert_eq!(error, trueline_sensor::Error::TooFewStops { found: 7, needed: 8 });
}
