//! Sensors drawn from their stated uncertainty, and an arm with errors: are the stated ± true?
//!
//! `cargo run --release -p trueline-studies -- real_cells [CELLS] [nees|seam|arm|passes|streams]` prints the figures in the book's page `theory/validation.md`.

use crate::arguments::{number, word};
use nalgebra::{DMatrix, DVector, Point3, UnitQuaternion, Vector2, Vector3};
use trueline_dataset::sensor_setup::SensorUncertainty;
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_geometry::{Plane, Pose, se3, so3};
use trueline_method::order_statistics::quantile;
use trueline_method::{Calibration, Config, Parameters, Status, calibrate};
use trueline_model::LaserSheet;
use trueline_sim::arm::Arm;
use trueline_sim::faults::{RobotError, drawn_arm};
use trueline_sim::noise::Noise;
use trueline_sim::{Fault, Preset, Scenario, random_cell, simulate, simulate_with_faults};

/// Standard deviations of a drawn sensor: plane (m, rad), focal lengths (part), principal point (px).
const DRAWN: (f64, f64, f64, f64) = (0.3e-3, 0.2 * std::f64::consts::PI / 180.0, 3e-3, 10.0);

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let count: u64 = number(arguments, 0, 20)?;
    let wanted = word(arguments, 1);
    let wants = |what: &str| wanted.is_empty() || wanted == what;
    if wants("nees") {
        nees(count);
    }
    if wants("seam") {
        seam(count);
    }
    if wants("arm") {
        arms(count);
    }
    if wants("passes") {
        passes(count);
    }
    if wants("streams") {
        streams(count);
    }
    Ok(())
}

/// An ideal robot and features without bias: only noise and the sensor remain.
fn ideal_robot() -> Config {
    let mut config = Config { robot_accuracy_m: Some(0.0), feature_bias_px: 0.0, ..Config::default() };
    config.used_at.speed_m_s = 0.0;
    config
}

/// The recording read with another idea of the sensor, drawn and stated so.
fn with_drawn_sensor(recording: &Recording, seed: u64) -> Option<Recording> {
    let (offset_m, normal_rad, focal, centre_px) = DRAWN;
    let mut noise = Noise::new(seed, 77);
    let mut drawn = recording.clone();
    let Sensor::CameraLaser { camera, laser_plane_in_camera: plane } = &mut drawn.sensor else { return None };
    camera.focal.x *= 1.0 + noise.normal(focal);
    camera.focal.y *= 1.0 + noise.normal(focal);
    camera.centre += Vector2::from_fn(|_, _| noise.normal(centre_px));
    let axes = *LaserSheet::from_plane(*plane).axes();
    let turn = Vector3::from(axes.column(0)) * noise.normal(normal_rad)
        + Vector3::from(axes.column(1)) * noise.normal(normal_rad);
    *plane =
        Plane::new(so3::exp(&turn) * plane.normal().into_inner(), plane.offset() + noise.normal(offset_m))?;
    drawn.setup.uncertainty = Some(SensorUncertainty {
        plane_offset_m: Some(offset_m),
        plane_normal_rad: Some(normal_rad),
        focal: Some(focal),
        principal_point_px: Some(centre_px),
        ..SensorUncertainty::default()
    });
    Some(drawn)
}

/// Places of the features in the camera frame by the true sensor and by the stated one, m.
fn lifted(truth: &Recording, stated: &Recording) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let lift = |sensor: &Sensor, uv: [f64; 2]| {
        let Sensor::CameraLaser { camera, laser_plane_in_camera: plane } = sensor else { return None };
        let (ray, _) = camera.ray(&uv.into()).ok()?;
        Some(LaserSheet::from_plane(*plane).intersect(&ray)?.0)
    };
    let both = truth.features.iter().step_by(5).filter_map(|feature| {
        let Measured::Pixel(uv) = feature.measured else { return None };
        Some((lift(&truth.sensor, uv)?, lift(&stated.sensor, uv)?))
    });
    both.collect()
}

/// The unknowns that a perfect scan would give with the stated sensor. Of a sensor with errors only the shape is visible,
/// and the rigid part goes into the hand-eye transform.
fn seen_truth(truth: &Recording, stated: &Recording, found: &Parameters) -> Option<Parameters> {
    let Sensor::CameraLaser { laser_plane_in_camera: plane, .. } = &stated.sensor else { return None };
    let sheet = LaserSheet::from_plane(*plane);
    let points = lifted(truth, stated);
    let true_hand_eye = truth.truth.as_ref()?.parameters.tool_from_camera;
    let unknowns = found.unknowns();
    let columns: Vec<usize> = (1..7).chain(unknowns.shape()).collect();
    let gaps = |at: &Parameters| {
        let gap = |(real, stated): &(Vector3<f64>, Vector3<f64>)| {
            true_hand_eye * Point3::from(*real)
                - at.tool_from_camera * Point3::from(at.corrected(&sheet, stated))
        };
        DVector::from_iterator(3 * points.len(), points.iter().flat_map(|pair| <[f64; 3]>::from(gap(pair))))
    };
    let mut at = found.clone();
    for _ in 0..6 {
        let here = gaps(&at);
        let mut slopes = DMatrix::zeros(here.len(), columns.len());
        for (k, column) in columns.iter().enumerate() {
            let mut step = DVector::zeros(unknowns.dimension());
            step[*column] = 1e-6;
            slopes.set_column(k, &((&here - gaps(&at.retract(&step))) / 1e-6));
        }
        let found = slopes.svd(true, true).solve(&here, 1e-9).ok()?;
        let mut step = DVector::zeros(unknowns.dimension());
        columns.iter().zip(found.iter()).for_each(|(column, by)| step[*column] = *by);
        at = at.retract(&step);
    }
    Some(at)
}

/// Error of time offset, hand-eye transform and shape against the best possible result, in the unit of the
/// covariance.
fn normalised(truth: &Recording, stated: &Recording, c: &Calibration) -> Option<f64> {
    let found = c.best_fit();
    let seen = seen_truth(truth, stated, found)?;
    let (turn, shift) = se3::difference_decoupled(&found.tool_from_camera, &seen.tool_from_camera);
    let shape: Vec<usize> = found.unknowns().shape().collect();
    let which: Vec<usize> = (0..7).chain(shape).collect();
    let offset_s = found.time_offset_s - truth.truth.as_ref()?.parameters.time_offset_s;
    let mut error = vec![offset_s, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
    error.extend((0..5).filter_map(|k| Some(found.shape?.h[k] - seen.shape?.h[k])));
    let error = DVector::from_vec(error);
    let all = c.best_fit_covariance();
    let covariance = DMatrix::from_fn(which.len(), which.len(), |i, j| all[(which[i], which[j])]);
    Some(error.dot(&covariance.cholesky()?.solve(&error)) / which.len() as f64)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Normalised error squared per unknown.
fn nees(count: u64) {
    let mut values = Vec::new();
    for seed in 0..count {
        let Some(truth) = simulate(&random_cell(&Preset::Good.scenario(), seed, 0.1), seed) else { continue };
        let Some(stated) = with_drawn_sensor(&truth, seed) else { continue };
        let Ok(c) = calibrate(&stated, None, &ideal_robot()) else { continue };
        values.extend(normalised(&truth, &stated, &c).filter(|_| c.status() == Status::Accepted));
    }
    // χ²₁₂/12 of each cell.
    let deviation = (2.0 / (12.0 * values.len() as f64)).sqrt();
    println!(
        "drawn sensors, good scan: normalised error squared per unknown {:.3} (1 ± {deviation:.3}), {} of {count} cells \
         accepted",
        mean(&values),
        values.len()
    );
}

/// Root mean square distance between where seam points are and where the calibration puts them, in the tool frame, m.
fn seam_error_m(truth: &Recording, stated: &Recording, c: &Calibration) -> Option<f64> {
    let Sensor::CameraLaser { laser_plane_in_camera: plane, .. } = &stated.sensor else { return None };
    let sheet = LaserSheet::from_plane(*plane);
    let hand_eye = truth.truth.as_ref()?.parameters.tool_from_camera;
    let found = c.best_fit();
    let squares: Vec<f64> = lifted(truth, stated)
        .iter()
        .map(|(real, stated)| {
            let there = hand_eye * Point3::from(*real);
            let said = found.tool_from_camera * Point3::from(found.corrected(&sheet, stated));
            (there - said).norm_squared()
        })
        .collect();
    Some(mean(&squares).sqrt())
}

/// Seam error against the stated ±, with drawn sensors.
fn seam(count: u64) {
    for preset in [Preset::Paper, Preset::Good] {
        let (mut real, mut said) = (Vec::new(), Vec::new());
        for seed in 0..count {
            let Some(truth) = simulate(&random_cell(&preset.scenario(), seed, 0.1), seed) else { continue };
            let Some(stated) = with_drawn_sensor(&truth, seed) else { continue };
            let Ok(c) = calibrate(&stated, None, &ideal_robot()) else { continue };
            let Some(error) = c.findings.checks.seam_error.filter(|_| c.status() == Status::Accepted) else {
                continue;
            };
            real.extend(seam_error_m(&truth, &stated, &c).map(|error| error.powi(2)));
            said.push(error.rms_m.powi(2));
        }
        let (real_mm, said_mm) = (mean(&real).sqrt() * 1e3, mean(&said).sqrt() * 1e3);
        println!(
            "drawn sensors, preset {}: seam error {real_mm:.4} mm, said {said_mm:.4} mm, ratio {:.2}, {} of {count} cells \
             accepted",
            preset.name(),
            real_mm / said_mm,
            real.len()
        );
    }
}

/// The tool tip in the tool frame, m: a torch beside the sensor.
const TIP_M: [f64; 3] = [0.05, -0.03, 0.30];
/// Turns from the middle attitude in which a pivot touches one point, rad.
const PIVOT_RAD: f64 = 25.0 * std::f64::consts::PI / 180.0;
/// The same in which points are measured and welded.
const USE_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// How far along the seam from the middle points are, m.
const ALONG_M: f64 = 0.15;
/// Measured points of a cell.
const POINTS: usize = 40;

/// The reported attitude and place with the true tip at a point, found by moving the report.
fn reported_at(
    arm: &Arm,
    attitude: &UnitQuaternion<f64>,
    tip: &Vector3<f64>,
    point: &Vector3<f64>,
) -> Option<Pose> {
    let mut place = point - attitude * tip;
    for _ in 0..4 {
        let real = arm.true_from_nominal(&se3::from_parts(*attitude, place))?;
        place += point - (real * Point3::from(*tip)).coords;
    }
    Some(se3::from_parts(*attitude, place))
}

/// The tool centre point as a pivot of six attitudes with the same robot finds it.
fn pivoted(arm: &Arm, middle: &UnitQuaternion<f64>, point: &Vector3<f64>) -> Option<Vector3<f64>> {
    let (mut slopes, mut values) = (DMatrix::zeros(18, 6), DVector::zeros(18));
    for k in 0..6 {
        let turn = Vector3::ith(k / 2, if k % 2 == 0 { PIVOT_RAD } else { -PIVOT_RAD });
        let pose = reported_at(arm, &(middle * so3::exp(&turn)), &TIP_M.into(), point)?;
        // R τ + p is the same point for all.
        slopes.view_mut((3 * k, 0), (3, 3)).copy_from(&pose.rotation.to_rotation_matrix().into_inner());
        slopes.view_mut((3 * k, 3), (3, 3)).copy_from(&-nalgebra::Matrix3::identity());
        values.rows_mut(3 * k, 3).copy_from(&-pose.translation.vector);
    }
    let found = slopes.svd(true, true).solve(&values, 1e-12).ok()?;
    Some(found.fixed_rows::<3>(0).into())
}

/// Mean square of how far the torch misses points that the sensor measured, m².
fn miss_squared(
    scenario: &Scenario,
    arm: &Arm,
    recording: &Recording,
    c: &Calibration,
    seed: u64,
) -> Option<f64> {
    let middle = recording.robot.get(recording.robot.len() / 2)?.base_from_tool;
    let seam = *scenario.cell.lines.first()?;
    let centre: Vec<f64> = [0.0, 1.0]
        .iter()
        .filter_map(|share| {
            let at = recording.robot.get(((recording.robot.len() - 1) as f64 * share) as usize)?;
            Some(seam.direction().dot(&(at.base_from_tool.translation.vector - seam.anchor())))
        })
        .collect();
    let on_seam = |along: f64| seam.anchor() + seam.direction() * along;
    let lever = scenario.cell.tool_from_camera;
    let points = lifted(recording, recording);
    let tip = pivoted(arm, &middle.rotation, &on_seam(mean(&centre)))?;
    let mut noise = Noise::new(seed, 78);
    let mut squares = Vec::new();
    for _ in 0..POINTS {
        let point = on_seam(mean(&centre) + noise.uniform(-ALONG_M, ALONG_M));
        let mut turned =
            || middle.rotation * so3::exp(&Vector3::from_fn(|_, _| noise.uniform(-USE_RAD, USE_RAD)));
        let (seen_from, welded_from) = (turned(), turned());
        let (seen, _) = points.get((noise.uniform(0.0, 1.0) * points.len() as f64) as usize)?;
        // The sensor's reading is that of a point of the scan.
        let in_tool = (lever * Point3::from(*seen)).coords;
        let from = reported_at(arm, &seen_from, &in_tool, &point)?;
        let believed = from * (c.best_fit().tool_from_camera * Point3::from(*seen));
        let sent = se3::from_parts(welded_from, believed.coords - welded_from * tip);
        let torch = arm.true_from_nominal(&sent)? * Point3::from(Vector3::from(TIP_M));
        squares.push((torch.coords - point).norm_squared());
    }
    Some(mean(&squares))
}

/// The miss at the torch with an arm of 0.3 mm, against the stated ± of a seam point.
fn arms(count: u64) {
    let fault = Fault::Robot(RobotError::Arm { rms_m: 0.3e-3 });
    let mut moderate = Preset::Good.scenario();
    for tilt in &mut moderate.scan.tilts {
        tilt.amplitude *= 12.0 / 25.0;
    }
    let scans = [("S-scan", Preset::Paper.scenario()), ("±12°", moderate), ("±25°", Preset::Good.scenario())];
    for (name, scenario) in scans {
        for estimates_shape in [false, true] {
            let sensor = if estimates_shape {
                trueline_method::SensorMode::Prior
            } else {
                trueline_method::SensorMode::Fixed
            };
            let mut config = Config { sensor, feature_bias_px: 0.0, ..Config::default() };
            config.used_at.speed_m_s = 0.0;
            let (mut real, mut said, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
            for seed in 0..count {
                let Some((miss, claim)) = arm_cell(&scenario, fault, seed, &config) else { continue };
                real.push(miss);
                said.push(claim * claim);
                ratios.push(claim / miss.sqrt());
            }
            let (real_mm, said_mm) = (mean(&real).sqrt() * 1e3, mean(&said).sqrt() * 1e3);
            let at = |share| quantile(ratios.iter().copied(), share).unwrap_or(f64::NAN);
            println!(
                "arm of 0.3 mm, {name}, shape {}: miss {real_mm:.3} mm, said {said_mm:.3} mm, said/true {:.2}; cell by cell \
                 {:.2}, {:.2}, {:.2} (10, 50, 90 %), {} of {count}",
                if estimates_shape { "estimated" } else { "held" },
                said_mm / real_mm,
                at(0.1),
                at(0.5),
                at(0.9),
                real.len()
            );
        }
    }
}

/// Mean square miss (m²) and the stated ± of a seam point (m).
fn arm_cell(scenario: &Scenario, fault: Fault, seed: u64, config: &Config) -> Option<(f64, f64)> {
    let scenario = random_cell(scenario, seed, 0.1);
    let arm = drawn_arm(&scenario, &[fault], seed)?;
    let recording = simulate_with_faults(&scenario, &[fault], seed)?;
    let c = calibrate(&recording, None, config).ok()?;
    let miss = miss_squared(&scenario, &arm, &recording, &c, seed)?;
    Some((miss, c.findings.checks.seam_error?.rms_m))
}

/// A seam that wanders, scanned once or there and back again: error of the hand-eye against its ±.
fn passes(count: u64) {
    let fault = match "wobble=0.1,5".parse::<Fault>() {
        Ok(fault) => fault,
        Err(error) => return println!("{error}"),
    };
    for passes in [1, 2] {
        let mut scenario = Preset::Good.scenario();
        scenario.scan.passes = passes;
        let (mut values, mut shifts) = (Vec::new(), Vec::new());
        for seed in 0..count {
            let cell = random_cell(&scenario, seed, 0.1);
            let Some(recording) = simulate_with_faults(&cell, &[fault], seed) else { continue };
            let config = Config::noise_only();
            let Ok(c) = calibrate(&recording, None, &config) else { continue };
            let Some(truth) = recording.truth.as_ref().map(|truth| truth.parameters) else { continue };
            let error = c.best_fit().minus(&truth);
            let covariance = c.best_fit_covariance().view((0, 0), (7, 7)).into_owned();
            let error = DVector::from_column_slice(error.as_slice());
            values.extend(covariance.cholesky().map(|factor| error.dot(&factor.solve(&error)) / 7.0));
            shifts.push(error.rows(4, 3).norm());
        }
        let shift_mm = quantile(shifts.iter().copied(), 0.5).unwrap_or(f64::NAN) * 1e3;
        println!(
            "seam that wanders by 0.1 mm over 5 mm, {passes} pass(es): normalised error squared per unknown {:.2}, median \
             error of the translation {shift_mm:.3} mm, {} of {count}",
            mean(&values),
            values.len()
        );
    }
}

/// Cameras that are faster than the robot's stream, so that frames share its samples, and a slow robot.
fn streams(count: u64) {
    for (camera_hz, robot_ms) in [(33.0, 4.0), (120.0, 4.0), (120.0, 12.0), (33.0, 32.0)] {
        let mut values = Vec::new();
        for seed in 0..count {
            let mut cell = random_cell(&Preset::Good.scenario(), seed, 0.1);
            cell.timing.frame_period_s = 1.0 / camera_hz;
            cell.timing.robot_period_s = robot_ms * 1e-3;
            let Some(recording) = simulate(&cell, seed) else { continue };
            let Ok(c) = calibrate(&recording, None, &Config::noise_only()) else { continue };
            let Some(truth) = recording.truth.as_ref().map(|truth| truth.parameters) else { continue };
            let error = DVector::from_column_slice(c.best_fit().minus(&truth).as_slice());
            let covariance = c.best_fit_covariance().view((0, 0), (7, 7)).into_owned();
            values.extend(covariance.cholesky().map(|factor| error.dot(&factor.solve(&error)) / 7.0));
        }
        println!(
            "camera of {camera_hz} Hz, robot every {robot_ms} ms: normalised error squared per unknown {:.2}, {} of {count}",
            mean(&values),
            values.len()
        );
    }
}
