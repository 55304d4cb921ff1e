//! Tests scans in simulated cells with unknown external axes.

use trueline_dataset::axes::{AxisGuess, AxisValue};
use trueline_dataset::{Carries, Feature, Recording, RobotSample};
use trueline_geometry::{Axis, AxisKind};
use trueline_method::axes::finding::{AxisFinding, AxisPart};
use trueline_method::diagnose::doctor::diagnose;
use trueline_method::error::AxisMistake;
use trueline_method::{Calibration, Config, Error, Status, calibrate};
use trueline_sim::{
    AxisCourse, Disturbance, Preset, Scenario, SimulatedAxis, random_cell, simulate_with_axes,
};

fn scenario(seed: u64) -> Scenario {
    random_cell(&Preset::Good.scenario(), seed, 0.3)
}

fn swing() -> AxisCourse {
    AxisCourse::Swings { by: 30f64.to_radians(), hz: 0.11 }
}

fn stands(angles: &[f64]) -> AxisCourse {
    AxisCourse::Stands(angles.iter().map(|a| a.to_radians()).collect())
}

/// A scan with unknown axes.
fn scan(scenario: &Scenario, axes: &[SimulatedAxis], seed: u64) -> Recording {
    let mut recording = simulate_with_axes(scenario, axes, seed).unwrap();
    recording.axes.iter_mut().for_each(|axis| axis.known = None);
    recording
}

/// Errors of an axis: direction (rad), place (m) and time offset (s).
fn errors(found: &Axis, truth: &Axis) -> [f64; 3] {
    let off = truth.point_m - found.point_m;
    let square = off - truth.direction.as_ref() * truth.direction.dot(&off);
    let place_m = if truth.kind == AxisKind::Rotary { square.norm() } else { 0.0 };
    [found.direction.angle(&truth.direction), place_m, (found.time_offset_s - truth.time_offset_s).abs()]
}

/// Limit of the error in standard deviations: four in any direction, and two orthogonal directions give 4 √2.
const SIGMAS: f64 = 5.7;

fn check_axis(found: &AxisFinding, truth: &Axis, shown: [bool; 3], what: &str) {
    let errors = errors(&found.axis, truth);
    for ((part, error), is_shown) in AxisPart::ALL.into_iter().zip(errors).zip(shown) {
        let sigma = found.sigma(part);
        assert_eq!(sigma.is_some(), is_shown, "{what} {part:?} {sigma:?}");
        if let Some(sigma) = sigma {
            assert!(error < SIGMAS * sigma, "{what} {part:?}: {error:e} of {sigma:e}");
        }
    }
}

fn check_offset(calibration: &Calibration, recording: &Recording, what: &str) {
    let offset = calibration.time_offset().unwrap();
    let truth_s = recording.truth.as_ref().unwrap().parameters.time_offset_s;
    let (error_s, sigma_s) = ((offset.value_s - truth_s).abs(), offset.sigma_s.unwrap());
    assert!(error_s < 4.5 * sigma_s, "{what}: {error_s:e} of {sigma_s:e}");
}

fn accepted(recording: &Recording, what: &str) -> Calibration {
    let calibration = calibrate(recording, None, &Config::default()).unwrap();
    assert_eq!(calibration.status(), Status::Accepted, "{what}: {:?}", calibration.reasons());
    check_offset(&calibration, recording, what);
    calibration
}

#[test]
fn every_axis_is_found_without_a_guess_within_its_uncertainty() {
    let (rotary, linear) = (AxisKind::Rotary, AxisKind::Linear);
    let slide = AxisCourse::Swings { by: 0.2, hz: 0.11 };
    // A scan's evidence of direction, place and time offset. Of one that runs evenly nothing shows the time offset; of a
    // track along one straight seam nothing shows which way it goes along that.
    let rows = [
        (rotary, Carries::Part, swing(), [true; 3]),
        (rotary, Carries::Part, stands(&[0.0, 60.0, 120.0]), [true; 3]),
        (rotary, Carries::Part, stands(&[20.0]), [false; 3]),
        (rotary, Carries::Part, AxisCourse::Runs(0.1), [true, true, false]),
        (rotary, Carries::Robot, swing(), [true; 3]),
        (rotary, Carries::Sensor, swing(), [true; 3]),
        (linear, Carries::Robot, slide.clone(), [false, false, true]),
        (linear, Carries::Part, slide.clone(), [false, false, true]),
        (linear, Carries::Sensor, slide, [true, false, true]),
    ];
    for (seed, (kind, carries, course, shown)) in (11..).zip(rows) {
        let what = format!("{kind:?} {carries:?} {course:?}");
        let scenario = scenario(seed);
        let axis = SimulatedAxis::somewhere("axis", (kind, carries), course, &scenario, seed);
        let recording = scan(&scenario, std::slice::from_ref(&axis), seed);
        let calibration = accepted(&recording, &what);
        check_axis(&calibration.findings.axes[0], &axis.axis, shown, &what);
        let hidden = calibration.warnings().iter().filter(|w| w.code() == "axis-not-shown").count();
        let linear_place = usize::from(kind == AxisKind::Linear);
        let unshown = shown.iter().filter(|shown| !**shown).count() - linear_place;
        assert_eq!(
            hidden,
            if shown == [false; 3] { 1 } else { unshown },
            "{what}: {:?}",
            calibration.warnings()
        );
    }
}

/// A scan without noise leaves only the pieces of straight path between samples, below a micrometre. An offset is as much as
/// the table turns in it: at 19°/s and 0.3 m 0.1 ms are 10 µm.
#[test]
fn a_scan_without_noise_gives_the_axis_to_a_few_micrometres() {
    let mut scenario = scenario(5);
    scenario.disturbance = Disturbance::default();
    let axis = SimulatedAxis::somewhere("table", (AxisKind::Rotary, Carries::Part), swing(), &scenario, 5);
    let recording = scan(&scenario, std::slice::from_ref(&axis), 5);
    let calibration = calibrate(&recording, None, &Config::default()).unwrap();
    let [direction_rad, place_m, offset_s] = errors(&calibration.findings.axes[0].axis, &axis.axis);
    assert!(
        direction_rad < 1e-4 && place_m < 3e-5 && offset_s < 1e-4,
        "{direction_rad:e} {place_m:e} {offset_s:e}"
    );
}

/// Without readings during rotation, two stops leave two axes, both of which map one seam to the other.
#[test]
fn two_stands_show_neither_direction_nor_place() {
    let scenario = scenario(13);
    let (rotary, part) = (AxisKind::Rotary, Carries::Part);
    let axis = SimulatedAxis::somewhere("table", (rotary, part), stands(&[0.0, 60.0]), &scenario, 13);
    let mut recording = scan(&scenario, std::slice::from_ref(&axis), 13);
    let record = recording.axes[0].clone();
    let stands_at = |stamp_ns: i64| {
        let near = record.values.iter().filter(|value| (value.stamp_ns - stamp_ns).abs() < 600_000_000);
        let all: Vec<f64> = near.map(|value| value.value).collect();
        all.iter().all(|value| *value == all[0])
    };
    recording.features.retain(|feature| stands_at(feature.stamp_ns));
    let calibration = accepted(&recording, "two stands");
    let found = &calibration.findings.axes[0];
    assert_eq!([AxisPart::Direction, AxisPart::Place].map(|part| found.sigma(part)), [None; 2]);
}

/// A positioner that tilts and rotates. One of the two axes is roughly known.
#[test]
fn two_axes_are_found_where_one_is_roughly_known() {
    let scenario = scenario(8);
    let (rotary, part) = (AxisKind::Rotary, Carries::Part);
    let tilt = AxisCourse::Swings { by: 0.3, hz: 0.07 };
    let axes = [
        SimulatedAxis::somewhere("tilt", (rotary, part), tilt, &scenario, 81),
        SimulatedAxis::somewhere("turn", (rotary, part), swing(), &scenario, 82),
    ];
    let mut recording = scan(&scenario, &axes, 8);
    let open = calibrate(&recording, None, &Config::default());
    assert!(matches!(open, Err(Error::AxesNeedGuess { .. })), "{open:?}");
    // 4° and 20 mm off.
    let lean = axes[0].axis.across().column(0) * 0.07;
    let direction = nalgebra::UnitVector3::new_normalize(axes[0].axis.direction.as_ref() + lean);
    let point_m = Some(axes[0].axis.point_m.add_scalar(0.012));
    recording.axes[0].guess = Some(AxisGuess { direction, point_m, sigma: [None; 2] });
    let calibration = accepted(&recording, "positioner");
    for (found, axis) in calibration.findings.axes.iter().zip(&axes) {
        check_axis(found, &axis.axis, [true; 3], &axis.name);
    }
}

/// The controller's poses already contain its table: the estimate is the table's real place.
#[test]
fn an_axis_within_the_poses_is_corrected() {
    let scenario = scenario(9);
    let mut axis =
        SimulatedAxis::somewhere("table", (AxisKind::Rotary, Carries::Part), swing(), &scenario, 9);
    axis.axis.time_offset_s = 0.0;
    let mut recording = scan(&scenario, std::slice::from_ref(&axis), 9);
    // The controller's own axis is 1° and 5 mm off. It reports the tool in the table's frame.
    let lean = axis.axis.across().column(1) * 0.017;
    let nominal = Axis {
        direction: nalgebra::UnitVector3::new_normalize(axis.axis.direction.as_ref() + lean),
        point_m: axis.axis.point_m + axis.axis.across().column(0) * 0.005,
        ..axis.axis
    };
    let values = recording.axes[0].values.clone();
    for sample in &mut recording.robot {
        let next = values.partition_point(|value| value.stamp_ns <= sample.stamp_ns);
        let [before, after] = [values[next - 1], values[next]];
        let part = (sample.stamp_ns - before.stamp_ns) as f64 / (after.stamp_ns - before.stamp_ns) as f64;
        let value = before.value + part * (after.value - before.value);
        sample.base_from_tool = nominal.motion(value).inverse() * sample.base_from_tool;
    }
    recording.axes[0].in_pose = true;
    recording.axes[0].guess =
        Some(AxisGuess { direction: nominal.direction, point_m: Some(nominal.point_m), sigma: [None; 2] });
    let calibration = accepted(&recording, "in pose");
    check_axis(&calibration.findings.axes[0], &axis.axis, [true; 3], "in pose");
}

#[test]
fn a_mistake_in_an_axis_record_is_reported() {
    let scenario = scenario(10);
    let axis = SimulatedAxis::somewhere("table", (AxisKind::Rotary, Carries::Part), swing(), &scenario, 10);
    let recording = scan(&scenario, std::slice::from_ref(&axis), 10);
    let mistake = |change: &dyn Fn(&mut Recording)| {
        let mut changed = recording.clone();
        change(&mut changed);
        match calibrate(&changed, None, &Config::default()) {
            Err(Error::AxisNotFound { instead, .. }) => instead,
            Err(other) => panic!("{other}"),
            Ok(other) => panic!("{:?}", other.reasons()),
        }
    };
    let carries_sensor = mistake(&|recording| recording.axes[0].carries = Carries::Sensor);
    assert_eq!(carries_sensor, Some(AxisMistake::Carries(Carries::Part)));
    let in_radians = mistake(&|recording| {
        recording.axes[0].values.iter_mut().for_each(|value| value.value = value.value.to_radians());
    });
    assert_eq!(in_radians, Some(AxisMistake::ValuesInRadians));
}

/// A recording with a moving axis cannot be placed without knowledge of the axis.
#[test]
fn an_axis_that_nobody_knows_is_not_ignored() {
    let scenario = scenario(12);
    let axis = SimulatedAxis::somewhere("table", (AxisKind::Rotary, Carries::Part), swing(), &scenario, 12);
    let recording = scan(&scenario, std::slice::from_ref(&axis), 12);
    let guess = recording.truth.as_ref().unwrap().parameters;
    let placed = trueline_method::evaluate::seam_points::place(&recording, &guess, &Config::default());
    assert!(matches!(placed, Err(Error::AxisUnknown { .. })));
}

/// An inexact robot and detector make nothing more certain: the additional hypotheses, a lag above all, are not part of the
/// ±.
#[test]
fn errors_widen_the_uncertainty_of_an_axis() {
    let mut scenario = scenario(14);
    // Little tilt: the axis is weakly known.
    scenario.scan.tilts.iter_mut().for_each(|tilt| tilt.amplitude *= 0.4);
    let axis = SimulatedAxis::somewhere("table", (AxisKind::Rotary, Carries::Part), swing(), &scenario, 14);
    let recording = scan(&scenario, std::slice::from_ref(&axis), 14);
    let sigmas = |config: &Config| {
        let calibration = calibrate(&recording, None, config).unwrap();
        AxisPart::ALL.map(|part| calibration.findings.axes[0].sigma(part).unwrap())
    };
    let exact = sigmas(&Config { robot_accuracy_m: Some(0.0), feature_bias_px: 0.0, ..Config::default() });
    let usual = sigmas(&Config::default());
    for ((part, exact), usual) in AxisPart::ALL.into_iter().zip(exact).zip(usual) {
        // The noise is estimated beside other errors: from 600 frames to 3 %.
        assert!(usual > 0.9 * exact, "{part:?}: {exact:e} and {usual:e}");
    }
}

#[test]
fn the_doctor_reports_a_wrong_axis_record() {
    let scenario = scenario(15);
    let (rotary, part) = (AxisKind::Rotary, Carries::Part);
    let axis = SimulatedAxis::somewhere("table", (rotary, part), swing(), &scenario, 15);
    let recording = scan(&scenario, std::slice::from_ref(&axis), 15);
    // The direction is stated, and the values have the opposite sign.
    let guess =
        AxisGuess { direction: axis.axis.direction, point_m: Some(axis.axis.point_m), sigma: [None; 2] };
    let mut changed = recording;
    changed.axes[0].guess = Some(guess);
    changed.axes[0].values.iter_mut().for_each(|value| value.value *= -1.0);
    let mut explained = diagnose(&changed, &Config::default(), None, |_| {}).explained_by;
    explained.sort();
    // A table that rotates the other way and a column under the robot are the same motion.
    assert_eq!(explained, ["axis table: carries the robot", "axis table: wrong sign"]);
}

/// The same readings with a robot that stands at each of them.
fn at_stops(moving: &Recording, axis: &SimulatedAxis) -> Recording {
    let late_ns = |seconds: f64| (seconds * 1e9) as i64;
    let offset_ns = late_ns(moving.truth.as_ref().unwrap().parameters.time_offset_s);
    let mut stops = Recording { at_stops: true, initial: None, truth: None, ..moving.clone() };
    (stops.robot, stops.features) = (Vec::new(), Vec::new());
    stops.axes[0].values.clear();
    let readings = moving.features.iter().step_by(10);
    for (feature, stamp_ns) in readings.zip((1_000_000_000..).step_by(1_000_000_000)) {
        let exposed_ns = feature.stamp_ns - offset_ns;
        let next = moving.robot.partition_point(|sample| sample.stamp_ns <= exposed_ns);
        let [before, after] = [&moving.robot[next - 1], &moving.robot[next]];
        let part = (exposed_ns - before.stamp_ns) as f64 / (after.stamp_ns - before.stamp_ns) as f64;
        let base_from_tool = before.base_from_tool.lerp_slerp(&after.base_from_tool, part);
        stops.robot.push(RobotSample { stamp_ns, device_ns: None, base_from_tool });
        stops.features.push(Feature { stamp_ns, device_ns: None, ..*feature });
        let values = &moving.axes[0].values;
        let stamped_ns = exposed_ns + late_ns(axis.axis.time_offset_s);
        let next = values.partition_point(|value| value.stamp_ns <= stamped_ns);
        let [before, after] = [values[next - 1], values[next]];
        let part = (stamped_ns - before.stamp_ns) as f64 / (after.stamp_ns - before.stamp_ns) as f64;
        let value = before.value + part * (after.value - before.value);
        stops.axes[0].values.push(AxisValue { stamp_ns, value });
    }
    stops
}

#[test]
fn an_axis_at_stops_is_found_without_a_time_offset() {
    let scenario = scenario(16);
    let axis = SimulatedAxis::somewhere("table", (AxisKind::Rotary, Carries::Part), swing(), &scenario, 16);
    let stops = at_stops(&scan(&scenario, std::slice::from_ref(&axis), 16), &axis);
    let calibration = calibrate(&stops, None, &Config::default()).unwrap();
    assert_eq!(calibration.status(), Status::Accepted, "{:?}", calibration.reasons());
    let found = &calibration.findings.axes[0];
    check_axis(found, &axis.axis, [true, true, false], "stops");
    assert!(found.sigma(AxisPart::Place).unwrap() < 2e-3, "{:?}", found.sigma(AxisPart::Place));
    assert!(!calibration.warnings().iter().any(|warning| warning.code() == "axis-not-shown"));
}
