//! Tests the quantities of a single observation, besides the sums, against independent geometry.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::config::{Config, ResidualKind};
use crate::input::noise_levels::{NoiseLevels, symmetric};
use crate::input::observations::{self, Observation, Observations};
use crate::input::timestamps::Sampling;
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::Parameters;
use crate::problem::placement::placement_at;
use crate::problem::simd::{Scan, SquaredLengths, Whitening, sweep};
use crate::problem::unknowns::TIME_OFFSET;
use crate::problem::usable::UsableObservations;
use nalgebra::{Matrix2, Vector3};
use trueline_geometry::{Pose, Trajectory};
use trueline_lsq::Loss;
use trueline_model::Placement;
use trueline_sim::{Preset, random_cell, simulate};

const NOISE: NoiseLevels = NoiseLevels { robot_sigma_m: 3e-5, stamp_sigma_s: 2e-4, factor: 1.3 };

fn cell(preset: Preset) -> (Observations, Parameters) {
    let mut scenario = random_cell(&preset.scenario(), 3, 0.5);
    scenario.timing.duration_s = 3.0;
    let recording = simulate(&scenario, 3).unwrap();
    let sampling = Sampling::of(&recording, observations::origin_ns(&recording));
    let observed = observations::observe(&recording, &sampling, &Config::default()).unwrap();
    let truth = recording.truth.unwrap();
    (observed, Parameters::straight(&truth.parameters, truth.lines))
}

fn problem<'a>(observed: &'a Observations, at: &Parameters, residual: ResidualKind) -> LineProblem<'a> {
    let criterion = Criterion { residual, loss: Loss::Squared };
    LineProblem::new(observed, &observed.list, criterion, &NOISE, at)
}

/// The observations that can be placed, with their placements.
fn placed<'a>(problem: &LineProblem<'a>, at: &Parameters) -> Vec<(&'a Observation, Placement)> {
    let all: Vec<_> = (problem.list.iter()).filter_map(|o| Some((o, problem.placement(o, at)?))).collect();
    assert!(all.len() > 50, "{}", all.len());
    all
}

/// The predicted point is on the line. Across the line a residual is therefore the distance of the measured point from it.
#[test]
fn across_the_seam_a_residual_is_the_distance_from_the_line() {
    for preset in [Preset::TwoLines, Preset::Profiler] {
        let (observed, truth) = cell(preset);
        let mut at = truth.clone();
        at.tool_from_camera.translation.vector += Vector3::new(1e-3, -2e-3, 5e-4);
        let problem = problem(&observed, &at, ResidualKind::Sheet);
        for (o, placement) in placed(&problem, &at) {
            let line = &at.lines[o.line as usize];
            let section = problem.in_cross_section(o, &at, &placement).unwrap();
            let off = line.offset_of(&placement.point_in_base(&o.point_in_camera));
            // Differences of metres.
            assert!((section.residual - off).norm() < 1e-13, "{} {off}", section.residual);
            let in_sheet = problem.in_sheet(o, &at, &placement).unwrap();
            assert_eq!(section.in_sheet, in_sheet.residual);
            // Both contain the same part of a motion across the line.
            let across = |in_sheet: nalgebra::Vector2<f64>| {
                let moved = placement.base_from_camera().rotation * (observed.sheet.axes() * in_sheet);
                line.axes().fixed_columns::<2>(1).transpose() * moved
            };
            let by_time = across(in_sheet.d_time_offset);
            assert!((section.jacobian.column(TIME_OFFSET) - by_time).norm() < 1e-13);
        }
        let to_line = super::observation_tests::problem(&observed, &at, ResidualKind::PointToLine);
        let (o, placement) = placed(&to_line, &at)[0];
        assert!(to_line.in_cross_section(o, &at, &placement).is_none());
        assert!(to_line.in_sheet(o, &at, &placement).is_some());
    }
}

#[test]
fn a_displacement_of_the_robot_moves_the_whitened_residual_as_said() {
    let (observed, at) = cell(Preset::TwoLines);
    for residual in [ResidualKind::Sheet, ResidualKind::PointToLine] {
        let problem = problem(&observed, &at, residual);
        let whiteners: Vec<_> = problem.whiteners.clone();
        let index = |o: &Observation| observed.list.iter().position(|other| std::ptr::eq(other, o)).unwrap();
        for (o, placement) in placed(&problem, &at).into_iter().step_by(7) {
            let pair = (o, &whiteners[index(o)]);
            let by = Vector3::new(1e-3, -2e-3, 3e-3);
            let mut moved = placement;
            moved.base_from_tool.translation.vector += by;
            let (before, _) = problem.whitened_where(pair, &at, &placement).unwrap();
            let (after, _) = problem.whitened_where(pair, &at, &moved).unwrap();
            let said = problem.whitened_displacement(pair, &at, &placement).unwrap() * by;
            // A straight line: linear except for rounding of metres, 1e-15, times whiteners of 1e5.
            assert!((after - before - said).norm() < 1e-8 * said.norm().max(1.0), "{said}");
        }
    }
}

/// The whitener scales the sum of feature, robot and stamp noise to one standard deviation. The shared errors and the feature's own noise add up to
/// it.
#[test]
fn shared_errors_and_the_features_own_are_one_standard_deviation() {
    let (observed, at) = cell(Preset::TwoLines);
    let sheet = problem(&observed, &at, ResidualKind::Sheet);
    let mut count = 0;
    for (o, whitener) in sheet.selected() {
        let Some((_, jacobian)) = sheet.whitened((o, whitener), &at) else { continue };
        let shared = sheet.shared_errors(&jacobian, &NOISE).unwrap();
        count += 1;
        let w = whitener.matrix();
        let own = w * symmetric(o.covariance) * w.transpose() * NOISE.factor.powi(2);
        // Whiteners are in single precision.
        let off = shared * shared.transpose() + own - Matrix2::identity();
        assert!(off.norm() < 1e-6, "{off}");
        // The robot acts like the displacement, and the stamp like the time offset.
        let placement = sheet.placement(o, &at).unwrap();
        let onto = sheet.whitened_displacement((o, whitener), &at, &placement).unwrap();
        let robot = onto * (NOISE.robot_sigma_m * NOISE.factor);
        let tool_from_base = placement.base_from_tool.rotation.inverse().to_rotation_matrix();
        assert!((shared.fixed_columns::<3>(0) * tool_from_base.matrix() - robot).norm() < 1e-12);
        let stamp = jacobian.column(TIME_OFFSET) * (NOISE.stamp_sigma_s * NOISE.factor);
        assert!((shared.column(3) - stamp).norm() < 1e-12);
    }
    assert!(count > 50);
    let to_line = problem(&observed, &at, ResidualKind::PointToLine);
    let pair = to_line.selected().nth(20).unwrap();
    let (_, jacobian) = to_line.whitened(pair, &at).unwrap();
    assert!(to_line.shared_errors(&jacobian, &NOISE).is_none());
}

#[test]
fn observations_without_placement_get_the_coarse_whitener() {
    let (observed, truth) = cell(Preset::Quick);
    let late = Parameters { time_offset_s: truth.time_offset_s + 1.0, ..truth };
    let mut whitening = Whitening::new(&observed.list, &NOISE);
    let scan =
        Scan { observations: &observed, list: &observed.list, at: &late, residual: ResidualKind::Sheet };
    sweep(&scan, &mut whitening);
    let problem = problem(&observed, &late, ResidualKind::Sheet);
    let mut counts = [0, 0];
    for (o, whitener) in observed.list.iter().zip(&whitening.whiteners) {
        let coarse = NOISE.coarse_whitener(o.covariance);
        let is_placed = problem.placement(o, &late).is_some();
        counts[usize::from(is_placed)] += 1;
        assert_eq!(whitener.0 == coarse.0, !is_placed);
    }
    assert!(counts.iter().all(|count| *count > 20), "{counts:?}");
    // A line along the sheet has no intersection.
    let mut along = late.clone();
    let (_, placement) = placed(&problem, &along)[0];
    let in_sheet = placement.base_from_camera().rotation * observed.sheet.axes().column(0).into_owned();
    along.lines[0] = trueline_geometry::Line::new(
        *along.lines[0].anchor(),
        &nalgebra::UnitVector3::new_normalize(in_sheet),
    );
    let mut whitening = Whitening::new(&observed.list, &NOISE);
    sweep(&Scan { at: &along, ..scan }, &mut whitening);
    let mut none = 0;
    for (o, whitener) in observed.list.iter().zip(&whitening.whiteners) {
        let met = problem.placement(o, &along).and_then(|placement| problem.in_sheet(o, &along, &placement));
        if met.is_none() {
            none += 1;
            assert_eq!(whitener.0, NOISE.coarse_whitener(o.covariance).0);
        }
    }
    assert!(none > counts[0], "{none}");
}

#[test]
fn the_root_mean_square_is_that_of_the_distances() {
    for preset in [Preset::TwoLines, Preset::Profiler] {
        let (observed, truth) = cell(preset);
        let mut at = truth;
        at.tool_from_camera.translation.vector += Vector3::new(1e-3, -2e-3, 5e-4);
        // A list of both lines whose length is no multiple of four.
        let list = &observed.list[3..];
        let mut distances = SquaredLengths::default();
        sweep(
            &Scan { observations: &observed, list, at: &at, residual: ResidualKind::PointToLine },
            &mut distances,
        );
        let problem = problem(&observed, &at, ResidualKind::Sheet);
        let squares: Vec<f64> = (list.iter())
            .filter_map(|o| {
                let point = problem.placement(o, &at)?.point_in_base(&o.point_in_camera);
                Some(at.lines[o.line as usize].distance(&point).powi(2))
            })
            .collect();
        let expected = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((distances.root_mean() / expected - 1.0).abs() < 1e-12);
    }
    assert_eq!(SquaredLengths::default().root_mean(), 0.0);
}

/// The path of a robot without the samples within these times.
fn with_gaps(observed: &Observations, gaps: &[std::ops::Range<f64>]) -> Observations {
    let trajectory = &observed.robot.trajectory;
    let kept = |t: &f64| !gaps.iter().any(|gap| gap.contains(t));
    let times: Vec<f64> = trajectory.times().iter().copied().filter(kept).collect();
    let poses: Vec<Pose> = times.iter().map(|t| trajectory.pose_at(*t).unwrap()).collect();
    let mut gapped = observed.clone();
    gapped.robot.trajectory = Trajectory::new(times, &poses).unwrap();
    gapped
}

#[test]
fn usable_is_what_stays_on_the_recording_wherever_the_offset_goes() {
    let (observed, at) = cell(Preset::Quick);
    let (offset_s, margin_s) = (at.time_offset_s, 0.013);
    for gaps in [vec![], vec![0.9..1.2], vec![0.9..1.2, 2.0..2.005, 2.3..2.5], vec![0.0..9.0]] {
        let whole = gaps.contains(&(0.0..9.0));
        let gapped = if whole { observed.clone() } else { with_gaps(&observed, &gaps) };
        // A recording of another hour has no observation on the path.
        let offset_s = if whole { offset_s + 3600.0 } else { offset_s };
        for margin_s in [0.0, margin_s, 0.3] {
            let usable = UsableObservations::within(&gapped, offset_s, margin_s);
            let trajectory = &gapped.robot.trajectory;
            let stays = |o: &&Observation| {
                (-100..=100).all(|k| {
                    let exposure_s = o.stamp_s - offset_s + margin_s * f64::from(k) / 100.0;
                    placement_at(trajectory, exposure_s, &at.tool_from_camera).is_some()
                })
            };
            let expected: Vec<u32> = gapped.list.iter().filter(stays).map(|o| o.row).collect();
            let found: Vec<u32> = usable.of(&gapped).iter().map(|o| o.row).collect();
            assert_eq!(found, expected, "{gaps:?} {margin_s}");
            assert_eq!((usable.len(), usable.is_empty()), (expected.len(), expected.is_empty()));
            let unbroken = gaps.is_empty() || whole || expected.len() < 2;
            assert_eq!(matches!(usable, UsableObservations::Part(_)), unbroken, "{gaps:?} {margin_s}");
        }
    }
}
