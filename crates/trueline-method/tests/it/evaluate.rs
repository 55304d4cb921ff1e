//! A calibration's accuracy on welds with every point known.

use nalgebra::{UnitVector3, Vector3};
use trueline_dataset::Guess;
use trueline_geometry::{Circle, Polyline};
use trueline_method::evaluate::evaluation::{Figures, evaluate};
use trueline_method::evaluate::reference_curve::{Form, ReferenceCurve};
use trueline_method::evaluate::standstill::{self, StandstillError, Stop};
use trueline_method::{Config, Error, evaluate::seam_points};
use trueline_sim::motion::Motion;
use trueline_sim::scenario::Sine;
use trueline_sim::{
    Disturbance, KnownScan, Preset, Scenario, Weld, WeldScan, scan_weld, simulate, simulate_along,
};

const SPEED_M_S: f64 = 0.1;
const OFFSET_S: f64 = 0.02;

fn quiet() -> Scenario {
    let mut scenario = Preset::Quick.scenario();
    scenario.disturbance = Disturbance::default();
    scenario.timing.time_offset_s = OFFSET_S;
    scenario
}

fn truth(scenario: &Scenario) -> Guess {
    Guess { time_offset_s: OFFSET_S, tool_from_camera: scenario.cell.tool_from_camera }
}

fn arc() -> Circle {
    let axis = UnitVector3::new_normalize(Vector3::new(0.05, -0.03, 1.0));
    Circle::new(Vector3::new(1.1, -0.5, 0.1), axis, 0.6).unwrap()
}

fn round(scenario: &Scenario, seed: u64) -> KnownScan {
    let towards_start = arc().axis().cross(&Vector3::x()).normalize();
    let weld = Weld::Round { circle: arc(), towards_start };
    scan_weld(scenario, &WeldScan { weld, length_m: 0.7, speed_m_s: SPEED_M_S, weave: Sine::default() }, seed)
}

fn straight(scenario: &Scenario, weave: Sine) -> KnownScan {
    let weld = Weld::Straight(scenario.cell.lines[0]);
    scan_weld(scenario, &WeldScan { weld, length_m: 0.4, speed_m_s: SPEED_M_S, weave }, 1)
}

fn figures(list: &[trueline_method::evaluate::evaluation::Deviation]) -> Figures {
    Figures::of(list.iter().map(|d| d.error_m))
}

#[test]
fn every_point_is_where_the_simulator_has_it() {
    let scenario = quiet();
    for known in [round(&scenario, 1), straight(&scenario, Sine::default())] {
        assert!(known.recording.features.len() > 100);
        let placed = seam_points::place(&known.recording, &truth(&scenario), &Config::default()).unwrap();
        for point in &placed.list {
            let truth = known.truth[point.row as usize];
            // On the circle the tool rotates. Between samples 4 ms apart the path is straight within 0.1 m/s² · (4 ms)²/8.
            assert!((point.point_in_base - truth).norm() < 1e-6, "{point:?}");
        }
        assert!(placed.skipped.is_empty(), "{:?}", placed.skipped);
    }
}

#[test]
fn the_truth_of_a_round_weld_lies_on_its_circle() {
    let known = round(&quiet(), 1);
    for point in &known.truth {
        assert!((point - arc().nearest(point)).norm() < 1e-12);
    }
}

#[test]
fn leaving_the_offset_out_shows_across_only_where_the_sensor_moves_across() {
    let scenario = quiet();
    let reference = || Some(vec![ReferenceCurve::Line(scenario.cell.lines[0])]);
    let run = |weave| {
        evaluate(&straight(&scenario, weave).recording, &truth(&scenario), reference(), Form::Auto).unwrap()
    };
    let along = run(Sine::default());
    assert!(figures(&along.calibrated).max_m < 1e-6 && figures(&along.without_offset).max_m < 1e-5);
    let weave = Sine { amplitude: 0.01, frequency_hz: 0.8, phase_rad: 0.3 };
    let weaving = run(weave);
    assert!(figures(&weaving.calibrated).max_m < 1e-5);
    // ±10 mm at 0.8 Hz is at most 50 mm/s. The tilt of the work angle only rotates it.
    let expected = weave.amplitude * std::f64::consts::TAU * weave.frequency_hz * OFFSET_S;
    let found = figures(&weaving.without_offset);
    assert!((found.max_m / expected - 1.0).abs() < 0.15, "{} {expected}", found.max_m);
    assert!(found.mae_m <= found.rmse_m && found.rmse_m <= found.max_m && found.median_m <= found.max_m);
}

#[test]
fn without_a_reference_the_simplest_form_is_fitted() {
    let mut scenario = quiet();
    scenario.disturbance.feature_noise_px = 0.3;
    let form = |known: &KnownScan, form| {
        evaluate(&known.recording, &truth(&scenario), None, form).unwrap().references[0].clone()
    };
    assert_eq!(form(&straight(&scenario, Sine::default()), Form::Auto).name(), "line");
    let fitted = form(&round(&scenario, 2), Form::Auto);
    let ReferenceCurve::Circle(circle) = fitted else { panic!("{fitted:?}") };
    // 0.02 mm a point, 200 points, 67° of arc. The radius is some thirty times less certain than the mean of the points.
    assert!((circle.radius() - 0.6).abs() < 0.2e-3, "{}", circle.radius());
    assert_eq!(form(&round(&scenario, 2), Form::Plane).name(), "plane");
    // A wave in a plane is neither a line nor a circle.
    let wave: Vec<Vector3<f64>> = (0..100)
        .map(|k| Vector3::new(0.003 * f64::from(k), 0.04 * (0.1 * f64::from(k)).sin(), 0.2))
        .collect();
    assert_eq!(ReferenceCurve::fitted(&wave, Form::Auto).unwrap().name(), "plane");
}

#[test]
fn points_beyond_the_ends_of_a_taught_curve_are_counted_not_judged() {
    let scenario = quiet();
    let known = straight(&scenario, Sine::default());
    let line = scenario.cell.lines[0];
    let taught = (2..=6).map(|k| line.anchor() + line.direction() * (0.05 * f64::from(k))).collect();
    let reference = Some(vec![ReferenceCurve::Curve(Polyline::new(taught).unwrap())]);
    let found = evaluate(&known.recording, &truth(&scenario), reference, Form::Auto).unwrap();
    assert!(found.beyond_ends > 20 && found.calibrated.len() > 50);
    assert_eq!(found.beyond_ends + found.calibrated.len(), known.recording.features.len());
    assert!(figures(&found.calibrated).max_m < 1e-6);
}

#[test]
fn a_calibration_of_another_clock_is_refused() {
    let scenario = quiet();
    let late = Guess { time_offset_s: 100.0, ..truth(&scenario) };
    let refused = evaluate(&straight(&scenario, Sine::default()).recording, &late, None, Form::Line);
    assert!(matches!(refused, Err(Error::NothingToFit { points: 0 })), "{refused:?}");
}

#[test]
fn the_profile_of_the_offset_is_lowest_at_the_estimate_and_rises_steeply() {
    let recording = trueline_sim::simulate(&Preset::Quick.scenario(), 1).unwrap();
    let calibration = trueline_method::calibrate(&recording, None, &Config::default()).unwrap();
    let profile = trueline_method::diagnose::offset_profile::around(&recording, &calibration).unwrap();
    assert!(profile.windows(2).all(|pair| pair[0].time_offset_s < pair[1].time_offset_s));
    let best = profile.iter().min_by(|a, b| a.typical_sigmas.total_cmp(&b.typical_sigmas)).unwrap();
    assert!((best.time_offset_s - calibration.best_fit().time_offset_s).abs() < 0.6e-3);
    // Without stamp jitter in the weights, slightly above one.
    assert!((0.7..2.0).contains(&best.typical_sigmas), "{}", best.typical_sigmas);
    // At 30 mm/s across, 0.1 s is 3 mm: a hundred standard deviations, minus the part that other unknowns absorb.
    let far = profile.iter().filter(|p| (p.time_offset_s - best.time_offset_s).abs() > 0.1);
    assert!(far.clone().count() > 30 && far.clone().all(|p| p.typical_sigmas > 5.0));
}

#[test]
fn a_time_offset_that_is_held_too_small_leaves_the_points_behind() {
    let scenario = Preset::Paper.scenario();
    let recording = trueline_sim::simulate(&scenario, 4).unwrap();
    let mut guess = recording.truth.as_ref().unwrap().parameters;
    guess.time_offset_s -= 1e-3;
    let held = Config { hold: vec![trueline_method::Hold::TimeOffset], ..Config::default() };
    let found = trueline_method::calibrate(&recording, Some(&guess), &held).unwrap();
    // The slope of the residual over the velocity of the seam in the sheet is the error of the time offset.
    let (mut product, mut square) = (0.0, 0.0);
    for f in &found.findings.fit.features {
        let (residual, velocity) = (f.in_sheet_m.unwrap(), f.crossing_m_s.unwrap());
        product += residual.dot(&velocity);
        square += velocity.norm_squared();
    }
    let slope_s = product / square;
    // 1 ms, of which the hand-eye absorbs a small part.
    assert!((slope_s + 1e-3).abs() < 0.1e-3, "{slope_s}");
}

#[test]
fn points_need_no_laser_plane_to_be_evaluated() {
    let mut scenario = quiet();
    let trueline_sim::SensorModel::CameraLaser { camera, laser_plane_in_camera } =
        scenario.cell.sensor.clone()
    else {
        unreachable!()
    };
    scenario.cell.sensor = trueline_sim::SensorModel::Points { camera, laser_plane_in_camera };
    let mut known = straight(&scenario, Sine::default());
    known.recording.sensor = trueline_dataset::Sensor::Points { laser_plane_in_camera: None };
    // The seam stays in one place of the camera frame, so no plane could be fitted.
    let found = evaluate(&known.recording, &truth(&scenario), None, Form::Line).unwrap();
    assert!(figures(&found.calibrated).max_m < 1e-6);
}

#[test]
fn references_that_do_not_belong_to_the_seams_are_refused() {
    let two = trueline_sim::simulate(&Preset::TwoLines.scenario(), 1).unwrap();
    let truth = two.truth.as_ref().unwrap();
    let one = Some(vec![ReferenceCurve::Line(truth.lines[0])]);
    let refused = evaluate(&two, &truth.parameters, one, Form::Auto);
    assert!(matches!(refused, Err(Error::ReferenceMissing { seams: 2, references: 1 })), "{refused:?}");
    let scenario = quiet();
    let known = straight(&scenario, Sine::default());
    let elsewhere = vec![Vector3::new(9.0, 9.0, 9.0), Vector3::new(9.1, 9.0, 9.0)];
    let far = Some(vec![ReferenceCurve::Curve(Polyline::new(elsewhere).unwrap())]);
    let by = Guess { time_offset_s: OFFSET_S, tool_from_camera: scenario.cell.tool_from_camera };
    let refused = evaluate(&known.recording, &by, far, Form::Auto);
    let Err(Error::BeyondReference { points, nearest_mm }) = refused else { panic!("{refused:?}") };
    assert!(points == known.recording.features.len() && nearest_mm > 1000.0);
}

const STOPS: u32 = 14;
const REST_S: f64 = 1.0;
const MOVE_S: f64 = 0.4;

/// The path of a scan with a stop at every fourteenth of it, in a given order.
fn with_stops(scenario: &Scenario, order: &[u32]) -> trueline_dataset::Recording {
    let motion = Motion::new(scenario).unwrap();
    let at_stop =
        |k: usize| f64::from(order[k.min(order.len() - 1)]) * scenario.timing.duration_s / f64::from(STOPS);
    let path = |time_s: f64| {
        let k = (time_s / (REST_S + MOVE_S)).floor().max(0.0) as usize;
        let part = ((time_s - k as f64 * (REST_S + MOVE_S) - REST_S) / MOVE_S).clamp(0.0, 1.0);
        let eased = part * part * (3.0 - 2.0 * part);
        motion.base_from_tool(at_stop(k) * (1.0 - eased) + at_stop(k + 1) * eased)
    };
    let mut slow = scenario.clone();
    slow.timing.duration_s = order.len() as f64 * (REST_S + MOVE_S);
    simulate_along(&slow, &path, 5)
}

#[test]
fn points_measured_at_standstill_are_the_truth_of_a_moving_scan() {
    let scenario = Preset::Quick.scenario();
    let guess =
        |time_offset_s: f64| Guess { time_offset_s, tool_from_camera: scenario.cell.tool_from_camera };
    let (right, none) = (guess(scenario.timing.time_offset_s), guess(0.0));
    let still = with_stops(&scenario, &(0..STOPS).collect::<Vec<_>>());
    let stops: Vec<Stop> = standstill::stops(&still, &right).unwrap();
    assert_eq!(stops.len(), STOPS as usize);
    let line = scenario.cell.lines[0];
    for stop in &stops {
        let off = (stop.point_in_base - line.anchored_near(&stop.point_in_base).anchor()).norm();
        // Some 20 images of 0.02 mm and a robot of 0.03 mm give 0.01 mm. A chi of two axes exceeds four once in 3000.
        assert!(off < 4.0 * stop.sigma_m && (1e-6..0.03e-3).contains(&stop.sigma_m), "{off} {stop:?}");
    }
    // Without motion the offset does not matter: the same images count, except for one at either end.
    for (a, b) in stops.iter().zip(standstill::stops(&still, &none).unwrap()) {
        assert!((a.point_in_base - b.point_in_base).norm() < 3.0 * a.sigma_m, "{a:?} {b:?}");
    }
    let curves = standstill::curves(&stops).unwrap().into_iter().map(ReferenceCurve::Curve).collect();
    let moving = simulate(&scenario, 6).unwrap();
    let evaluation = evaluate(&moving, &right, Some(curves), Form::Auto).unwrap();
    // Features of 0.3 px and a robot of 0.03 mm, against 17.73 ms at up to 30 mm/s across.
    assert!(figures(&evaluation.calibrated).rmse_m < 0.08e-3, "{:?}", figures(&evaluation.calibrated));
    assert!(figures(&evaluation.without_offset).rmse_m > 0.3e-3);
}

#[test]
fn stops_that_are_too_few_or_run_back_and_forth_are_refused() {
    let scenario = quiet();
    let moving = simulate(&scenario, 6).unwrap();
    let found = standstill::stops(&moving, &truth(&scenario)).unwrap();
    let error = standstill::curves(&found).unwrap_err();
    assert!(matches!(error, StandstillError::TooFewStops { line: 0, found: 0 }), "{error}");
    let back = standstill::stops(&with_stops(&scenario, &[0, 3, 6, 2, 8]), &truth(&scenario)).unwrap();
    let error = standstill::curves(&back).unwrap_err();
    assert!(matches!(error, StandstillError::BackAndForth { line: 0, stop: 3 }), "{error}");
}

#[test]
fn outliers_are_counted_and_left_out_of_second_figures() {
    let scenario = quiet();
    let mut known = straight(&scenario, Sine::default());
    for feature in known.recording.features.iter_mut().step_by(10) {
        if let trueline_dataset::Measured::Pixel(pixel) = &mut feature.measured {
            pixel[0] += 200.0;
        }
    }
    let wild = known.recording.features.len().div_ceil(10);
    let reference = Some(vec![ReferenceCurve::Line(scenario.cell.lines[0])]);
    let found = evaluate(&known.recording, &truth(&scenario), reference, Form::Auto).unwrap();
    assert_eq!(found.outliers(), wild);
    assert_eq!(found.without_outliers().count, found.calibrated.len() - wild);
    // 200 px are 8 mm here, in one point of ten; the others lie within a micrometre of the line.
    assert!(figures(&found.calibrated).rmse_m > 1e-3, "{:?}", figures(&found.calibrated));
    assert!(found.without_outliers().rmse_m < 1e-6, "{:?}", found.without_outliers());
}
