//! The estimator on scans cast by the simulator: exact data, noise, constant attitude, and each trap with and without its cure.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::config::known_of_cell::KnownOfCell;
use crate::curve::answer::{Answered, Asked, squared_sigmas};
use crate::curve::arrow::SHARED;
use crate::curve::considered::Errors;
use crate::curve::equations::{Columns, Known, State, add_prior, add_sights, bends, sights, stepped};
use crate::curve::fit::{Terms, Weighing};
use crate::curve::graph::Graph;
use crate::curve::joint::first_curve;
use crate::curve::knots::reknotted;
use crate::curve::motion::Motion;
use crate::curve::order::{Obstacle, Ordered, obstacle, ordered, ordered_by};
use crate::curve::readings::{Light, Reading, Readings};
use crate::curve::rows::{Rows, Whitener};
use crate::curve::seen::Seen;
use crate::curve::sight::step_between;
use crate::curve::smoothness::{Parts, loosest_m};
use crate::curve::solve::Search;
use crate::input::noise_levels::NoiseLevels;
use nalgebra::{DVector, Vector2, Vector3};
use trueline_dataset::{Guess, Measured, Recording};
use trueline_geometry::{Trajectory, smooth};
use trueline_model::LaserSheet;
use trueline_sim::curves::{CurveKind, CurveScan, scan_curve};

mod cad;
mod considered;
mod plates;
mod seams;
mod traps;

/// A scan as input of the estimate, with its truth; without noise the path is exact.
fn readings(recording: &Recording, is_exact: bool) -> (Readings, Guess) {
    let origin = recording.robot[0].stamp_ns;
    let seconds = |stamp_ns: i64| (stamp_ns - origin) as f64 * 1e-9;
    let times: Vec<f64> = recording.robot.iter().map(|sample| seconds(sample.stamp_ns)).collect();
    let mut poses: Vec<_> = recording.robot.iter().map(|sample| sample.base_from_tool).collect();
    if !is_exact {
        poses = smooth::local_quadratic(&times, &poses, 0.016, smooth::HALF_WINDOW_S);
    }
    let list = recording.features.iter().enumerate().map(|(row, feature)| {
        let Measured::Profile([x, z]) = feature.measured else { unreachable!("a profiler") };
        Reading {
            stamp_s: seconds(feature.stamp_ns),
            point: Vector3::new(x, 0.0, z),
            in_sheet: Vector2::new(x, z),
            covariance: [4e-10, 0.0, 4e-10],
            row: row as u32,
            line: feature.line,
            off_m: Rows::zeros(),
            light: Light::Point,
        }
    });
    let readings = Readings {
        list: list.collect(),
        motion: Motion::new(&Trajectory::new(times, &poses).unwrap()),
        sheet: LaserSheet::of_profiler(),
        noise: NoiseLevels { robot_sigma_m: 0.0, stamp_sigma_s: 0.0, factor: 1.0 },
    };
    (readings, recording.truth.as_ref().unwrap().parameters)
}

fn answered(readings: &Readings) -> Option<Answered> {
    let search = Search { readings, within_s: 0.6, guess: None, threads: 2 };
    let known = KnownOfCell::default();
    Asked { search, errors: Errors::NONE, known: &known }.answer().ok()
}

/// The state of a scan at the truth, with a curve through its points.
fn at_truth(readings: &Readings, truth: &Guess) -> State {
    let first = first_curve(readings, truth).unwrap();
    reknotted(&first, 8e-3, None).unwrap()
}

/// Asserts that the columns of a reading are the differences of its prediction by every unknown.
///
/// Central differences over 1e-6 of quantities of about 0.2 m: second derivatives of 10/m leave 1e-11 over 1e-6, rounding 1e-10. The velocity of t_d
/// is that of 40 ms, and the path is straight for 4 ms: both change by some percent of 0.02 m/s.
fn assert_columns(readings: &Readings, state: &State, k: usize) {
    let one = Readings { list: vec![readings.list[k]], ..readings.clone() };
    let seen =
        |state: &State| sights(&one, &State { u_m: vec![state.u_m[k]], ..state.clone() }).remove(0).unwrap();
    let mut columns = Columns::new();
    columns.fill(state, &state.normals(), (&seen(state), &Whitener::identity()));
    let time = state.size() - SHARED;
    let mut indices: Vec<usize> = columns.found().iter().map(|(index, _)| *index).collect();
    indices.sort_unstable();
    indices.dedup();
    assert_eq!(indices.len(), columns.found().len(), "an unknown has one column");
    for (index, own) in columns.found() {
        let (size, most) = if *index == time { (4e-3, 3e-3) } else { (1e-6, 1e-6) };
        let residual = |size: f64| {
            let mut step = DVector::zeros(state.size());
            step[*index] = size;
            seen(&stepped(state, &step)).residual
        };
        let difference = (residual(-size) - residual(size)) / (2.0 * size);
        assert!((difference - own).norm() < most, "{k} {index}: {difference} {own}");
    }
}

#[test]
fn sights_follow_from_every_unknown_as_differences_say() {
    let (recording, _) = scan_curve(&CurveScan::good(CurveKind::Free).exact(), 3);
    let (readings, truth) = readings(&recording, true);
    let state = at_truth(&readings, &truth);
    for k in (20..readings.list.len() - 20).step_by(97) {
        assert_columns(&readings, &state, k);
    }
}

/// The gradient of the prior is that of half its squares with constant normals.
#[test]
fn the_prior_pulls_as_differences_say() {
    let (recording, _) = scan_curve(&CurveScan::good(CurveKind::Wavy).exact(), 3);
    let (readings, truth) = readings(&recording, true);
    let state = at_truth(&readings, &truth);
    let mut prior = state.arrow();
    add_prior(&mut prior, &state);
    let half = |step: &DVector<f64>| -> f64 {
        bends(&stepped(&state, step).spline).iter().map(|bend| 0.5 * bend.norm_squared()).sum()
    };
    let mut step = DVector::zeros(prior.size());
    for k in (0..2 * state.spline.control.len()).step_by(7) {
        step.fill(0.0);
        let by = |size: f64, step: &mut DVector<f64>| {
            step[k] = size;
            half(step)
        };
        let difference = (by(1e-7, &mut step) - by(-1e-7, &mut step)) / 2e-7;
        // Normals turn by the step over a knot: a third difference turns with them, by its own size.
        let scale = prior.gradient.amax().max(1e-6);
        assert!(
            (difference + prior.gradient[k]).abs() < 0.3 * scale,
            "{k}: {difference} {}",
            prior.gradient[k]
        );
    }
}

/// Without noise the answer is the truth up to the path, which is straight for 4 ms: at 0.3 m/s² it bends by 0.6 µm.
#[test]
fn exact_data_are_answered_exactly() {
    for kind in [CurveKind::Arc, CurveKind::Pipe] {
        let (recording, _) = scan_curve(&CurveScan::good(kind).exact(), 5);
        let (readings, truth) = readings(&recording, true);
        let answer = answered(&readings).unwrap();
        let off = step_between(&truth, &answer.at());
        assert_eq!(answer.curve.closed, kind.is_closed());
        assert!(answer.components.iter().all(|seen| *seen), "{}", kind.name());
        assert!(off[0].abs() < 2e-5 && off.fixed_rows::<3>(1).norm() < 1e-4, "{}: {off}", kind.name());
        assert!(off.fixed_rows::<3>(4).norm() < 5e-5, "{}: {off}", kind.name());
    }
}

/// Seven squared sigmas exceed 30 in one of ten thousand scans.
#[test]
fn noisy_scans_are_answered_within_their_sigma() {
    // A third of the arc is not observed. Over these pipes wrong offsets lay the passes beside each other and fit as well.
    for (kind, seed, unseen) in [
        (CurveKind::Pipe, 2, 0.0),
        (CurveKind::Pipe, 9, 0.0),
        (CurveKind::Straight, 11, 0.0),
        (CurveKind::Saddle, 12, 0.0),
        (CurveKind::Wavy, 13, 0.0),
        (CurveKind::Corner, 14, 0.0),
        (CurveKind::Eight, 1, 0.0),
        (CurveKind::Arc, 1, 0.3),
    ] {
        let (recording, _) = scan_curve(&CurveScan { unseen, ..CurveScan::good(kind) }, seed);
        let (readings, truth) = readings(&recording, false);
        let answer = answered(&readings).unwrap();
        assert!(answer.components.iter().all(|seen| *seen), "{}", kind.name());
        assert_eq!(answer.open().count(), 0, "{}", kind.name());
        let squared = squared_sigmas(&truth, &answer.at(), &answer.noise).unwrap();
        assert!(squared < 30.0, "{}: {squared}", kind.name());
    }
}

/// Readings at one attitude to the seam do not determine the lever, whatever the curve.
#[test]
fn a_constant_attitude_does_not_show_the_lever() {
    let flat = CurveScan { tilt_rad: 0.0, ..CurveScan::good(CurveKind::Wavy) };
    let (recording, _) = scan_curve(&flat, 21);
    let (readings, truth) = readings(&recording, false);
    let state = at_truth(&readings, &truth);
    let known = Known::of_any_sensor(&truth);
    let s3_m = loosest_m(state.spline.spacing_m) * 1e-4;
    let weighing = Weighing::Noise { factor: 2.0 };
    let fitted = Terms { readings: &readings, weighing, s3_m, known: &known, steps: 4 }.fit(state).unwrap();
    let parts = Parts::of(&fitted, &known);
    let seen = Seen::of(&fitted, &parts, s3_m, 1.0).unwrap();
    assert!(seen.rank < 7, "{}", seen.rank);
    assert!(!seen.components[4..].iter().all(|seen| *seen));
}

/// An outlier beyond a ring is its farthest point. With it the ring would be cut elsewhere, or would look open.
#[test]
fn an_outlier_is_no_end_of_a_ring() {
    let mut points: Vec<Vector3<f64>> = (0..300)
        .map(|k| {
            let a = f64::from(k) * std::f64::consts::TAU / 300.0;
            Vector3::new(0.04 * a.cos(), 0.04 * a.sin(), 0.005 * (2.0 * a).cos())
        })
        .collect();
    // 7.5 mm beyond the point that is farthest from the first: the radius is 7.7 mm, so that it has 5 neighbours, and a point of the ring 18.
    points.push(points[150] * 1.186);
    let found = ordered(&points).unwrap();
    assert!(found.closed && found.along_m[300].is_none());
    let with_all = Graph::of(&points).unwrap().with_all().largest_part();
    let spoilt = ordered_by(&with_all, &points).unwrap();
    assert!(!spoilt.closed && spoilt.along_m[300].is_some());
}

/// A stretch without seam points does not divide a seam; two seams side by side are two.
#[test]
fn a_short_gap_is_bridged_and_two_seams_are_not_joined() {
    let point = |k: usize, aside_m: f64| {
        let x = 0.3e-3 * (k / 2) as f64;
        Vector3::new(x, 0.01 * (20.0 * x).sin() + aside_m, 0.1e-3 * (k % 2) as f64)
    };
    let seam = |from: usize, to: usize, aside_m: f64| (from..to).map(move |k| point(k, aside_m));
    // 240 mm with 24 mm left out of them.
    let points: Vec<_> = seam(0, 800, 0.0).chain(seam(960, 1600, 0.0)).collect();
    let found = ordered(&points).unwrap();
    assert!(!found.closed && found.along_m.iter().all(Option::is_some));
    let straight_m = (points[1439] - points[0]).norm();
    assert!(found.length_m > straight_m && found.length_m < 1.1 * straight_m, "{}", found.length_m);
    // A gap of 70 of 240 mm is bridged: the sensor crossed it.
    let points: Vec<_> = seam(0, 560, 0.0).chain(seam(1026, 1600, 0.0)).collect();
    let found = ordered(&points).unwrap();
    assert!(!found.closed && found.along_m.iter().all(Option::is_some));
    // So are 130 mm, more than either part: the order of time decides.
    let points: Vec<_> = seam(0, 360, 0.0).chain(seam(1226, 1600, 0.0)).collect();
    assert!(ordered(&points).unwrap().along_m.iter().all(Option::is_some));
    // Side by side the parts have half of the points each, and neither has most of them.
    let points: Vec<_> = seam(0, 800, 0.0).chain(seam(0, 800, 0.03)).collect();
    assert!(ordered(&points).is_none());
    assert_eq!(obstacle(&points), Some(Obstacle::InPieces));
}

/// At the crossing of a figure eight the order goes straight on; without separated branches it turns off there.
#[test]
fn a_curve_that_crosses_itself_goes_straight_on() {
    const LAP: usize = 240;
    let points: Vec<Vector3<f64>> = (0..2 * LAP)
        .map(|k| {
            let place = CurveKind::Eight.point((k as f64 + 0.5 * (k / LAP) as f64) / LAP as f64);
            place + Vector3::new(0.0, 0.0, 0.05e-3 * (1.7 * k as f64).sin())
        })
        .collect();
    let length_m: f64 = (0..LAP).map(|k| (points[k + 1] - points[k]).norm()).sum();
    let found = ordered(&points).unwrap();
    assert!(found.closed && (found.length_m - length_m).abs() < 0.05 * length_m, "{}", found.length_m);
    assert!(found.along_m.iter().all(Option::is_some));
    // From point to point it advances by about as much as the point does, 1 to 3 mm, in one direction.
    let goes_on = |found: &Ordered| {
        let along_m: Vec<f64> = found.along_m.iter().map(|along_m| along_m.unwrap_or(f64::NAN)).collect();
        let steps = (1..LAP).map(|k| {
            let step = along_m[k] - along_m[k - 1];
            step - found.length_m * (step / found.length_m).round()
        });
        let steps: Vec<f64> = steps.collect();
        let sign = steps.iter().sum::<f64>().signum();
        steps.iter().all(|step| (-1e-3..8e-3).contains(&(sign * step)))
    };
    assert!(goes_on(&found));
    assert!(!goes_on(&ordered_by(&Graph::of(&points).unwrap(), &points).unwrap()));
}

/// The entry of the time offset is the sum of its whitened squares.
#[test]
fn the_equations_of_a_scan_are_those_of_its_sights() {
    let (recording, _) = scan_curve(&CurveScan::good(CurveKind::Pipe).exact(), 3);
    let (readings, truth) = readings(&recording, true);
    let state = at_truth(&readings, &truth);
    let own = sights(&readings, &state);
    let mut equations = state.arrow();
    let whiteners = crate::curve::equations::whiteners(&readings, &own);
    add_sights(&mut equations, &state, &own, &whiteners, &vec![1.0; own.len()]);
    let sum: f64 = own
        .iter()
        .zip(&whiteners)
        .filter_map(|(seen, whitener)| Some((whitener * seen.as_ref()?.by_shared.column(0)).norm_squared()))
        .sum();
    let shared = equations.shared();
    assert!((equations.entry(shared, shared) - sum).abs() < 1e-9 * sum);
}
