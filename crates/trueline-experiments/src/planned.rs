//! The cell of a plan as a scenario to simulate.

use nalgebra::{UnitVector3, Vector3};
use trueline_dataset::Sensor;
use trueline_plan::{Cell, PlanError, View, stripes_ahead};
use trueline_sim::{Between, Disturbance, Plates, Preset, Scenario, SensorModel, Timing};

/// Why a plan cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum PlannedError {
    /// The cell has no seam.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The simulator does not know the sensor.
    #[error("a planned scan of a sensor of kind {0} cannot be simulated")]
    Sensor(&'static str),
}

impl PlannedError {
    /// What to do about it.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Plan(error) => error.hint(),
            Self::Sensor(_) => "the simulator knows camera_laser and profiler",
        }
    }
}

/// The scan of a cell as it was planned; its own movement is not used. With a seed, hand-eye and line are off the guess at random,
/// by as much as the plan allows for.
///
/// # Errors
/// A cell without a seam, and sensors that cannot be simulated.
pub fn scenario(cell: &Cell, duration_s: f64, off_guess: Option<u64>) -> Result<Scenario, PlannedError> {
    let mut scenario = Preset::Quick.scenario();
    let (tool_from_camera, seam) = match off_guess {
        Some(seed) => cell.guess_error.disturbed(&cell.tool_from_camera, &cell.seam, seed),
        None => (cell.tool_from_camera, cell.seam),
    };
    scenario.cell.sensor = sensor_model(cell)?;
    scenario.cell.tool_from_camera = tool_from_camera;
    scenario.cell.lines = vec![seam.line().ok_or(PlanError::NoSeam)?];
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

/// The two plates of a cell as the simulator has them, about the line of a scenario of it: turns the scenario's approach to halfway between
/// them. Their columns are as noisy as a feature is expected to be. `None` if the cell does not name two plates that hold its seam.
#[must_use]
pub fn plates(cell: &Cell, scenario: &mut Scenario) -> Option<Plates> {
    let [one, other] = stripes_ahead::plates(cell)?;
    let along = cell.seam.direction()?.into_inner();
    // From the seam along each plate, to the free side of the other.
    let outward = |normal: &Vector3<f64>, free: &Vector3<f64>| {
        let out = along.cross(normal).normalize();
        out * out.dot(free).signum()
    };
    let [one_out, other_out] = [outward(&one.normal, &other.normal), outward(&other.normal, &one.normal)];
    scenario.cell.approach = UnitVector3::try_new(-(one_out + other_out), 1e-6)?;
    Some(Plates {
        opening_rad: one_out.angle(&other_out),
        column_sigma_px: cell.noise.feature_px,
        ..Plates::default()
    })
}

fn sensor_model(cell: &Cell) -> Result<SensorModel, PlannedError> {
    match (&cell.sensor, &cell.view) {
        (Sensor::CameraLaser { camera, laser_plane_in_camera }, _) => {
            Ok(SensorModel::CameraLaser { camera: *camera, laser_plane_in_camera: *laser_plane_in_camera })
        }
        (Sensor::Profiler, View::Window { half_width_m, depth_m, .. }) => {
            Ok(SensorModel::Profiler { half_width_m: *half_width_m, range_m: *depth_m })
        }
        (other, _) => Err(PlannedError::Sensor(other.kind())),
    }
}
