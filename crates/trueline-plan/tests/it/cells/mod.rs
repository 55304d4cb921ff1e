//! Cells to plan in, and scans along what was planned.
#![allow(
    dead_code,
    clippy::unwrap_used,
    missing_docs,
    reason = "several tests use a part each; a test fails by panicking"
)]

use nalgebra::{UnitVector3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitSphere};
use std::path::Path;
use trueline_dataset::{Recording, Sensor, sensor_toml};
use trueline_geometry::{Pose, se3, so3};
use trueline_plan::sensor_pose::SensorPose;
use trueline_plan::{Cell, GuessError, Limits, Seam, cell_toml};
use trueline_sim::{Between, Disturbance, Preset, Scenario, SensorModel, simulate_along};

pub(crate) mod axes;

pub(crate) fn example() -> Cell {
    example_with("").unwrap()
}

/// The example with more in its file.
pub(crate) fn example_with(more: &str) -> Result<Cell, trueline_dataset::Error> {
    let file = Path::new("cell.toml");
    let sensor = sensor_toml::parse(file, cell_toml::EXAMPLE_SENSOR).unwrap();
    cell_toml::parse(file, &format!("{}\n{more}", cell_toml::EXAMPLE), sensor)
}

/// No error of the guess at all.
pub(crate) fn exact(cell: Cell) -> Cell {
    Cell { guess_error: GuessError { translation_m: 0.0, rotation_rad: 0.0, line_m: 0.0 }, ..cell }
}

/// The example's sensor on any mounting over any seam, with other limits.
pub(crate) fn random(seed: u64) -> Cell {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut direction = || Vector3::from(UnitSphere.sample(&mut random));
    let (along, turn, approach, place, arm) =
        (direction(), direction(), direction(), direction(), direction());
    let approach = UnitVector3::new_normalize(approach - along * (0.9 * along.dot(&approach)));
    let mut within = |low: f64, high: f64| random.random_range(low..high);
    let mut cell = example();
    cell.tool_from_camera = se3::from_parts(so3::exp(&(turn * within(0.0, 3.0))), arm * 0.2);
    let middle = place * 1.2;
    let half = along * within(0.05, 0.25);
    cell.seam = Seam { from_m: middle - half, to_m: middle + half };
    let plane = *cell.sheet.plane();
    cell.sensor_pose = SensorPose::looking(
        plane,
        &cell.tool_from_camera,
        &UnitVector3::new_normalize(along),
        &approach,
        within(0.0, 1.0) > 0.5,
    )
    .unwrap();
    let share = within(0.0, 0.9);
    let GuessError { translation_m, rotation_rad, line_m } = GuessError::default();
    cell.guess_error = GuessError {
        translation_m: share * translation_m,
        rotation_rad: share * rotation_rad,
        line_m: share * line_m,
    };
    cell.limits = Limits {
        stand_off_m: [within(0.10, 0.14), within(0.2, 0.28)],
        tilt_rad: std::array::from_fn(|_| within(5.0, 30.0_f64).to_radians()),
        speed_m_s: within(0.08, 0.4),
        acceleration_m_s2: within(0.2, 3.0),
        jerk_m_s3: within(2.0, 40.0),
        turn_rad_s: within(0.1, 1.5),
        turn_acceleration_rad_s2: within(0.3, 5.0),
        turn_jerk_rad_s3: within(3.0, 50.0),
        tip_speed_m_s: 0.25,
        spun_pass: false,
        reach_m: within(0.1, 0.6),
        workspace_m: None,
    };
    cell
}

/// The simulator's settings for a cell with this true hand-eye and seam.
pub(crate) fn scenario(cell: &Cell, truth: (Pose, Seam), duration_s: f64) -> Scenario {
    let mut scenario = Preset::Quick.scenario();
    let Sensor::CameraLaser { camera, laser_plane_in_camera } = cell.sensor.clone() else { unreachable!() };
    scenario.cell.sensor = SensorModel::CameraLaser { camera, laser_plane_in_camera };
    scenario.cell.tool_from_camera = truth.0;
    scenario.cell.lines = vec![truth.1.line().unwrap()];
    scenario.timing.duration_s = duration_s;
    scenario.timing.frame_period_s = cell.frame_period_s;
    scenario.timing.robot_period_s = cell.robot_period_s;
    scenario.timing.between = Between::Smooth;
    scenario.disturbance = Disturbance {
        feature_noise_px: cell.noise.feature_px,
        robot_position_noise_m: cell.noise.robot_m,
        robot_rotation_noise_rad: cell.noise.robot_rad,
        frame_jitter_s: cell.noise.stamp_s,
        ..Disturbance::default()
    };
    scenario
}

/// A scan along a motion.
pub(crate) fn scan(scenario: &Scenario, motion: &trueline_plan::Motion, seed: u64) -> Recording {
    simulate_along(scenario, &|time_s| motion.base_from_tool(time_s), seed)
}
