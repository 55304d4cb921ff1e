//! The cell of a plan as a scenario to simulate.

use nalgebra::{UnitQuaternion, UnitVector3, Vector3};
use trueline_dataset::Sensor;
use trueline_geometry::Polyline;
use trueline_plan::{Cell, Joint, NoJoint, PlanError, Seam, View};
use trueline_sim::{Between, Disturbance, PlatePair, Plates, Preset, Scenario, SensorModel, Timing};

/// Why a plan cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum PlannedError {
    /// The cell has no seam.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The simulator does not support the sensor.
    #[error("a planned scan of a sensor of kind {0} cannot be simulated")]
    Sensor(&'static str),
}

impl PlannedError {
    /// The remedy.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Plan(error) => error.hint(),
            Self::Sensor(_) => "the simulator supports camera_laser and profiler",
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
    scenario.cell.curve = cell.course.as_ref().and_then(|course| moved(course.drawn(), &cell.seam, &seam));
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

/// The plates of a cell as the simulator has them, about the line of a scenario of it: turns the scenario's approach to halfway between
/// them. Their columns, and an edge along its stripe, are as noisy as a feature is expected to be.
///
/// # Errors
/// A cell with plates that make no joint.
pub fn plates(cell: &Cell, scenario: &mut Scenario) -> Result<Plates, NoJoint> {
    let joint = Joint::of(cell)?;
    let [one, other] = &joint.plates;
    let along = cell.seam.direction().ok_or(NoJoint::Unnamed)?;
    let up = UnitVector3::new_normalize(one.normal.as_ref() + other.normal.as_ref());
    scenario.cell.approach = -up;
    // The sensor's left hand is the simulator's: plate 0 lies there.
    let is_right = |number: usize| joint.plates[number].outward.dot(&up.cross(&along)) > 0.0;
    let pair = match (joint.edge_on, joint.seen) {
        (None, _) => PlatePair::Meeting,
        (Some(on), [true, true]) => PlatePair::Lap { step_m: -joint.plates[1 - on].above_m },
        (Some(_), _) => PlatePair::Edge,
    };
    Ok(Plates {
        pair,
        edge_on: joint.edge_on.map_or(0, |on| usize::from(is_right(on))),
        opening_rad: 2.0 * one.outward.angle(&up),
        column_sigma_px: cell.noise.feature_px,
        edge_sigma_px: cell.noise.feature_px,
        ..Plates::default()
    })
}

/// A curve that moves as its tangent line does.
fn moved(curve: &Polyline, from: &Seam, to: &Seam) -> Option<Polyline> {
    let middle = |seam: &Seam| 0.5 * (seam.from_m + seam.to_m);
    let turn = UnitQuaternion::rotation_between_axis(&from.direction()?, &to.direction()?)?;
    let place = |point: &Vector3<f64>| turn * (point - middle(from)) + middle(to);
    Polyline::new(curve.points().iter().map(place).collect())
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
