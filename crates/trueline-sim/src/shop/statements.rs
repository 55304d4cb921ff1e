//! Statements of a cell's files besides the measurements: a guess, the sensor's uncertainty, the arm's accuracy.

use super::level::Level;
use crate::noise::Noise;
use crate::scenario::SensorModel;
use nalgebra::Vector3;
use trueline_dataset::Guess;
use trueline_dataset::sensor_setup::{SensorSetup, SensorUncertainty};
use trueline_geometry::{Pose, se3};

/// Stream of random numbers of the statements.
const STREAM: u64 = 3920;
/// Share of the cells that state the sensor's uncertainty, the arm's accuracy, and a guess of the hand-eye transform (own, as the
/// given cells have it).
const SHARES: [f64; 3] = [0.5, 0.4, 0.3];
/// Accuracies of data sheets, m.
const ACCURACIES_M: [f64; 2] = [0.3e-3, 0.5e-3];
/// How far a guess is off: about each axis, rad, and along each, m.
const GUESS_OFF: [f64; 2] = [0.05, 4e-3];
/// Ratio of the stated value to the median of the errors.
const OF_MEDIAN: f64 = 1.2;

/// Content of `sensor.toml` and `initial.toml`.
pub(crate) fn drawn(
    seed: u64,
    level: Level,
    sensor: &SensorModel,
    truth: &Pose,
) -> (SensorSetup, Option<Guess>) {
    let mut noise = Noise::new(seed, STREAM);
    let [states_sensor, states_arm, guesses] = SHARES.map(|share| noise.happens(share));
    let accuracy_m = ACCURACIES_M[usize::from(noise.happens(0.5))];
    let scale = OF_MEDIAN * level.factors()[0];
    let uncertainty = match sensor {
        SensorModel::CameraLaser { .. } => SensorUncertainty {
            plane_offset_m: Some(0.05e-3 * scale),
            plane_normal_rad: Some(0.05_f64.to_radians() * scale),
            focal: Some(0.0008 * scale),
            principal_point_px: Some(1.5 * scale),
            ..SensorUncertainty::default()
        },
        SensorModel::Profiler { .. } | SensorModel::Points { .. } => SensorUncertainty {
            scale: Some(0.001 * scale),
            shear_rad: Some(0.04_f64.to_radians() * scale),
            keystone: Some(0.0008 * scale),
            ..SensorUncertainty::default()
        },
    };
    let setup = SensorSetup {
        uncertainty: states_sensor.then_some(uncertainty),
        robot_accuracy_m: states_arm.then_some(accuracy_m),
        ..SensorSetup::default()
    };
    let mut off = |sigma: f64| Vector3::from_fn(|_, _| noise.normal(sigma));
    let guess = se3::retract_decoupled(truth, &off(GUESS_OFF[0]), &off(GUESS_OFF[1]));
    (setup, guesses.then_some(Guess { time_offset_s: 0.0, tool_from_camera: guess }))
}
