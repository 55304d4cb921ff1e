//! Tests that simulated scans are recovered: exactly without noise, within their sigmas with it.

use nalgebra::{UnitVector3, Vector3};
use trueline_dataset::{Guess, Measured, Recording};
use trueline_geometry::{Line, se3, so3};
use trueline_method::{Calibration, Config, Reason, ResidualKind, Status, calibrate};
use trueline_sim::{Between, Disturbance, Preset, Scenario, random_cell, simulate};

/// Presets in which everything is observable.
const VISIBLE: [Preset; 5] = [Preset::Paper, Preset::Quick, Preset::Weak, Preset::TwoLines, Preset::Profiler];

/// Error of (t_d in s, rotation in rad, translation in m).
fn errors(calibration: &Calibration, recording: &Recording) -> [f64; 7] {
    let (estimate, truth) = (calibration.best_fit(), &recording.truth.as_ref().unwrap().parameters);
    let (turn, shift) =
        se3::difference_decoupled(calibration.file_tool_from_camera(), &truth.tool_from_camera);
    let offset = estimate.time_offset_s - truth.time_offset_s;
    [offset, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]
}

fn assert_within(calibration: &Calibration, recording: &Recording, sigmas: f64, what: &str) {
    assert_eq!(calibration.status(), Status::Accepted, "{what}: {:?}", calibration.reasons());
    for (k, error) in errors(calibration, recording).into_iter().enumerate() {
        let sigma = calibration.sigma(k).unwrap();
        assert!(error.abs() < sigmas * sigma, "{what}, component {k}: error {error:e}, sigma {sigma:e}");
    }
    for (line, truth) in calibration.best_fit().lines.iter().zip(&recording.truth.as_ref().unwrap().lines) {
        // A line is known far better than the hand-eye transform, but moves with it.
        let off = truth.distance(line.anchor());
        assert!(off < 2e-3, "{what}: line {off} m off");
    }
}

fn exact(mut scenario: Scenario) -> Scenario {
    scenario.disturbance = Disturbance::default();
    scenario.timing.between = Between::Straight;
    scenario
}

/// Without noise the residual at the optimum is zero, so the last step (below 1e-6 of a sigma, at most 1e-3 of the
/// expected noise) converges quadratically to rounding: stamps of 60 s carry 60·eps = 1e-14 s, base coordinates of 2
/// m 4e-16 m. The weakest direction magnifies this by its condition 1e3.
fn assert_exact(scenario: Scenario, initial: Option<Guess>, config: &Config, what: &str) {
    let recording = simulate(&exact(scenario), 1).unwrap();
    let calibration = calibrate(&recording, initial.as_ref(), config).unwrap();
    for (k, error) in errors(&calibration, &recording).into_iter().enumerate() {
        assert!(error.abs() < 1e-8, "{what}, component {k}: {error:e}");
    }
    for (line, truth) in calibration.best_fit().lines.iter().zip(&recording.truth.as_ref().unwrap().lines) {
        assert!(truth.distance(line.anchor()) < 1e-8, "{what}");
        assert!(line.direction().cross(&truth.direction()).norm() < 1e-8, "{what}");
    }
}

#[test]
fn noise_free_scans_are_recovered_exactly() {
    for preset in VISIBLE {
        assert_exact(preset.scenario(), None, &Config::default(), preset.name());
    }
}

#[test]
fn the_papers_residual_recovers_noise_free_scans_too() {
    let config = Config { residual: ResidualKind::PointToLine, ..Config::default() };
    assert_exact(Preset::Quick.scenario(), None, &config, "point-to-line");
}

#[test]
fn every_preset_is_within_four_sigma() {
    for preset in VISIBLE {
        for seed in 0..4 {
            let recording = simulate(&preset.scenario(), seed).unwrap();
            let calibration = calibrate(&recording, None, &Config::default()).unwrap();
            assert_within(&calibration, &recording, 4.0, &format!("{} seed {seed}", preset.name()));
        }
    }
}

#[test]
fn random_cells_are_found_without_a_guess() {
    for preset in [Preset::Quick, Preset::Weak] {
        for seed in 100..112 {
            let recording = simulate(&random_cell(&preset.scenario(), seed, 1.0), seed).unwrap();
            let calibration = calibrate(&recording, None, &Config::default()).unwrap();
            // 24 cells × 7 components: chance exceeds 5 σ once in 10⁴ such tests.
            assert_within(&calibration, &recording, 5.0, &format!("{} cell {seed}", preset.name()));
        }
    }
}

#[test]
fn a_line_through_the_base_origin() {
    let mut scenario = Preset::Quick.scenario();
    let direction = UnitVector3::new_normalize(scenario.cell.lines[0].direction());
    scenario.cell.lines = vec![Line::new(Vector3::zeros(), &direction)];
    assert_exact(scenario.clone(), None, &Config::default(), "through the origin");
    let recording = simulate(&scenario, 1).unwrap();
    let calibration = calibrate(&recording, None, &Config::default()).unwrap();
    assert_within(&calibration, &recording, 4.0, "through the origin");
}

#[test]
fn a_wall_mounted_robot() {
    let mut scenario = Preset::Quick.scenario();
    // Base rotated onto the wall: everything in the cell rotates about it.
    let turn = so3::exp(&Vector3::new(0.0, std::f64::consts::FRAC_PI_2, 0.0));
    let line = scenario.cell.lines[0];
    scenario.cell.lines =
        vec![Line::new(turn * line.anchor(), &UnitVector3::new_normalize(turn * line.direction()))];
    scenario.cell.approach = UnitVector3::new_normalize(turn * scenario.cell.approach.into_inner());
    let recording = simulate(&scenario, 2).unwrap();
    let calibration = calibrate(&recording, None, &Config::default()).unwrap();
    assert_within(&calibration, &recording, 4.0, "wall");
}

#[test]
fn offsets_of_either_sign_and_other_robot_rates() {
    for (offset_s, robot_period_s) in [(-0.025, 0.004), (0.190, 0.004), (0.018, 0.012), (0.0, 0.002)] {
        let mut scenario = Preset::Quick.scenario();
        scenario.timing.time_offset_s = offset_s;
        scenario.timing.robot_period_s = robot_period_s;
        let recording = simulate(&scenario, 3).unwrap();
        let calibration = calibrate(&recording, None, &Config::default()).unwrap();
        assert_within(&calibration, &recording, 4.0, &format!("{offset_s} s, {robot_period_s} s"));
    }
}

fn scenario_of_four_lines() -> Scenario {
    let mut scenario = Preset::Quick.scenario();
    let first = scenario.cell.lines[0];
    scenario.cell.lines = (0..4)
        .map(|k| {
            let side = f64::from(k) * 0.004 - 0.006;
            let lean = Vector3::new(0.0, 0.01 * side.signum(), 0.02 * f64::from(k));
            let direction = UnitVector3::new_normalize(first.direction() + lean);
            Line::new(first.anchor() + Vector3::new(0.0, side, 0.0), &direction)
        })
        .collect();
    scenario
}

#[test]
fn four_lines() {
    let recording = simulate(&scenario_of_four_lines(), 4).unwrap();
    let calibration = calibrate(&recording, None, &Config::default()).unwrap();
    assert_eq!(calibration.best_fit().lines.len(), 4);
    assert_within(&calibration, &recording, 4.0, "four lines");
}

#[test]
fn forty_percent_outliers_and_ten_percent_drops() {
    let mut scenario = Preset::Quick.scenario();
    scenario.disturbance.outlier_fraction = 0.4;
    scenario.disturbance.drop_fraction = 0.1;
    let recording = simulate(&scenario, 5).unwrap();
    let calibration = calibrate(&recording, None, &Config::default()).unwrap();
    assert_within(&calibration, &recording, 4.0, "outliers");
    let share =
        calibration.findings.fit.residuals.outliers as f64 / calibration.findings.fit.residuals.used as f64;
    // Binomial: 0.4 ± 0.02 of 600. A few outliers fall onto the seam by chance.
    assert!((0.34..0.46).contains(&share), "{share}");
}

/// With this many outliers most differences of neighbours contain one. So the noise is not estimated from these differences alone.
#[test]
fn forty_percent_outliers_are_not_taken_for_noise() {
    let mut scenario = Preset::Good.scenario();
    scenario.disturbance.outlier_fraction = 0.4;
    let recording = simulate(&scenario, 1).unwrap();
    let config = Config { edge_radius_m: Some(0.3e-3), ..Config::default() };
    let calibration = calibrate(&recording, None, &config).unwrap();
    assert!(calibration.findings.fit.amplitudes.is_some());
    let codes: Vec<&str> = calibration.reasons().iter().map(|reason| reason.code()).collect();
    assert!(codes.is_empty(), "{codes:?}");
    let sigmas = calibration.findings.checks.seam_error.unwrap().rms_m;
    let truth = recording.truth.as_ref().unwrap().parameters.tool_from_camera;
    let off = calibration.best_fit().tool_from_camera.translation.vector - truth.translation.vector;
    assert!(off.norm() < 4.0 * sigmas, "{off} {sigmas}");
}

/// A line with outliers only is undetermined, whatever the others say about the sensor.
#[test]
fn a_line_of_outliers_is_refused_by_its_number() {
    let mut scenario = scenario_of_four_lines();
    let mut recording = simulate(&scenario, 3).unwrap();
    scenario.disturbance.outlier_fraction = 0.999;
    let outliers = simulate(&scenario, 3).unwrap();
    let wild: Vec<Measured> = outliers
        .features
        .iter()
        .filter(|feature| feature.line == 2)
        .map(|feature| feature.measured)
        .collect();
    let own = recording.features.iter_mut().filter(|feature| feature.line == 2);
    own.zip(wild).for_each(|(feature, measured)| feature.measured = measured);
    for config in [Config::noise_only(), Config { edge_radius_m: Some(0.3e-3), ..Config::default() }] {
        let calibration = calibrate(&recording, None, &config).unwrap();
        let first = calibration.reasons().first();
        assert!(matches!(first, Some(Reason::LineOfOutliers { line: 2, .. })), "{first:?}");
    }
}

/// The start from the mirrored attitude converges to the solution, but slowly because of gross errors. It is no second solution.
#[test]
fn the_papers_scan_with_forty_percent_outliers() {
    let mut scenario = Preset::Paper.scenario();
    scenario.disturbance.outlier_fraction = 0.4;
    for seed in 1..=4 {
        let recording = simulate(&scenario, seed).unwrap();
        let calibration = calibrate(&recording, None, &Config::default()).unwrap();
        assert_within(&calibration, &recording, 4.0, &format!("outliers, seed {seed}"));
    }
}

#[test]
fn a_step_from_the_papers_kind_of_start_takes_few_iterations() {
    let recording = simulate(&Preset::Quick.scenario(), 6).unwrap();
    let truth = recording.truth.as_ref().unwrap().parameters;
    let turn = Vector3::new(1.0, -1.0, 1.0).normalize() * 1.7_f64.to_radians();
    let shift = Vector3::new(2.0, -2.5, 1.9) * 1e-3;
    let guess = Guess {
        time_offset_s: 0.0,
        tool_from_camera: se3::retract_decoupled(&truth.tool_from_camera, &turn, &shift),
    };
    let calibration = calibrate(&recording, Some(&guess), &Config::default()).unwrap();
    assert_within(&calibration, &recording, 4.0, "from a guess");
    let iterations = &calibration.findings.fit.iterations;
    // Within the answer's uncertainty after a few steps. Then the fit is repeated with measured noise, with the estimated bias of the features, and
    // without it, some five steps each.
    let off_s = iterations[4].parameters.time_offset_s - calibration.best_fit().time_offset_s;
    assert!(off_s.abs() < calibration.sigma(0).unwrap(), "{off_s}");
    assert!(iterations.len() <= 30, "{}", iterations.len());
}

#[test]
fn holding_the_time_offset_at_zero_shows_what_it_costs() {
    let recording = simulate(&Preset::Quick.scenario(), 7).unwrap();
    let truth = recording.truth.as_ref().unwrap().parameters;
    let guess = Guess { time_offset_s: 0.0, ..truth };
    let config = Config { hold: vec![trueline_method::Hold::TimeOffset], ..Config::default() };
    let held = calibrate(&recording, Some(&guess), &config).unwrap();
    assert_eq!(held.best_fit().time_offset_s, 0.0);
    assert_eq!(held.sigma(0), None);
    let free = calibrate(&recording, Some(&guess), &Config::default()).unwrap();
    // 17.7 ms at some 20 mm/s across the line are 0.3 mm; noise is 0.035 mm.
    assert!(held.findings.fit.residuals.rms_m > 4.0 * free.findings.fit.residuals.rms_m);
    let config = Config { hold: vec![trueline_method::Hold::HandEye], ..Config::default() };
    let held = calibrate(&recording, Some(&truth), &config).unwrap();
    assert_eq!(held.best_fit().tool_from_camera, truth.tool_from_camera);
    assert!(calibrate(&recording, None, &config).is_err());
}

/// The residual in the image is in pixels, whatever noise the features state.
#[test]
fn pixels_are_pixels_whatever_sigma_the_features_state() {
    let mut recording = simulate(&Preset::Quick.scenario(), 3).unwrap();
    let rms_px = |recording: &Recording| {
        calibrate(recording, None, &Config::default()).unwrap().findings.fit.residuals.rms_px.unwrap()
    };
    let unstated = rms_px(&recording);
    for feature in &mut recording.features {
        feature.sigma = Some([0.03; 2]);
    }
    let stated = rms_px(&recording);
    // The weights are equal for all, and so is the optimum, except for the share of the robot's noise.
    assert!((stated / unstated - 1.0).abs() < 0.1, "{stated} px and {unstated} px");
}

/// Starts and sums are shared among threads, and results keep their order.
#[test]
fn the_result_is_the_same_to_the_last_bit_with_any_number_of_threads() {
    let recording = simulate(&Preset::TwoLines.scenario(), 7).unwrap();
    let with =
        |threads: usize| calibrate(&recording, None, &Config { threads, ..Config::default() }).unwrap();
    let [one, three] = [with(1), with(3)];
    assert_eq!(errors(&one, &recording).map(f64::to_bits), errors(&three, &recording).map(f64::to_bits));
    let sigmas = |calibration: &Calibration| [0, 3, 6].map(|k| calibration.sigma(k).unwrap().to_bits());
    assert_eq!(sigmas(&one), sigmas(&three));
}
