//! How many directions whole stripes say they see is how many the motion shows, whatever the noise of the robot's attitudes.
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test fails by panicking; figures are shown by --nocapture"
)]

use trueline_dataset::Recording;
use trueline_method::{Config, Measurements, SensorMode, calibrate};
use trueline_sim::{
    PlatePair, Plates, Preset, ProfileLook, Scenario, SensorModel, random_cell, scan_plates, scan_profiles,
};
use trueline_vision::profile;

fn recorded(scenario: &Scenario, plates: &Plates, seed: u64) -> Recording {
    if matches!(scenario.cell.sensor, SensorModel::CameraLaser { .. }) {
        return scan_plates(scenario, plates, seed).unwrap();
    }
    let (mut recording, profiles) = scan_profiles(scenario, plates, &ProfileLook::default(), seed).unwrap();
    let found = profile::seams(&profiles, None).found;
    (recording.features, recording.stripes) = (found.features, found.stripes);
    recording
}

/// Rank and number of unknowns.
fn rank(recording: &Recording) -> (usize, usize) {
    let truth = recording.truth.as_ref().unwrap().parameters;
    let config =
        Config { measurements: Measurements::Stripe, sensor: SensorMode::Fixed, ..Config::noise_only() };
    let calibration = calibrate(recording, Some(&truth), &config).unwrap();
    let observability = &calibration.findings.unknowns.observability;
    (observability.rank, observability.size)
}

/// The cell's view during a motion, if it is incomplete.
fn wrong(scenario: &Scenario, hidden: usize, pairs: &[PlatePair]) -> Vec<String> {
    let [camera, profiler] = [Preset::Quick, Preset::Profiler].map(|preset| preset.scenario().cell.sensor);
    let mut wrong = Vec::new();
    for (sensor, pair) in pairs.iter().flat_map(|pair| [(&camera, *pair), (&profiler, *pair)]) {
        for (noise_deg, seed) in [0.001, 0.01, 0.03].into_iter().flat_map(|deg| [(deg, 1), (deg, 2)]) {
            let mut scenario = scenario.clone();
            scenario.cell.sensor = sensor.clone();
            scenario.disturbance.robot_rotation_noise_rad = f64::to_radians(noise_deg);
            let scenario = random_cell(&scenario, seed, 0.1);
            let plates = Plates { pair, ..Plates::default() };
            let (rank, size) = rank(&recorded(&scenario, &plates, seed));
            let is_camera = matches!(sensor, SensorModel::CameraLaser { .. });
            let of = if is_camera { "camera" } else { "profiler" };
            let cell = format!("{of}, {pair:?}, {noise_deg}°, cell {seed}: {rank}/{size}");
            println!("{cell}");
            if rank + hidden != size {
                wrong.push(cell);
            }
        }
    }
    wrong
}

/// Every shift of the sensor is a shift of the target: three directions. Of one plate with its edge they are not found in every cell (two of twelve are one or two
/// off), nor of two plates with attitude noise of 0.1° (two of four): neither is asked for here.
#[test]
fn stripes_of_a_scan_with_a_constant_attitude_hide_three_directions() {
    let wrong = wrong(&Preset::ConstantAttitude.scenario(), 3, &[PlatePair::Meeting]);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn stripes_of_a_scan_with_turns_of_15_degrees_hide_nothing() {
    let wrong = wrong(&Preset::Quick.scenario(), 0, &[PlatePair::Meeting, PlatePair::Edge]);
    assert!(wrong.is_empty(), "{wrong:#?}");
}
