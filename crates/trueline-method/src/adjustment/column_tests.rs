//! Tests the columns of the adjustment against differences of residuals in worlds changed by hand.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::adjustment::blocks::{Amplitude, Block, Kind};
use crate::adjustment::clamped::Clamped;
use crate::adjustment::columns::{Columns, Considered};
use crate::adjustment::form::Hats;
use crate::adjustment::seam_points::{SeamFrame, SeamPoints};
use crate::adjustment::sights::Sights;
use crate::assess::robot_field::{RobotField, RobotSigmas};
use crate::config::{Config, PartMoves, ResidualKind};
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{self, Observations};
use crate::input::timestamps::Sampling;
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::Parameters;
use crate::problem::unknowns::{LOCAL_ALL, LOCAL_STRAIGHT};
use crate::solve::seam_chart::{with_bows, with_shape};
use nalgebra::{DVector, Vector2, Vector3};
use trueline_geometry::{Trajectory, se3, so3};
use trueline_lsq::Loss;
use trueline_sim::{Preset, random_cell, simulate};

const NOISE: NoiseLevels = NoiseLevels { robot_sigma_m: 3e-5, stamp_sigma_s: 1e-4, factor: 1.0 };

fn cell() -> (Observations, Parameters) {
    let mut scenario = random_cell(&Preset::Good.scenario(), 3, 0.5);
    scenario.timing.duration_s = 4.0;
    let recording = simulate(&scenario, 3).unwrap();
    let sampling = Sampling::of(&recording, observations::origin_ns(&recording));
    let observed = observations::observe(&recording, &sampling, &Config::default()).unwrap();
    let truth = recording.truth.unwrap();
    let at = Parameters::straight(&truth.parameters, truth.lines);
    let at = with_shape(&observed, with_bows(&observed, &observed.list, at));
    (observed, at)
}

fn problem<'a>(observed: &'a Observations, at: &Parameters) -> LineProblem<'a> {
    let criterion = Criterion { residual: ResidualKind::Sheet, loss: Loss::Squared };
    LineProblem::new(observed, &observed.list, criterion, &NOISE, at)
}

fn some_frames(problem: &LineProblem<'_>, at: &Parameters) -> Vec<SeamFrame> {
    let scan = SeamPoints::of(problem, at);
    let frames: Vec<SeamFrame> = scan.frames(at).into_iter().flatten().step_by(11).collect();
    assert!(frames.len() > 8, "{}", frames.len());
    frames
}

/// Both rows of a block at a frame, times coefficients.
fn moved(block: &Block, frame: &SeamFrame, coefficients: &[f64]) -> Vector2<f64> {
    let mut rows = [vec![0.0; block.columns.end], vec![0.0; block.columns.end]];
    block.fill(frame, &mut rows);
    Vector2::from_fn(|row, _| {
        let own = &rows[row][block.columns.clone()];
        own.iter().zip(coefficients).map(|(by, coefficient)| by * coefficient).sum()
    })
}

/// Derivatives of the place along the seam, against differences.
#[test]
fn a_point_slides_along_the_seam_as_differences_say() {
    let (observed, at) = cell();
    let problem = problem(&observed, &at);
    let scan = SeamPoints::of(&problem, &at);
    for frame in some_frames(&problem, &at) {
        for k in (0..LOCAL_STRAIGHT).chain(LOCAL_STRAIGHT + 2..LOCAL_ALL) {
            let h = 1e-5;
            let there = |by: f64| {
                let mut step = DVector::zeros(at.dimension());
                step[k] = by;
                scan.residual(&frame, &at.retract(&step)).unwrap().1
            };
            let slope = (there(h) - there(-h)) / (2.0 * h);
            // The line itself moves no point. Differences of metres over 1e-5, and curvature of a second order.
            assert!((slope - frame.along_by_unknowns[k]).abs() < 1e-6, "{k}: {slope}");
        }
    }
}

/// A form of the seam moves a residual as a bow does that is the same at this place.
#[test]
fn a_form_moves_a_residual_as_the_seam_itself_does() {
    let (observed, at) = cell();
    let problem = problem(&observed, &at);
    let scan = SeamPoints::of(&problem, &at);
    let hats = Hats::over([-0.3, 0.3], 0.02, 1);
    let block = Block::new(Kind::Form { target: 0, directions: 2, hats, sigma_m: 1e-4 }, 0, Amplitude::HELD);
    for frame in some_frames(&problem, &at) {
        // A whole form of one height is the line beside itself.
        for direction in 0..2 {
            let coefficients: Vec<f64> =
                (0..2 * hats.count).map(|k| f64::from(u8::from(k / hats.count == direction))).collect();
            let by_form = moved(&block, &frame, &coefficients);
            let mut beside = at.clone();
            let across = at.lines[0].axes().column(1 + direction) * 1e-4;
            beside.lines[0] = trueline_geometry::Line::new(
                at.lines[0].anchor() + across,
                &nalgebra::UnitVector3::new_normalize(at.lines[0].direction()),
            );
            let by_line = scan.residual(&frame, &beside).unwrap().0 - frame.residual;
            // 0.1 mm is some hundred units of noise; the sheet's shape is flat to a second order in it.
            assert!((by_form - by_line).norm() < 1e-3 * by_line.norm() + 1e-6, "{by_form} {by_line}");
        }
    }
}

/// A part in another place moves a residual as its seam there does, and none before the end of the pass.
#[test]
fn a_moved_part_moves_a_residual_as_its_seam_there_does() {
    let (observed, at) = cell();
    let problem = problem(&observed, &at);
    let scan = SeamPoints::of(&problem, &at);
    let frames = some_frames(&problem, &at);
    let end_s = 0.5 * (frames[0].stamp_s + frames[frames.len() - 1].stamp_s);
    let middle = at.lines[0].anchor() + at.lines[0].direction() * 0.05;
    let moves = PartMoves { shift_m: 1e-5, turn_rad: 1e-4 };
    let clamped = Clamped { ends_s: vec![end_s], middle, moves };
    let block = Block::new(Kind::Part(clamped), 0, Amplitude::HELD);
    let place = [0.9, -1.3, 0.4, 0.7, 1.1, -0.6];
    let shift = Vector3::from_column_slice(&place[..3]) * moves.shift_m;
    let turn = so3::exp(&(Vector3::from_column_slice(&place[3..]) * moves.turn_rad));
    let mut there = at.clone();
    for seam in &mut there.lines {
        *seam = trueline_geometry::Line::new(
            middle + shift + turn * (seam.anchor() - middle),
            &nalgebra::UnitVector3::new_normalize(turn * seam.direction()),
        );
    }
    let mut moved_frames = 0;
    for frame in &frames {
        let by_block = moved(&block, frame, &place);
        if frame.stamp_s < end_s {
            assert_eq!(by_block, Vector2::zeros());
            continue;
        }
        moved_frames += 1;
        let by_line = scan.residual(frame, &there).unwrap().0 - frame.residual;
        // 0.02 mm and 0.01° change the slope of a seam by 2e-4, and the sheet is flat to a second order in them.
        assert!((by_block - by_line).norm() < 1e-3 * by_line.norm() + 1e-6, "{by_block} {by_line}");
    }
    assert!(moved_frames > 3, "{moved_frames}");
}

/// A robot that is off by a mode of its field moves a residual as a path does that was moved so.
#[test]
fn an_error_of_the_robot_moves_a_residual_as_another_path_does() {
    let (observed, at) = cell();
    let problem = problem(&observed, &at);
    let frames = some_frames(&problem, &at);
    let poses: Vec<_> = frames.iter().map(|frame| frame.base_from_tool).collect();
    let sigmas = RobotSigmas { position_m: 1e-5, attitude_rad: 1e-5 };
    let field = RobotField::new(sigmas, &poses).unwrap();
    let block = Block::new(Kind::Robot(field.clone()), 0, Amplitude::HELD);
    let coefficients: Vec<f64> = (0..block.columns.len()).map(|k| (k as f64 * 0.7).sin()).collect();
    let path = &observed.robot.trajectory;
    let off: Vec<_> = path
        .times()
        .iter()
        .map(|time| {
            let pose = path.pose_at(*time).unwrap();
            let (mut shift, mut turn) = (Vector3::zeros(), Vector3::zeros());
            for (mode, part) in field.at(&pose).iter().enumerate() {
                let three = |first: usize| Vector3::from_fn(|row, _| coefficients[first + row]) * *part;
                shift += three(6 * mode) * sigmas.position_m;
                turn += three(6 * mode + 3) * sigmas.attitude_rad;
            }
            se3::from_parts(so3::exp(&turn) * pose.rotation, pose.translation.vector + shift)
        })
        .collect();
    let mut elsewhere = observed.clone();
    elsewhere.robot.trajectory = Trajectory::new(path.times().to_vec(), &off).unwrap();
    let there = LineProblem { observations: &elsewhere, ..problem.of_some(problem.list, &problem.whiteners) };
    let scan = SeamPoints::of(&there, &at);
    for frame in &frames {
        let by_block = moved(&block, frame, &coefficients);
        let by_path = scan.residual(frame, &at).unwrap().0 - frame.residual;
        // Errors of a hundredth of a millimetre and modes of size ten: to a second order, and straight between samples of 4 ms.
        assert!((by_block - by_path).norm() < 5e-3 * by_path.norm() + 1e-4, "{by_block} {by_path}");
    }
}

/// Joints that lag by their own times move a residual as a path does that is late by a matrix times its twist.
#[test]
fn lags_of_joints_move_a_residual_as_a_late_path_does() {
    let (observed, at) = cell();
    let problem = problem(&observed, &at);
    let sigma_s = 1e-4;
    let block = Block::new(Kind::JointLags { sigma_s }, 0, Amplitude::HELD);
    let coefficients: Vec<f64> = (0..36).map(|k| (f64::from(k) * 0.7).sin()).collect();
    let path = &observed.robot.trajectory;
    // Lengths are 1, and angles 1/0.5 m.
    let scale = |k: usize| if k < 3 { 1.0 } else { 0.5 };
    let late: Vec<_> = path
        .times()
        .iter()
        .map(|time| {
            let pose = path.pose_at(*time).unwrap();
            let h = 0.004;
            let [before, after] = [-h, h].map(|by| path.pose_at(time + by).unwrap_or(pose));
            let twice =
                if path.pose_at(time - h).is_some() && path.pose_at(time + h).is_some() { 2.0 } else { 1.0 };
            let velocity = (after.translation.vector - before.translation.vector) / (twice * h);
            let turn = so3::log(&(after.rotation * before.rotation.inverse())) / (twice * h);
            let twist = [velocity.x, velocity.y, velocity.z, turn.x, turn.y, turn.z];
            let moved = |axis: usize| -> f64 {
                let of = |k: usize| coefficients[6 * k + axis] * twist[k] * scale(k) / scale(axis);
                (0..6).map(of).sum::<f64>() * sigma_s
            };
            let (shift, rotation) =
                (Vector3::from_fn(|k, _| moved(k)), Vector3::from_fn(|k, _| moved(3 + k)));
            se3::from_parts(so3::exp(&rotation) * pose.rotation, pose.translation.vector + shift)
        })
        .collect();
    let mut elsewhere = observed.clone();
    elsewhere.robot.trajectory = Trajectory::new(path.times().to_vec(), &late).unwrap();
    let there = LineProblem { observations: &elsewhere, ..problem.of_some(problem.list, &problem.whiteners) };
    let scan = SeamPoints::of(&there, &at);
    for frame in some_frames(&problem, &at) {
        let by_block = moved(&block, &frame, &coefficients);
        let by_path = scan.residual(&frame, &at).unwrap().0 - frame.residual;
        // The twist of a piece of 4 ms carries the noise of two samples: 0.03 mm in 4 ms are some mm/s of 100 mm/s.
        assert!((by_block - by_path).norm() < 0.1 * by_path.norm() + 0.02, "{by_block} {by_path}");
    }
}

/// The radius of the edge moves the measured point towards the sensor, less the mean of the scan.
#[test]
fn the_radius_of_an_edge_moves_the_point_towards_the_sensor() {
    let (observed, at) = cell();
    let problem = problem(&observed, &at);
    let mean_view = vec![Vector3::new(0.1, -0.2, 0.3)];
    let edge = Considered::EdgeRadius { sigma_m: 1e-4, mean_view: mean_view.clone() };
    let columns = Columns::of(&at, &[], vec![edge]);
    for frame in some_frames(&problem, &at) {
        let view = frame.towards_sensor;
        assert!(view.dot(&at.lines[0].direction()).abs() < 1e-12 && (view.norm() - 1.0).abs() < 1e-12);
        let mut rows = [vec![0.0; columns.width()], vec![0.0; columns.width()]];
        columns.fill(&frame, &DVector::zeros(columns.estimated()), &mut rows);
        let by_point = frame.by_shift * (view - mean_view[0]) * 1e-4;
        let by_column = rows.map(|row| row[columns.width() - 1]);
        assert!((by_column[0] - by_point.x).abs() < 1e-12 && (by_column[1] - by_point.y).abs() < 1e-12);
    }
}

/// On a steep form, a shift along the seam also moves the point across it.
#[test]
fn a_steep_form_couples_the_place_along_the_seam() {
    let (observed, at) = cell();
    let problem = problem(&observed, &at);
    let mut columns = Columns::of(&at, &[], Vec::new());
    let hats = Hats::over([-0.3, 0.3], 0.02, 1);
    let block = Block::new(
        Kind::Form { target: 0, directions: 2, hats, sigma_m: 1e-4 },
        columns.estimated(),
        Amplitude::HELD,
    );
    columns.blocks.push(block);
    let mut coefficients = DVector::zeros(columns.estimated());
    // A slope of 0.05 in the second direction: 1 mm over 20 mm are ten units of 0.1 mm.
    for k in 0..hats.count {
        coefficients[at.dimension() + hats.count + k] = 10.0 * k as f64;
    }
    for frame in some_frames(&problem, &at) {
        assert!((columns.slopes(&frame, &coefficients)[1] - 0.05).abs() < 1e-12);
        let width = columns.width();
        let mut rows = [vec![0.0; width], vec![0.0; width]];
        columns.fill(&frame, &coefficients, &mut rows);
        for k in 0..at.dimension() {
            let slid = frame.by_shift * frame.across[1] * (-0.05 * frame.apart_by_unknowns[k]);
            for (row, numbers) in rows.iter().enumerate() {
                assert!((numbers[k] - frame.by_unknowns[(row, k)] - slid[row]).abs() < 1e-9);
            }
        }
    }
}
