//! The tables of `cell.toml`, and the cell that they describe.

use super::arm_table::{self, ArmTable, PlateTable, SphereTable};
use super::values::{PoseTable, between, not_negative, point, positive, range, wrong};
use crate::cell::{Cell, ExpectedNoise};
use crate::cell_axis::CellAxis;
use crate::guess_error::GuessError;
use crate::limits::Limits;
use crate::seam::Seam;
use crate::sensor_pose::SensorPose;
use crate::surroundings::Surroundings;
use crate::view::View;
use nalgebra::{UnitVector3, Vector3};
use serde::Deserialize;
use std::path::Path;
use trueline_dataset::robot_csv::unit_quaternion;
use trueline_dataset::sensor_toml::parse_toml;
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{Error, Problem, Sensor, axes_toml};
use trueline_geometry::{Plane, Pose};
use trueline_model::LaserSheet;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CellFile {
    #[serde(default = "sensor_file")]
    sensor: String,
    seam: SeamTable,
    tool_from_camera: PoseTable,
    #[serde(default)]
    attitude: AttitudeTable,
    #[serde(default)]
    guess_error: GuessErrorTable,
    #[serde(default)]
    limits: LimitsTable,
    #[serde(default)]
    view: ViewTable,
    #[serde(default)]
    noise: NoiseTable,
    #[serde(default)]
    rates: RatesTable,
    arm: Option<ArmTable>,
    #[serde(default)]
    spheres: Vec<SphereTable>,
    #[serde(default)]
    plates: Vec<PlateTable>,
    // The same file describes the external axes of a scan, and is read for them as there.
    #[serde(rename = "axis")]
    _axes: Option<toml::Value>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SeamTable {
    from_mm: [f64; 3],
    to_mm: [f64; 3],
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct AttitudeTable {
    approach: Option<[f64; 3]>,
    #[serde(default)]
    backward: bool,
    base_from_tool_wxyz: Option<[f64; 4]>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct GuessErrorTable {
    translation_mm: Option<f64>,
    rotation_deg: Option<f64>,
    line_mm: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitsTable {
    stand_off_mm: Option<[f64; 2]>,
    tilt_deg: Option<[f64; 3]>,
    workspace_mm: Option<[[f64; 3]; 2]>,
    speed_mm_s: Option<f64>,
    acceleration_mm_s2: Option<f64>,
    jerk_mm_s3: Option<f64>,
    turn_deg_s: Option<f64>,
    turn_acceleration_deg_s2: Option<f64>,
    turn_jerk_deg_s3: Option<f64>,
    tip_speed_mm_s: Option<f64>,
    reach_mm: Option<f64>,
    spun_pass: Option<bool>,
    clearance_mm: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ViewTable {
    margin_px: Option<f64>,
    width_mm: Option<f64>,
    depth_mm: Option<[f64; 2]>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct NoiseTable {
    feature_px: Option<f64>,
    feature_mm: Option<f64>,
    robot_mm: Option<f64>,
    robot_deg: Option<f64>,
    stamp_ms: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RatesTable {
    frames_hz: Option<f64>,
    robot_hz: Option<f64>,
}

pub(super) fn sensor_file() -> String {
    "sensor.toml".to_owned()
}

/// Cameras and profilers.
const FRAMES_HZ: ([f64; 2], &str) = ([1.0, 20_000.0], "a rate from 1 to 20000");
/// Slower feedback leaves the path between its samples to guesswork, and no prediction holds.
const ROBOT_HZ: ([f64; 2], &str) = ([20.0, 5000.0], "a rate from 20 to 5000");
/// More than a guess can be wrong by.
const MOST_MM: ([f64; 2], &str) = ([0.0, 500.0], "millimetres from 0 to 500");
/// See [`MOST_MM`].
const MOST_DEG: ([f64; 2], &str) = ([0.0, 30.0], "degrees from 0 to 30");
/// A shorter seam was written in another unit.
const LEAST_SEAM_M: f64 = 0.010;

/// From a camera's centre to the farthest corner of its sensor, m.
const SENSOR_BODY_M: f64 = 0.1;
/// Arms shorter than this are not believed by the seam detector, px.
const MARGIN_PX: f64 = 100.0;

/// The name of the sensor's file, which lies beside the cell's.
///
/// # Errors
/// Broken TOML or unknown keys.
pub fn sensor_name(file: &Path, text: &str) -> Result<String, Error> {
    Ok(tables(file, text)?.sensor)
}

/// The name of the arm's URDF, which is beside the cell's file; `None` if it has none.
///
/// # Errors
/// Broken TOML or unknown keys.
pub fn urdf_name(file: &Path, text: &str) -> Result<Option<String>, Error> {
    Ok(tables(file, text)?.arm.and_then(|arm| arm.urdf))
}

/// Reads a cell from the text of its file, for a sensor that was read before.
///
/// # Errors
/// Broken TOML, unknown keys, or values that no cell has; an arm that is described in another file.
pub fn parse(file: &Path, text: &str, sensor: Sensor) -> Result<Cell, Error> {
    parse_with_urdf(file, text, sensor, None)
}

/// The same with the text of the URDF that [`urdf_name`] names.
///
/// # Errors
/// Broken TOML, unknown keys, or values that no cell has; a URDF without six joints and their limits.
pub fn parse_with_urdf(file: &Path, text: &str, sensor: Sensor, urdf: Option<&str>) -> Result<Cell, Error> {
    let wire = tables(file, text)?;
    let cell = cell_from(wire, sensor, urdf).map_err(|problem| Error::in_file(file, problem))?;
    let loads_m = [0.5 * (cell.seam.from_m + cell.seam.to_m), cell.tool_from_camera.translation.vector];
    let axis = |planned| CellAxis::of(planned, &cell.guess_error, loads_m);
    let axes = axes_toml::planned(file, text)?.into_iter().map(axis).collect::<Result<_, _>>();
    Ok(Cell { axes: axes.map_err(|problem| Error::in_file(file, problem))?, ..cell })
}

/// The tables of a file. A scan is planned along one seam: several are several files, and `calibrate` takes their scans together.
fn tables(file: &Path, text: &str) -> Result<CellFile, Error> {
    const ONE: &str =
        "one table [seam]: plan each further seam from a file of its own, then calibrate the scans together";
    let table: toml::Table = parse_toml(file, text)?;
    match table.get("seam").and_then(toml::Value::as_array) {
        Some(seams) => Err(Error::in_file(file, wrong("seam", ONE, &format!("{} tables", seams.len())))),
        None => parse_toml(file, text),
    }
}

fn cell_from(wire: CellFile, sensor: Sensor, urdf: Option<&str>) -> Result<Cell, Problem> {
    let plane = sheet_plane(&sensor)?;
    let tool_from_camera = wire.tool_from_camera.pose("tool_from_camera.translation_mm")?;
    let seam = Seam {
        from_m: point("seam.from_mm", wire.seam.from_mm)?,
        to_m: point("seam.to_mm", wire.seam.to_mm)?,
    };
    let length_mm = seam.length_m() * MM_PER_M;
    let along = seam.direction().filter(|_| seam.length_m() >= LEAST_SEAM_M);
    let along = along
        .ok_or_else(|| wrong("seam", "ends at least 10 mm apart, in mm", &format!("{length_mm:.3} mm")))?;
    let sensor_pose = sensor_pose(&wire.attitude, plane, &tool_from_camera, &along)?;
    let view = view(&wire.view, &sensor, sensor_pose.stripe())?;
    let rates = [
        between("rates.frames_hz", wire.rates.frames_hz, 33.0, FRAMES_HZ)?,
        between("rates.robot_hz", wire.rates.robot_hz, 250.0, ROBOT_HZ)?,
    ];
    let guess_error = guess_error(&wire.guess_error)?;
    Ok(Cell {
        course: None,
        axes: Vec::new(),
        view,
        arm: wire.arm.as_ref().map(|arm| arm_table::mounted(arm, urdf)).transpose()?,
        surroundings: surroundings(&wire, &seam, &guess_error)?,
        sheet: match sensor {
            Sensor::Profiler => LaserSheet::of_profiler(),
            _ => LaserSheet::from_plane(plane),
        },
        sensor,
        tool_from_camera,
        seam,
        sensor_pose,
        guess_error,
        limits: limits(&wire.limits, &tool_from_camera)?,
        noise: noise(&wire.noise)?,
        frame_period_s: 1.0 / rates[0],
        robot_period_s: 1.0 / rates[1],
    })
}

/// Bodies that must not touch. The plates are as uncertain as the line, unless otherwise stated.
fn surroundings(wire: &CellFile, seam: &Seam, guess_error: &GuessError) -> Result<Surroundings, Problem> {
    // Plates alone describe stripes; spheres alone have nothing to touch.
    if !wire.spheres.is_empty() && wire.plates.is_empty() {
        return Err(wrong("spheres", "`[[plates]]` beside `[[spheres]]`", "none"));
    }
    let line_mm = guess_error.line_m * MM_PER_M;
    Ok(Surroundings {
        spheres: arm_table::spheres(&wire.spheres, wire.arm.is_some())?,
        plates: arm_table::plates(&wire.plates, seam)?,
        clearance_m: not_negative("limits.clearance_mm", wire.limits.clearance_mm, line_mm)? / MM_PER_M,
    })
}

fn sheet_plane(sensor: &Sensor) -> Result<Plane, Problem> {
    let known = match sensor {
        Sensor::CameraLaser { laser_plane_in_camera, .. } => Some(*laser_plane_in_camera),
        Sensor::Profiler => Plane::new(Vector3::y(), 0.0),
        Sensor::Points { laser_plane_in_camera } => *laser_plane_in_camera,
    };
    known.ok_or_else(|| wrong("laser_plane", "a laser plane in sensor.toml, to plan with", "none"))
}

fn sensor_pose(
    wire: &AttitudeTable,
    plane: Plane,
    tool_from_camera: &Pose,
    along: &UnitVector3<f64>,
) -> Result<SensorPose, Problem> {
    let made = match (wire.approach, wire.base_from_tool_wxyz) {
        (Some(_), Some(_)) => {
            return Err(wrong("attitude", "`approach` or `base_from_tool_wxyz`", "both"));
        }
        (None, Some(wxyz)) => {
            if wire.backward {
                return Err(wrong("attitude.backward", "`approach` beside it", "`base_from_tool_wxyz`"));
            }
            SensorPose::with_attitude(plane, tool_from_camera, &unit_quaternion(wxyz)?)
        }
        (approach, None) => {
            let approach = approach.unwrap_or([0.0, 0.0, -1.0]);
            let unit = UnitVector3::try_new(Vector3::from(approach), 1e-6)
                .filter(|u| u.iter().all(|x| x.is_finite()))
                .ok_or_else(|| wrong("attitude.approach", "a direction", &format!("{approach:?}")))?;
            SensorPose::looking(plane, tool_from_camera, along, &unit, wire.backward)
        }
    };
    made.ok_or_else(|| {
        wrong(
            "attitude.approach",
            "a direction across the seam, and a laser plane oblique to the camera's axis",
            "neither or one",
        )
    })
}

fn view(wire: &ViewTable, sensor: &Sensor, stripe: Vector3<f64>) -> Result<View, Problem> {
    if let Sensor::CameraLaser { camera, .. } = sensor {
        if wire.width_mm.is_some() || wire.depth_mm.is_some() {
            return Err(wrong("view", "`margin_px` for a camera_laser", "`width_mm` or `depth_mm`"));
        }
        let margin_px = not_negative("view.margin_px", wire.margin_px, MARGIN_PX)?;
        return Ok(View::of_camera(*camera, margin_px));
    }
    if wire.margin_px.is_some() {
        return Err(wrong("view.margin_px", "`width_mm` and `depth_mm` for this sensor", "`margin_px`"));
    }
    let (Some(width_mm), Some(depth_mm)) = (wire.width_mm, wire.depth_mm) else {
        return Err(wrong("view", "`width_mm` and `depth_mm`: the sensor's field of view", "nothing"));
    };
    Ok(View::Window {
        half_width_m: 0.5 * positive("view.width_mm", Some(width_mm), width_mm)? / MM_PER_M,
        depth_m: range("view.depth_mm", depth_mm)?.map(|mm| mm / MM_PER_M),
        stripe,
    })
}

fn guess_error(wire: &GuessErrorTable) -> Result<GuessError, Problem> {
    let default = GuessError::default();
    let mm = |key, value, m: f64| between(key, value, m * MM_PER_M, MOST_MM).map(|mm| mm / MM_PER_M);
    let degrees = default.rotation_rad.to_degrees();
    let rotation_deg = between("guess_error.rotation_deg", wire.rotation_deg, degrees, MOST_DEG)?;
    Ok(GuessError {
        translation_m: mm("guess_error.translation_mm", wire.translation_mm, default.translation_m)?,
        rotation_rad: rotation_deg.to_radians(),
        line_m: mm("guess_error.line_mm", wire.line_mm, default.line_m)?,
    })
}

fn limits(wire: &LimitsTable, tool_from_camera: &Pose) -> Result<Limits, Problem> {
    let default = Limits::default();
    let sensor_m = tool_from_camera.translation.vector.norm() + SENSOR_BODY_M;
    let mm = |key, value, m: f64| Ok::<f64, Problem>(positive(key, value, m * MM_PER_M)? / MM_PER_M);
    let deg = |key, value, rad: f64| Ok::<f64, Problem>(positive(key, value, rad.to_degrees())?.to_radians());
    let tilt_deg = wire.tilt_deg.unwrap_or(default.tilt_rad.map(f64::to_degrees));
    if !tilt_deg.iter().all(|deg| (0.0..=90.0).contains(deg)) {
        return Err(wrong("limits.tilt_deg", "three angles from 0 to 90", &format!("{tilt_deg:?}")));
    }
    Ok(Limits {
        workspace_m: wire.workspace_mm.map(workspace).transpose()?,
        stand_off_m: match wire.stand_off_mm {
            Some(limits) => range("limits.stand_off_mm", limits)?.map(|mm| mm / MM_PER_M),
            None => default.stand_off_m,
        },
        tilt_rad: tilt_deg.map(f64::to_radians),
        speed_m_s: mm("limits.speed_mm_s", wire.speed_mm_s, default.speed_m_s)?,
        acceleration_m_s2: mm(
            "limits.acceleration_mm_s2",
            wire.acceleration_mm_s2,
            default.acceleration_m_s2,
        )?,
        jerk_m_s3: mm("limits.jerk_mm_s3", wire.jerk_mm_s3, default.jerk_m_s3)?,
        turn_rad_s: deg("limits.turn_deg_s", wire.turn_deg_s, default.turn_rad_s)?,
        turn_acceleration_rad_s2: deg(
            "limits.turn_acceleration_deg_s2",
            wire.turn_acceleration_deg_s2,
            default.turn_acceleration_rad_s2,
        )?,
        turn_jerk_rad_s3: deg("limits.turn_jerk_deg_s3", wire.turn_jerk_deg_s3, default.turn_jerk_rad_s3)?,
        tip_speed_m_s: mm("limits.tip_speed_mm_s", wire.tip_speed_mm_s, default.tip_speed_m_s)?,
        reach_m: mm("limits.reach_mm", wire.reach_mm, sensor_m)?,
        spun_pass: wire.spun_pass.unwrap_or(default.spun_pass),
    })
}

fn workspace(corners_mm: [[f64; 3]; 2]) -> Result<[Vector3<f64>; 2], Problem> {
    let [low, high] = corners_mm;
    if !(0..3).all(|k| low[k] < high[k] && low[k].is_finite() && high[k].is_finite()) {
        return Err(wrong(
            "limits.workspace_mm",
            "the lower corner, then the upper one",
            &format!("{corners_mm:?}"),
        ));
    }
    Ok(corners_mm.map(|corner| Vector3::from(corner) / MM_PER_M))
}

fn noise(wire: &NoiseTable) -> Result<ExpectedNoise, Problem> {
    let default = ExpectedNoise::default();
    let mm = |key, value, m: f64| Ok::<f64, Problem>(not_negative(key, value, m * MM_PER_M)? / MM_PER_M);
    let robot_deg = not_negative("noise.robot_deg", wire.robot_deg, default.robot_rad.to_degrees())?;
    Ok(ExpectedNoise {
        feature_px: positive("noise.feature_px", wire.feature_px, default.feature_px)?,
        feature_m: positive("noise.feature_mm", wire.feature_mm, default.feature_m * MM_PER_M)? / MM_PER_M,
        robot_m: mm("noise.robot_mm", wire.robot_mm, default.robot_m)?,
        robot_rad: robot_deg.to_radians(),
        stamp_s: not_negative("noise.stamp_ms", wire.stamp_ms, default.stamp_s * 1e3)? * 1e-3,
    })
}
