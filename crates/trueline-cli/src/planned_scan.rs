//! A plan's folder: written by `plan`, read by `simulate`.

use crate::failure::Failure;
use std::fs;
use std::path::Path;
use trueline_dataset::{Error, Problem, Sensor, robot_csv};
use trueline_plan::{Cell, CellFiles, View, cell_toml};
use trueline_sim::{Between, Disturbance, FollowedPath, Preset, Scenario, SensorModel, Timing};

/// The poses to follow.
pub const PATH: &str = "path.csv";
/// What was known of the cell.
pub const CELL: &str = "cell.toml";

/// Reads a cell and the files beside it.
///
/// # Errors
/// Files that are missing or cannot be used.
pub fn read_files(file: &Path) -> Result<CellFiles, Failure> {
    let text = read_text(file)?;
    let sensor_text = read_text(&file.with_file_name(cell_toml::sensor_name(file, &text)?))?;
    Ok(CellFiles::of(file, text, sensor_text)?)
}

/// The text of a file.
pub fn read_text(file: &Path) -> Result<String, Failure> {
    fs::read_to_string(file).map_err(|error| {
        if error.kind() == std::io::ErrorKind::NotFound {
            return Failure::new(
                format!("{}: the file is missing", file.display()),
                "`trueline plan --example --out FOLDER` writes a cell.toml and a sensor.toml to begin with",
            );
        }
        Error::in_file(file, Problem::Io(error)).into()
    })
}

/// A scan along a planned path.
pub struct PlannedScan {
    /// What the simulation needs; its own movement is not used.
    pub scenario: Scenario,
    /// The path.
    pub path: FollowedPath,
}

/// Reads the plan in a folder as a scan to simulate: hand-eye and line are off the guess at random, by as much as the
/// plan allows for, unless the guess is to be exact.
///
/// # Errors
/// Files that are missing or cannot be used.
pub fn read(folder: &Path, exact_guess: bool, seed: u64) -> Result<PlannedScan, Failure> {
    let cell = read_files(&folder.join(CELL))?.cell;
    let file = folder.join(PATH);
    let poses = robot_csv::read(&file, read_text(&file)?.as_bytes())?;
    let times_s = poses.iter().map(|p| (p.stamp_ns - poses[0].stamp_ns) as f64 * 1e-9).collect();
    let poses: Vec<_> = poses.iter().map(|p| p.base_from_tool).collect();
    let path = FollowedPath::new(times_s, &poses)
        .map_err(|error| Failure::new(format!("{}: {error}", file.display()), "plan it again"))?;
    let scenario = scenario(&cell, path.duration_s(), (!exact_guess).then_some(seed))?;
    Ok(PlannedScan { scenario, path })
}

fn scenario(cell: &Cell, duration_s: f64, off_guess: Option<u64>) -> Result<Scenario, Failure> {
    let mut scenario = Preset::Quick.scenario();
    let (tool_from_camera, seam) = match off_guess {
        Some(seed) => cell.guess_error.disturbed(&cell.tool_from_camera, &cell.seam, seed),
        None => (cell.tool_from_camera, cell.seam),
    };
    scenario.cell.sensor = sensor_model(cell)?;
    scenario.cell.tool_from_camera = tool_from_camera;
    scenario.cell.lines = vec![seam.line().ok_or(trueline_plan::PlanError::NoSeam)?];
    scenario.timing = Timing {
        duration_s,
        robot_period_s: cell.robot_period_s,
        frame_period_s: cell.frame_period_s,
        between: Between::Smooth,
        ..scenario.timing
    };
    scenario.disturbance = Disturbance {
        feature_noise_px: cell.noise.feature_px,
        feature_noise_m: cell.noise.feature_m,
        robot_position_noise_m: cell.noise.robot_m,
        robot_rotation_noise_rad: cell.noise.robot_rad,
        frame_jitter_s: cell.noise.stamp_s,
        ..Disturbance::default()
    };
    Ok(scenario)
}

fn sensor_model(cell: &Cell) -> Result<SensorModel, Failure> {
    let range = |view: &View| match view {
        View::Window { half_width_m, depth_m, .. } => Some((*half_width_m, *depth_m)),
        View::Camera { .. } => None,
    };
    match (&cell.sensor, range(&cell.view)) {
        (Sensor::CameraLaser { camera, laser_plane_in_camera }, _) => {
            Ok(SensorModel::CameraLaser { camera: *camera, laser_plane_in_camera: *laser_plane_in_camera })
        }
        (Sensor::Profiler, Some((half_width_m, range_m))) => {
            Ok(SensorModel::Profiler { half_width_m, range_m })
        }
        (other, _) => Err(Failure::new(
            format!("a planned scan of a sensor of kind {} cannot be simulated", other.kind()),
            "the simulator knows camera_laser and profiler",
        )),
    }
}
