//! Hand-eye and time offset from a board, at standstill and while the robot moves.
#![allow(clippy::print_stdout, reason = "figures of the statistics, shown by --nocapture")]

use crate::scenes;

use nalgebra::{DVector, SMatrix, SVector, Vector2, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};
use scenes::{board, camera};
use trueline_geometry::{Pose, Trajectory, se3, so3};
use trueline_lsq::check::gradient_error;
use trueline_sensor::board_hand_eye::closed_form::{ClosedForm, pairs};
use trueline_sensor::board_hand_eye::joint::{self, SIZE, TargetProblem};
use trueline_sensor::board_hand_eye::{BoardSighting, Carried, ErrorModel, RobotPath, Unknowns, moving};
use trueline_sensor::projection::{CAMERA_SIZE, from_vector, project_from_board, to_vector};
use trueline_sensor::{Error, FoundCorner};

fn truth() -> Unknowns {
    Unknowns {
        time_offset_s: 0.0432,
        tool_from_camera: se3::from_parts(
            so3::exp(&Vector3::new(0.4, -1.1, 0.7)),
            Vector3::new(0.05, -0.02, 0.11),
        ),
        base_from_target: se3::from_parts(
            so3::exp(&Vector3::new(2.0, 0.3, -0.5)),
            Vector3::new(1.0, 0.2, 0.3),
        ),
    }
}

const NOISE: ErrorModel =
    ErrorModel { position_m: 0.05e-3, rotation_rad: 4e-5, stamp_s: 0.1e-3, carries: Carried::Camera };
const CORNER_PX: f64 = 0.15;

/// The board's place in the camera's view at a time: a smooth motion that tilts to every side.
fn view(time_s: f64) -> Pose {
    let swing = |hertz: f64, phase: f64| (std::f64::consts::TAU * hertz * time_s + phase).sin();
    let turn = Vector3::new(0.35 * swing(0.31, 0.2), 0.35 * swing(0.23, 1.0), 0.3 * swing(0.17, 2.0));
    let rotation = so3::exp(&turn);
    let middle =
        Vector3::new(0.02 * swing(0.4, 0.5), 0.015 * swing(0.27, 3.0), 0.42 + 0.05 * swing(0.21, 1.5));
    se3::from_parts(rotation, middle - rotation * board().middle())
}

fn tool(time_s: f64) -> Pose {
    truth().base_from_target * view(time_s).inverse() * truth().tool_from_camera.inverse()
}

fn normals(random: &mut ChaCha12Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(random))
}

/// A recording of a moving robot before a board: the robot's poses, and stamped sightings.
struct Recorded {
    trajectory: Trajectory,
    stamps_s: Vec<f64>,
    sightings: Vec<BoardSighting>,
}

/// `seen_by` is the camera that the corners are interpreted with.
fn recorded(seed: u64, noise: f64, seen_by: &trueline_model::Camera) -> Recorded {
    let mut random = ChaCha12Rng::seed_from_u64(seed);
    let times: Vec<f64> = (0..2000).map(|k| 0.004 * f64::from(k)).collect();
    let poses: Vec<Pose> = times
        .iter()
        .map(|t| {
            let (shift, turn) =
                (normals(&mut random) * NOISE.position_m, normals(&mut random) * NOISE.rotation_rad);
            tool(*t) * se3::from_parts(so3::exp(&(turn * noise)), shift * noise)
        })
        .collect();
    let (mut stamps_s, mut sightings) = (Vec::new(), Vec::new());
    // A picture every sixth of a second: no two share a robot sample, whose noise is white here.
    for k in 0..45 {
        let exposed_s = 0.2 + 0.1667 * f64::from(k);
        let jitter: f64 = StandardNormal.sample(&mut random);
        stamps_s.push(exposed_s + truth().time_offset_s + jitter * NOISE.stamp_s * noise);
        sightings.push(sighted(&view(exposed_s), noise, seen_by, &mut random));
    }
    Recorded { trajectory: Trajectory::new(times, &poses).unwrap(), stamps_s, sightings }
}

/// A plain board is counted from either of two corners: chance decides which.
fn sighted(
    pose: &Pose,
    noise: f64,
    seen_by: &trueline_model::Camera,
    random: &mut ChaCha12Rng,
) -> BoardSighting {
    let (columns, rows, other_end) = (board().columns, board().rows, random.random_bool(0.5));
    let mut corners = Vec::new();
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let seen = project_from_board(&camera(), pose, &board().corner(column, row)).unwrap().pixel;
        let noise_px = normals(random).xy() * (CORNER_PX * noise);
        let (column, row) = if other_end { (columns - 1 - column, rows - 1 - row) } else { (column, row) };
        corners.push(FoundCorner { column, row, pixel: seen + Vector2::new(noise_px.x, noise_px.y) });
    }
    BoardSighting::of(seen_by, &board(), &corners, CORNER_PX).unwrap()
}

fn fitted(scan: &Recorded) -> joint::BoardFit {
    moving::calibrate(&board(), &scan.sightings, &scan.stamps_s, &scan.trajectory, &NOISE).unwrap()
}

/// Estimate less truth; the board may be counted from its other end as a whole.
fn off(found: &Unknowns) -> SVector<f64, SIZE> {
    let truth = truth();
    let mut off = SVector::<f64, SIZE>::zeros();
    off[0] = found.time_offset_s - truth.time_offset_s;
    let other = so3::exp(&(Vector3::z() * std::f64::consts::PI));
    let counted_otherwise = se3::from_parts(other, board().middle() - other * board().middle());
    let nearest = [truth.base_from_target, truth.base_from_target * counted_otherwise]
        .into_iter()
        .min_by(|a, b| {
            let angle = |p: &Pose| p.rotation.angle_to(&found.base_from_target.rotation);
            angle(a).total_cmp(&angle(b))
        })
        .unwrap();
    let poses =
        [(1, &found.tool_from_camera, &truth.tool_from_camera), (7, &found.base_from_target, &nearest)];
    for (at, found, true_one) in poses {
        let (turn, shift) = se3::difference_decoupled(found, true_one);
        off.fixed_rows_mut::<3>(at).copy_from(&turn);
        off.fixed_rows_mut::<3>(at + 3).copy_from(&shift);
    }
    off
}

fn stops(count: usize, axis: impl Fn(f64) -> Vector3<f64>) -> (Vec<Pose>, Vec<Pose>) {
    let tools: Vec<Pose> = (0..count)
        .map(|k| {
            let a = 1.7 * k as f64;
            se3::from_parts(so3::exp(&axis(a)), Vector3::new(0.1 * a.sin(), 0.2 * a.cos(), 0.05 * a))
        })
        .collect();
    let truth = truth();
    let seen = |tool: &Pose| truth.tool_from_camera.inverse() * tool.inverse() * truth.base_from_target;
    let boards = tools.iter().map(seen).collect();
    (tools, boards)
}

#[test]
fn every_closed_form_recovers_the_hand_eye_transform_from_exact_poses() {
    let (tools, boards) = stops(6, |a| Vector3::new(0.4 * a.sin(), 0.5 * a.cos(), 0.3 * (2.0 * a).sin()));
    for form in ClosedForm::ALL {
        let found = form.solve(&pairs(&tools, &boards)).unwrap();
        let (turn, shift) = se3::difference_decoupled(&found, &truth().tool_from_camera);
        // Exact poses of size one; the null vector of a normal matrix is good to the root of rounding.
        assert!(
            turn.norm() < 1e-6 && shift.norm() < 1e-6,
            "{}: {} {}",
            form.name(),
            turn.norm(),
            shift.norm()
        );
    }
    // Turning about one axis only leaves the shift along it free.
    let (tools, boards) = stops(6, |a| Vector3::new(0.0, 0.0, 0.5 * a.sin()));
    assert_eq!(ClosedForm::Park.solve(&pairs(&tools, &boards)), None);
}

#[test]
fn the_gradient_is_that_of_the_cost() {
    let scan = recorded(3, 1.0, &camera());
    let robot = RobotPath::Moving { trajectory: &scan.trajectory, stamps_s: &scan.stamps_s };
    // Counted as they come: half of the boards are half a turn off, so the residuals are as large as they can be.
    let near = Unknowns {
        time_offset_s: 0.041,
        tool_from_camera: se3::retract_decoupled(
            &truth().tool_from_camera,
            &Vector3::new(0.02, -0.03, 0.01),
            &Vector3::new(0.004, 0.002, -0.003),
        ),
        ..truth()
    };
    let problem = TargetProblem::whitened(&scan.sightings, robot, &NOISE, &near);
    // Steps that stay within one segment of the trajectory for the offset (4 ms; the distance to the nearest border
    // follows from the even stamps), and a ten-thousandth of a radian and of a metre.
    let mut steps = DVector::from_element(SIZE, 1e-4);
    steps[0] = 1e-6;
    let error = gradient_error(&problem, &near, &steps);
    // Residuals of thousands of standard deviations: the stencil's rounding is 1e-16 · 1e8 / 1e-2 of a standard deviation.
    assert!(error < 1e-4, "{error}");
}

#[test]
fn a_perfect_recording_is_recovered_whichever_corner_its_boards_are_counted_from() {
    let scan = recorded(5, 0.0, &camera());
    let fit = fitted(&scan);
    // Robot poses are straight between samples 4 ms apart: at 0.8 rad/s² of swing the path is off by
    // a T²/8 = 0.8 · 0.3 m · 2e-6 = 0.5 µm.
    let off = off(&fit.unknowns);
    assert!(off[0].abs() < 1e-5, "{off}");
    assert!(off.fixed_rows::<3>(1).norm() < 1e-5 && off.fixed_rows::<3>(4).norm() < 5e-6, "{off}");
    assert!(fit.used.iter().all(|used| *used));
}

#[test]
fn the_covariance_of_the_moving_board_is_honest() {
    // Interpolating between two samples averages the robot's white noise to 2/3 of its variance on average: the model
    // takes it whole, so squared errors may come out smaller by that.
    let (sets, mut sum, mut offsets) = (40, 0.0, 0.0);
    let (mut inside, mut count) = (0, 0);
    for seed in 0..sets {
        let fit = fitted(&recorded(100 + seed, 1.0, &camera()));
        let off = off(&fit.unknowns);
        sum += off.dot(&(fit.covariance.try_inverse().unwrap() * off)) / SIZE as f64;
        offsets += off[0].powi(2) / fit.covariance[(0, 0)];
        for k in 0..7 {
            inside += i32::from(off[k].abs() < 1.96 * fit.covariance[(k, k)].sqrt());
            count += 1;
        }
    }
    let (nees, of_offset) = (sum / sets as f64, offsets / sets as f64);
    let part = f64::from(inside) / f64::from(count);
    println!("NEES {nees}, of the time offset {of_offset}, {part} of the intervals hold the truth");
    // 40 sets of 13 numbers: a spread of √(2/520) = 0.06; between 2/3 and 1 with three of these.
    assert!((0.6..1.19).contains(&nees), "NEES {nees}");
    // One number: √(2/40) = 0.22.
    assert!((0.3..1.7).contains(&of_offset), "{of_offset}");
    // 280 intervals, correlated: √(0.95 · 0.05 / 140) = 1.8 %.
    assert!((0.89..=1.0).contains(&part), "{part}");
}

#[test]
fn what_is_uncertain_about_the_camera_moves_the_result_as_stated() {
    let scan = recorded(8, 0.0, &camera());
    let before = fitted(&scan);
    // One parameter after the other, off by what a good calibration leaves.
    let steps = [0.5, 0.5, 0.5, 0.5, 1e-3, 4e-3, 1e-4, 1e-4, 4e-3];
    for (k, step) in steps.into_iter().enumerate() {
        let mut vector = to_vector(&camera());
        vector[k] += step;
        let moved = fitted(&recorded(8, 0.0, &from_vector(camera().size, &vector)));
        let predicted = before.d_camera.column(k) * step;
        let change = off(&moved.unknowns) - off(&before.unknowns);
        // Linear to a hundredth: half a pixel of 533 is a thousandth, and weights move a little with it.
        let (a, b) = (change.fixed_rows::<3>(4), predicted.fixed_rows::<3>(4));
        assert!((a - b).norm() < 0.03 * b.norm() + 2e-7, "parameter {k}: {a} {b}");
    }
    let covariance = SMatrix::<f64, CAMERA_SIZE, CAMERA_SIZE>::from_diagonal_element(1e-4);
    assert!(before.covariance_with(&covariance)[(4, 4)] > before.covariance[(4, 4)]);
}

#[test]
fn wrong_sightings_are_left_out_and_a_robot_that_turns_about_one_axis_is_refused() {
    let mut scan = recorded(11, 1.0, &camera());
    for k in [7, 21] {
        scan.sightings[k].camera_from_board.translation.vector.x += 0.01;
    }
    let fit = fitted(&scan);
    let left_out: Vec<usize> = (0..fit.used.len()).filter(|k| !fit.used[*k]).collect();
    assert_eq!(left_out, [7, 21]);
    assert!((0.6..1.4).contains(&fit.squares_per_freedom), "{}", fit.squares_per_freedom);

    let times: Vec<f64> = (0..500).map(|k| 0.01 * f64::from(k)).collect();
    let about_one = |t: f64| {
        se3::from_parts(so3::exp(&(Vector3::z() * (0.4 * t.sin()))), Vector3::new(0.1 * t, 0.0, 0.5))
    };
    let poses: Vec<Pose> = times.iter().map(|t| about_one(*t)).collect();
    let trajectory = Trajectory::new(times, &poses).unwrap();
    let stamps_s: Vec<f64> = (0..30).map(|k| 0.3 + 0.13 * f64::from(k)).collect();
    let exact = |t: &f64| {
        let seen = truth().tool_from_camera.inverse() * about_one(*t).inverse() * truth().base_from_target;
        BoardSighting { camera_from_board: seen, ..scan.sightings[0] }
    };
    let sightings: Vec<BoardSighting> = stamps_s.iter().map(exact).collect();
    let error = moving::calibrate(&board(), &sightings, &stamps_s, &trajectory, &NOISE).unwrap_err();
    assert_eq!(error, Error::HandEyeNotFixed);
}

/// Errors of all but the time offset within four of their standard deviations: twelve of them beyond are one run in 1,300.
fn assert_hand_eye_within(fit: &joint::BoardFit, what: &str) {
    for (k, off) in off(&fit.unknowns).iter().enumerate().skip(1) {
        let sigma = fit.covariance[(k, k)].sqrt();
        assert!(off.abs() < 4.0 * sigma, "{what}, component {k}: {off} ± {sigma}");
    }
}

#[test]
fn stops_turned_by_up_to_95_degrees_have_no_time_offset_and_boards_counted_from_either_end_agree() {
    let mut random = ChaCha12Rng::seed_from_u64(11);
    let noise = ErrorModel { stamp_s: 0.0, ..NOISE };
    let (mut tools, mut sightings) = (Vec::new(), Vec::new());
    for k in 0..16 {
        // In an order in which neighbours are far apart.
        let about_view = (-95.0 + 190.0 * f64::from(k * 7 % 16) / 15.0).to_radians();
        let tilt = Vector3::new(0.5 * (1.9 * f64::from(k)).sin(), 0.5 * (2.3 * f64::from(k)).cos(), 0.0);
        let rotation = so3::exp(&(Vector3::z() * about_view)) * so3::exp(&tilt);
        let middle = Vector3::new(0.0, 0.0, 0.40 + 0.01 * f64::from(k % 5));
        let view = se3::from_parts(rotation, middle - rotation * board().middle());
        let (shift, turn) =
            (normals(&mut random) * noise.position_m, normals(&mut random) * noise.rotation_rad);
        let tool = truth().base_from_target * view.inverse() * truth().tool_from_camera.inverse();
        tools.push(tool * se3::from_parts(so3::exp(&turn), shift));
        sightings.push(sighted(&view, 1.0, &camera(), &mut random));
    }
    let robot = RobotPath::Stops(&tools);
    for guess in [None, Some((0.3, truth().tool_from_camera))] {
        let fit = moving::calibrate_along(&board(), &sightings, robot, &noise, guess).unwrap();
        assert_hand_eye_within(&fit, "stops");
        assert!(fit.used.iter().all(|used| *used));
        assert_eq!((fit.unknowns.time_offset_s, fit.covariance[(0, 0)]), (0.0, 0.0));
        // 84 degrees of freedom: 0.15 of a standard deviation.
        assert!((0.5..1.6).contains(&fit.squares_per_freedom), "{}", fit.squares_per_freedom);
    }
}

#[test]
fn a_time_offset_that_is_held_stays_and_pictures_a_second_apart_find_it() {
    let scan = recorded(21, 1.0, &camera());
    let path = RobotPath::MovingAtKnownOffset { trajectory: &scan.trajectory, stamps_s: &scan.stamps_s };
    let near = truth().tool_from_camera
        * se3::from_parts(so3::exp(&Vector3::new(0.05, 0.0, -0.05)), Vector3::x() * 0.01);
    let guess = Some((truth().time_offset_s, near));
    let fit = moving::calibrate_along(&board(), &scan.sightings, path, &NOISE, guess).unwrap();
    assert_hand_eye_within(&fit, "held");
    assert_eq!((fit.unknowns.time_offset_s, fit.covariance[(0, 0)]), (truth().time_offset_s, 0.0));
    // Every sixth picture: 1 s apart.
    let (sightings, stamps_s): (Vec<BoardSighting>, Vec<f64>) =
        scan.sightings.iter().zip(&scan.stamps_s).step_by(6).map(|(seen, stamp)| (*seen, *stamp)).unzip();
    let fit = moving::calibrate(&board(), &sightings, &stamps_s, &scan.trajectory, &NOISE).unwrap();
    assert_hand_eye_within(&fit, "slow");
    let (off_s, sigma_s) = (off(&fit.unknowns)[0], fit.covariance[(0, 0)].sqrt());
    assert!(off_s.abs() < 4.0 * sigma_s && sigma_s < 1e-3, "{off_s} ± {sigma_s}");
}
