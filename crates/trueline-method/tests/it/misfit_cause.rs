//! Causes of residuals beyond noise are named with their size, and without a cause nothing is named.

use trueline_dataset::{Recording, Sensor};
use trueline_method::assess::cause_kind::CauseKind;
use trueline_method::assess::confounded_causes::ConfoundedCause;
use trueline_method::{Calibration, Config, Reason, SensorMode, Status, Warning, calibrate};
use trueline_sim::{Preset, Scenario, random_cell, simulate_with_faults};

fn calibrated(scenario: &Scenario, fault: &[&str], config: &Config, seed: u64) -> Calibration {
    let faults: Vec<_> = fault.iter().map(|fault| fault.parse().unwrap()).collect();
    calibrate(&simulate_with_faults(scenario, &faults, seed).unwrap(), None, config).unwrap()
}

fn codes(c: &Calibration) -> Vec<&'static str> {
    c.reasons().iter().map(Reason::code).chain(c.warnings().iter().map(Warning::code)).collect()
}

/// Sizes are in the unit of each kind. Differences over 0.2 s reduce a weave of half a hertz by a few percent.
#[test]
fn each_cause_is_named_with_its_size_and_the_sensor_is_not_blamed() {
    let rows = [
        ("flex=0.2", CauseKind::Flex, 0.2e-3, 0.15),
        ("backlash=0.1", CauseKind::Backlash, 0.1e-3, 0.3),
        ("attitude-lag=2", CauseKind::AttitudeLag, 2e-3, 0.15),
        ("rolling-shutter=25", CauseKind::RollingShutter, 25e-3, 0.15),
        ("bias-side=2", CauseKind::SideBias, 2.0, 0.15),
        // Its uncertainty is an eighth.
        ("command-lag=20", CauseKind::CommandedPose, 0.4e-3, 0.4),
    ];
    for (fault, kind, size, share) in rows {
        for scenario in [Preset::Good.scenario(), random_cell(&Preset::Good.scenario(), 2, 0.1)] {
            let c = calibrated(&scenario, &[fault], &Config::default(), 1);
            let cause =
                c.findings.checks.cause.as_ref().unwrap_or_else(|| panic!("{fault}: {:?}", codes(&c)));
            assert_eq!(cause.kind, kind);
            assert!(
                (cause.size.abs() / size - 1.0).abs() < share,
                "{fault}: {} ± {}",
                cause.size,
                cause.sigma
            );
            assert!(kind == CauseKind::SideBias || cause.size > 0.0, "{fault}: {}", cause.size);
            assert!(!codes(&c).contains(&"sensor-off"), "{fault}: {:?}", codes(&c));
        }
    }
}

/// The assumed errors of a usual robot hide causes as small as these.
fn good_robot() -> Config {
    Config { robot_accuracy_m: Some(0.3e-3), ..Config::default() }
}

/// A seam that swings with one frequency: its acceleration is proportional to its place, so a lag of the arm looks like a scale of the sensor.
#[test]
fn a_lag_that_a_scan_does_not_tell_from_the_sensor_is_named_beside_it() {
    let lag = |instead: &[ConfoundedCause]| {
        instead.iter().find(|c| c.kind == CauseKind::CommandedPose).map(|c| c.size)
    };
    for preset in [Preset::Quick, Preset::Paper, Preset::TwoLines] {
        for seed in 1..4 {
            let scenario = random_cell(&preset.scenario(), seed, 0.1);
            let c = calibrated(&scenario, &["command-lag=20"], &good_robot(), seed);
            let instead = c.warnings().iter().find_map(|warning| match warning {
                Warning::SensorOff { instead, .. } => Some(instead),
                _ => None,
            });
            // Two lines determine a scale half as well. There it may pass for noise.
            let Some(instead) = instead else {
                assert_eq!(preset, Preset::TwoLines, "{:?}", codes(&c));
                continue;
            };
            let size = lag(instead).unwrap_or_else(|| panic!("{} {seed}: {instead:?}", preset.name()));
            // Widths are known to a quarter at worst, and the lag is the root of it.
            assert!((size.sqrt() - 20e-3).abs() < 4e-3, "{}: {size}", preset.name());
            let sensor = SensorMode::Fixed;
            let held =
                calibrated(&scenario, &["command-lag=20"], &Config { sensor, ..Config::default() }, seed);
            let named = held
                .reasons()
                .iter()
                .any(|reason| matches!(reason, Reason::SensorOff { instead, .. } if lag(instead).is_some()));
            assert!(named || held.status() == Status::Accepted, "{:?}", held.reasons());
        }
    }
}

#[test]
fn a_sensor_that_is_off_is_named_alone_where_the_scan_tells() {
    for fault in ["plane-offset=1", "plane-tilt-stripe=0.5", "focal=0.5"] {
        let c = calibrated(&random_cell(&Preset::Good.scenario(), 2, 0.1), &[fault], &Config::default(), 2);
        let alone =
            |warning: &Warning| matches!(warning, Warning::SensorOff { instead, .. } if instead.is_empty());
        assert!(c.warnings().iter().any(alone), "{fault}: {:?}", c.warnings());
    }
}

/// The file lacks k1. k2 and the rest are correct.
#[test]
fn a_lens_that_the_file_has_not_is_found_and_the_corrected_file_has_it() {
    for seed in 1..4 {
        let scenario = random_cell(&Preset::Good.scenario(), seed, 0.1);
        let fault = "distortion=-0.08".parse().unwrap();
        let recording = simulate_with_faults(&scenario, &[fault], seed).unwrap();
        let c = calibrate(&recording, None, &Config::default()).unwrap();
        assert!(codes(&c).contains(&"lens-off") && !codes(&c).contains(&"sensor-off"), "{:?}", codes(&c));
        let lens = c.findings.checks.lens.unwrap();
        let corrected = c.findings.unknowns.corrected.clone().unwrap();
        let [found, stated] = [&corrected.sensor, &recording.sensor].map(|sensor| match sensor {
            Sensor::CameraLaser { camera, .. } => [camera.distortion.k1, camera.distortion.k2],
            _ => unreachable!("the preset has a camera"),
        });
        for (k, wrong) in [-0.08, 0.0].into_iter().enumerate() {
            println!("{seed} k{}: {} ± {}", k + 1, lens.distortion[k], lens.sigma[k]);
            assert!((found[k] - stated[k] - lens.distortion[k]).abs() < 1e-12);
            // An unobservable number is zero, without an uncertainty.
            let off = if lens.sigma[k] > 0.0 { (lens.distortion[k] - wrong) / lens.sigma[k] } else { 0.0 };
            assert!(off.abs() < 4.5, "{off}");
        }
        // With the corrected file nothing remains to be found.
        let again = calibrate(&Recording { sensor: corrected.sensor, ..recording }, None, &Config::default());
        let again = again.unwrap();
        assert!(!codes(&again).iter().any(|code| code.ends_with("-off")), "{:?}", codes(&again));
    }
}

/// Its robot moves straight from pose to pose. A smoothed path cuts those corners, which no elastic arm would do.
#[test]
fn the_corners_of_the_papers_path_are_no_arm_that_gives_way() {
    for seed in 1..4 {
        let c = calibrated(&Preset::Paper.scenario(), &[], &Config::default(), seed);
        assert!(!codes(&c).iter().any(|code| code.starts_with("robot-")), "{seed}: {:?}", codes(&c));
    }
}

#[test]
fn a_held_sensor_is_not_refused_for_a_robot_that_gives_way() {
    let config = Config { sensor: SensorMode::Fixed, ..Config::noise_only() };
    let c = calibrated(&Preset::Good.scenario(), &["flex=0.2"], &config, 1);
    assert!(!codes(&c).contains(&"sensor-off"), "{:?}", codes(&c));
    let c = calibrated(&Preset::Good.scenario(), &["plane-offset=1"], &config, 1);
    assert!(codes(&c).contains(&"sensor-off"), "{:?}", codes(&c));
}

/// Two passes, the second with the sensor spun by half a turn about its view. A bias of a third of a pixel, which would look
/// like another hand-eye transform without this pass, is seen, measured and removed from the answer.
#[test]
fn a_spun_pass_shows_a_bias_and_measures_it() {
    let mut spun = Preset::Good.scenario();
    (spun.scan.passes, spun.scan.spin_by_pass_rad) = (2, std::f64::consts::PI);
    let config = Config { robot_accuracy_m: Some(0.0), ..Config::default() };
    let plain = calibrated(&Preset::Good.scenario(), &["bias-work-angle=0.33"], &config, 3);
    let c = calibrated(&spun, &["bias-work-angle=0.33"], &config, 3);
    let bias = c.findings.checks.feature_bias.unwrap_or_else(|| panic!("{:?}", codes(&c)));
    // 0.33 px down the image and half as much along its rows, about an axis perpendicular to the view.
    let size = |row: usize| bias.px.iter().map(|px| px[row].powi(2)).sum::<f64>().sqrt();
    println!("{bias:?} {:?}", plain.findings.checks.feature_bias);
    assert!(bias.is_found, "{bias:?}");
    assert!((size(1) / 0.33 - 1.0).abs() < 0.15 && (size(0) / 0.165 - 1.0).abs() < 0.3, "{bias:?}");
    let truth = spun.cell.tool_from_camera.translation.vector;
    let off_mm = (c.best_fit().tool_from_camera.translation.vector - truth).norm() * 1e3;
    let plain_mm = (plain.best_fit().tool_from_camera.translation.vector - truth).norm() * 1e3;
    println!("{off_mm:.3} mm with the spun pass, {plain_mm:.3} mm without");
    assert!(off_mm < 0.05, "{off_mm}");
    let budget_mm = |c: &Calibration| c.findings.checks.seam_error.unwrap().budget_m.feature_bias * 1e3;
    assert!(budget_mm(&c) < 0.5 * budget_mm(&plain), "{} {}", budget_mm(&c), budget_mm(&plain));
}

/// 0.05° of attitude is 1.3 mm at the end of an arm, four times the assumed robot error. The robot is reported.
#[test]
fn a_robot_that_is_worse_than_assumed_is_named() {
    for seed in [1, 2] {
        let c = calibrated(&Preset::Good.scenario(), &["robot-attitude=0.05,500"], &Config::default(), seed);
        println!("{:?} {:?}", c.findings.checks.robot_seems, codes(&c));
        assert!(codes(&c).contains(&"robot-inaccurate"), "{:?}", codes(&c));
        let ordinary =
            calibrated(&Preset::Good.scenario(), &["robot-field=0.05,500"], &Config::default(), seed);
        assert!(!codes(&ordinary).contains(&"robot-inaccurate"), "{:?}", codes(&ordinary));
    }
}

#[test]
fn no_cause_is_reported_without_one() {
    for seed in 0..5 {
        let scenario = random_cell(&Preset::Good.scenario(), seed, 0.1);
        for faults in [&[][..], &["correlated-noise=0.2"], &["plane-offset=1"]] {
            let c = calibrated(&scenario, faults, &Config::default(), seed);
            assert_eq!(c.findings.checks.cause.as_ref().map(|cause| cause.kind), None, "{faults:?}");
            assert!(c.findings.checks.feature_bias.is_none_or(|bias| !bias.is_found), "{faults:?}");
        }
    }
}

/// 1.3 px across the rows and half of it along them, for the tilt about the seam. With the bias removed a seam point is
/// right again, although the bias is six times the assumed limit.
#[test]
fn a_bias_with_the_tilt_is_found_and_taken_out() {
    for seed in 0..3 {
        let scenario = random_cell(&Preset::Good.scenario(), seed, 0.1);
        let c = calibrated(&scenario, &["bias-work-angle=1.3"], &good_robot(), seed);
        let bias = c.findings.checks.feature_bias.unwrap();
        assert!(bias.is_found && codes(&c).contains(&"feature-bias"), "{:?}", codes(&c));
        let (px, sigma_px) = bias.clearest_px();
        assert!(px.abs() > 0.9 && px.abs() < 1.7 && sigma_px < 0.3, "{px} ± {sigma_px}");
        // The residuals are noise again, except for the part of the bias that is not linear in the tilt, a few percent.
        let [with, without] =
            [&c, &calibrated(&scenario, &[], &good_robot(), seed)].map(|c| c.findings.fit.noise_factor);
        assert!(with < 1.06 * without, "{with} {without}");
        let truth = scenario.cell.tool_from_camera;
        let off = (c.best_fit().tool_from_camera.translation.vector - truth.translation.vector).norm();
        let sigma = (4..7).map(|k| c.sigma(k).unwrap().powi(2)).sum::<f64>().sqrt();
        assert!(off < 2.5 * sigma, "{off} {sigma}");
    }
}
