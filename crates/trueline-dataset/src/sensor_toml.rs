//! `sensor.toml`: the sensor, and its uncertainty.

use crate::camera_yaml;
use crate::error::{Error, Problem};
use crate::log_problem::LogProblem;
use crate::recording::Sensor;
use crate::sensor_setup::SensorSetup;
use crate::setup_toml::{
    MountedName, RegionTable, RobotTable, SeamTable, ShapeTable, UncertaintyTable, setup_from,
};
use crate::source_file;
use crate::toml_place::in_toml;
use crate::unit::MM_PER_M;
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::path::Path;
use trueline_geometry::Plane;
use trueline_model::{BrownConrady, Camera};

/// Content of a `sensor.toml`, for reading and writing.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorFile {
    /// The sensor.
    pub sensor: Sensor,
    /// The file's other statements.
    pub setup: SensorSetup,
}

impl From<Sensor> for SensorFile {
    fn from(sensor: Sensor) -> Self {
        Self { sensor, setup: SensorSetup::default() }
    }
}

/// A camera, possibly without a measured laser plane: the input of `trueline sensor`.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFile {
    /// The camera.
    pub camera: Camera,
    /// The laser plane in the camera frame, if known.
    pub laser_plane_in_camera: Option<Plane>,
    /// The file's other statements.
    pub setup: SensorSetup,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    CameraLaser,
    Profiler,
    Points,
    Poses,
}

/// The file's tables. Plain values come before tables, as TOML wants them.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Wire {
    kind: Kind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mounted: Option<MountedName>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    camera: Option<CameraTable>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    laser_plane: Option<PlaneTable>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shape: Option<ShapeTable>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    robot: Option<RobotTable>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    seam: Option<SeamTable>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    region_of_interest: Option<RegionTable>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    uncertainty: Option<UncertaintyTable>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraTable {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    distortion: [f64; 5],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaneTable {
    normal: [f64; 3],
    offset_mm: f64,
}

/// Reads a sensor's file.
///
/// # Errors
/// A file that is missing, and as [`parse_file`].
pub fn read(file: &Path) -> Result<SensorFile, Error> {
    parse_file(file, &read_text(file)?)
}

/// The text of a file that a user named.
///
/// # Errors
/// A file that is missing, cannot be read, or is not text.
pub fn read_text(file: &Path) -> Result<String, Error> {
    let read = source_file::text(file);
    // The one of a dataset is missed, another was named.
    if file.file_name().is_some_and(|name| name == "sensor.toml") { read } else { source_file::named(read) }
}

/// Reads a sensor, and the rest of its file.
///
/// # Errors
/// Broken TOML, unknown keys, tables that this kind of sensor does not have, or values that no sensor has.
pub fn parse_file(file: &Path, text: &str) -> Result<SensorFile, Error> {
    let wire = wire(file, text)?;
    let at = |problem| in_toml(file, text, problem);
    if camera_yaml::is_yaml(text) && wire.laser_plane.is_none() {
        let toml = toml::to_string(&wire).unwrap_or_default();
        return Err(Error::in_file(file, LogProblem::CameraAlone { toml }.into()));
    }
    let setup = setup(&wire).map_err(at)?;
    Ok(SensorFile { sensor: sensor_from(&wire).map_err(at)?, setup })
}

/// Reads a sensor alone, for callers that use nothing of the rest.
///
/// # Errors
/// As [`parse_file`].
pub fn parse(file: &Path, text: &str) -> Result<Sensor, Error> {
    Ok(parse_file(file, text)?.sensor)
}

/// Reads a camera's file; the laser plane may be missing.
///
/// # Errors
/// As [`parse_camera`], and a file that is missing or no text.
pub fn read_camera(file: &Path) -> Result<CameraFile, Error> {
    parse_camera(file, &read_text(file)?)
}

/// Reads a camera; the laser plane may be missing.
///
/// # Errors
/// As [`parse_file`], and a file that describes no camera.
pub fn parse_camera(file: &Path, text: &str) -> Result<CameraFile, Error> {
    let wire = wire(file, text)?;
    let at = |problem| in_toml(file, text, problem);
    let Some(camera) = wire.camera.as_ref().filter(|_| wire.kind == Kind::CameraLaser) else {
        return Err(at(Problem::Value {
            key: "kind",
            expected: "\"camera_laser\" with a [camera]",
            found: format!("{:?}", wire.kind),
        }));
    };
    Ok(CameraFile {
        camera: camera_from(camera).map_err(at)?,
        laser_plane_in_camera: wire.laser_plane.as_ref().map(|p| plane_from(p).map_err(at)).transpose()?,
        setup: setup(&wire).map_err(at)?,
    })
}

/// Whether a text describes a sensor that reports poses of a target, `kind = "poses"`; false for broken TOML.
#[must_use]
pub(crate) fn is_of_poses(text: &str) -> bool {
    let table: Option<toml::Table> = toml::from_str(text).ok();
    table.is_some_and(|table| table.get("kind").and_then(toml::Value::as_str) == Some("poses"))
}

/// Reads the file of a sensor that reports poses: its carrier, and the robot's accuracy.
///
/// # Errors
/// Broken TOML, another kind, and tables that such a sensor does not have.
pub fn parse_poses(file: &Path, text: &str) -> Result<SensorSetup, Error> {
    let wire = wire(file, text)?;
    let at = |problem| in_toml(file, text, problem);
    if wire.kind != Kind::Poses {
        let found = format!("{:?}", wire.kind);
        return Err(at(Problem::Value { key: "kind", expected: "\"poses\"", found }));
    }
    let tables = [
        ("camera", wire.camera.is_some()),
        ("laser_plane", wire.laser_plane.is_some()),
        ("shape", wire.shape.is_some()),
        ("seam", wire.seam.is_some()),
        ("region_of_interest", wire.region_of_interest.is_some()),
        ("uncertainty", wire.uncertainty.is_some()),
    ];
    if let Some((key, _)) = tables.into_iter().find(|(_, is_there)| *is_there) {
        return Err(at(not_of_this_kind(key)));
    }
    setup(&wire).map_err(at)
}

/// The text of the file of a sensor that reports poses.
#[must_use]
pub fn format_poses(setup: &SensorSetup) -> String {
    text(Kind::Poses, None, None, setup)
}

/// The text of a sensor's file.
#[must_use]
pub fn format_file(file: &SensorFile) -> String {
    let (kind, camera, plane) = match &file.sensor {
        Sensor::CameraLaser { camera, laser_plane_in_camera } => {
            (Kind::CameraLaser, Some(camera), Some(laser_plane_in_camera))
        }
        Sensor::Profiler => (Kind::Profiler, None, None),
        Sensor::Points { laser_plane_in_camera } => (Kind::Points, None, laser_plane_in_camera.as_ref()),
    };
    text(kind, camera, plane, &file.setup)
}

/// The text of a sensor's file without uncertainty or anything else beside the sensor.
#[must_use]
pub fn format(sensor: &Sensor) -> String {
    format_file(&SensorFile::from(sensor.clone()))
}

/// The text of a camera's file, with or without its laser plane.
#[must_use]
pub fn format_camera(file: &CameraFile) -> String {
    text(Kind::CameraLaser, Some(&file.camera), file.laser_plane_in_camera.as_ref(), &file.setup)
}

/// The tables of a file, which may be the YAML of a camera.
fn wire(file: &Path, text: &str) -> Result<Wire, Error> {
    if text.trim_start_matches('\u{feff}').trim_start().starts_with('<') {
        let what = if text.contains("<opencv_storage") { "a camera by OpenCV as XML" } else { "XML" };
        let hint = "write it as YAML: cv::FileStorage writes that to a file with the ending .yaml; or write sensor.toml";
        return Err(Error::unreadable(file, what, hint));
    }
    if !camera_yaml::is_yaml(text) {
        return parse_toml(file, text);
    }
    let camera =
        camera_yaml::read(text).map_err(|(line, problem)| Error { line, ..Error::in_file(file, problem) })?;
    let [width, height] = camera.size;
    let [fx, fy, cx, cy] = camera.intrinsics;
    Ok(Wire {
        kind: Kind::CameraLaser,
        mounted: None,
        camera: Some(CameraTable { width, height, fx, fy, cx, cy, distortion: camera.distortion }),
        laser_plane: camera.laser_plane.map(|(normal, offset_mm)| PlaneTable { normal, offset_mm }),
        shape: None,
        robot: None,
        seam: None,
        region_of_interest: None,
        uncertainty: None,
    })
}

/// Parses TOML with the line of the error.
///
/// # Errors
/// Broken TOML, unknown or missing keys.
pub fn parse_toml<T: serde::de::DeserializeOwned>(file: &Path, text: &str) -> Result<T, Error> {
    toml::from_str(text).map_err(|error| {
        let place = error.span().map(|span| {
            let before = &text[..span.start];
            let column = 1 + before.rsplit('\n').next().unwrap_or_default().chars().count();
            (1 + before.matches('\n').count() as u64, column)
        });
        let line = place.map(|(line, _)| line);
        let column = place.map_or_else(String::new, |(_, column)| format!("column {column}: "));
        let problem = Problem::Toml(format!("{column}{}", error.message()));
        Error { file: file.to_owned(), line, column: None, problem }
    })
}

fn text(kind: Kind, camera: Option<&Camera>, plane: Option<&Plane>, setup: &SensorSetup) -> String {
    let wire = Wire {
        kind,
        mounted: MountedName::of(setup.mounted),
        camera: camera.map(camera_to),
        laser_plane: plane.map(plane_to),
        shape: setup.shape.as_ref().map(ShapeTable::of),
        robot: setup.robot_accuracy_m.map(RobotTable::of),
        seam: SeamTable::of(setup),
        region_of_interest: setup.region_of_interest.as_ref().map(RegionTable::of),
        uncertainty: setup.uncertainty.as_ref().map(UncertaintyTable::of),
    };
    toml::to_string(&wire).unwrap_or_default()
}

fn sensor_from(wire: &Wire) -> Result<Sensor, Problem> {
    if let (Kind::Profiler | Kind::Points, Some(_)) = (wire.kind, &wire.camera) {
        return Err(not_of_this_kind("camera"));
    }
    match wire.kind {
        Kind::Poses => Err(Problem::Value {
            key: "kind",
            expected: "a sensor that measures a seam: \"camera_laser\", \"profiler\" or \"points\"; \
                `trueline calibrate DATASET` calibrates from poses",
            found: "poses".to_owned(),
        }),
        Kind::CameraLaser => Ok(Sensor::CameraLaser {
            camera: camera_from(wire.camera.as_ref().ok_or_else(|| missing_table("camera"))?)?,
            laser_plane_in_camera: plane_from(
                wire.laser_plane.as_ref().ok_or_else(|| missing_table("laser_plane"))?,
            )?,
        }),
        Kind::Profiler if wire.laser_plane.is_some() => Err(not_of_this_kind("laser_plane")),
        Kind::Profiler => Ok(Sensor::Profiler),
        Kind::Points => {
            let laser_plane_in_camera = wire.laser_plane.as_ref().map(plane_from).transpose()?;
            Ok(Sensor::Points { laser_plane_in_camera })
        }
    }
}

fn setup(wire: &Wire) -> Result<SensorSetup, Problem> {
    let of_camera = wire.kind == Kind::CameraLaser;
    let tables =
        (wire.mounted, &wire.shape, &wire.robot, &wire.seam, &wire.region_of_interest, &wire.uncertainty);
    setup_from(tables, of_camera)
}

fn missing_table(key: &'static str) -> Problem {
    let expected = match key {
        "camera" => "a table [camera] with width, height, fx, fy, cx, cy",
        _ => "a table [laser_plane] with normal and offset_mm; `trueline sensor laser-plane` measures it",
    };
    Problem::Value { key, expected, found: "none".to_owned() }
}

fn not_of_this_kind(key: &'static str) -> Problem {
    Problem::Value { key, expected: "no such table for this kind of sensor", found: format!("[{key}]") }
}

fn camera_from(wire: &CameraTable) -> Result<Camera, Problem> {
    let positive = |key, value: f64| {
        if value > 0.0 && value.is_finite() {
            Ok(value)
        } else {
            Err(Problem::Value { key, expected: "a number above zero", found: value.to_string() })
        }
    };
    let finite = |key, value: f64| {
        if value.is_finite() {
            Ok(value)
        } else {
            Err(Problem::Value { key, expected: "a finite number", found: value.to_string() })
        }
    };
    positive("camera.width", f64::from(wire.width))?;
    positive("camera.height", f64::from(wire.height))?;
    for coefficient in wire.distortion {
        finite("camera.distortion", coefficient)?;
    }
    Ok(Camera {
        size: [wire.width, wire.height],
        focal: Vector2::new(
            in_px("camera.fx", positive("camera.fx", wire.fx)?, wire.width)?,
            in_px("camera.fy", positive("camera.fy", wire.fy)?, wire.height)?,
        ),
        centre: Vector2::new(finite("camera.cx", wire.cx)?, finite("camera.cy", wire.cy)?),
        distortion: BrownConrady::from_opencv(wire.distortion),
    })
}

/// A focal length in px is no less than this part of the picture: it would see 170°.
const LEAST_FOCAL_PART: f64 = 0.05;

/// A focal length, unless it is one in mm.
fn in_px(key: &'static str, focal: f64, pixels: u32) -> Result<f64, Problem> {
    if focal < LEAST_FOCAL_PART * f64::from(pixels) {
        let expected = "a focal length in px, which is that in mm divided by the size of a pixel";
        return Err(Problem::Value { key, expected, found: focal.to_string() });
    }
    Ok(focal)
}

fn camera_to(camera: &Camera) -> CameraTable {
    CameraTable {
        width: camera.size[0],
        height: camera.size[1],
        fx: camera.focal.x,
        fy: camera.focal.y,
        cx: camera.centre.x,
        cy: camera.centre.y,
        distortion: camera.distortion.to_opencv(),
    }
}

fn plane_from(wire: &PlaneTable) -> Result<Plane, Problem> {
    let normal = Vector3::from(wire.normal);
    if (normal.norm() - 1.0).abs() > 1e-3 {
        return Err(Problem::Value {
            key: "laser_plane.normal",
            expected: "a vector of length 1",
            found: format!("{:?} of length {}", wire.normal, normal.norm()),
        });
    }
    // The offset belongs to the unit normal, so the printed normal is renormalised without it.
    Plane::new(normal.normalize(), wire.offset_mm / MM_PER_M).ok_or_else(|| Problem::Value {
        key: "laser_plane.offset_mm",
        expected: "a finite number",
        found: wire.offset_mm.to_string(),
    })
}

fn plane_to(plane: &Plane) -> PlaneTable {
    PlaneTable { normal: plane.normal().into_inner().into(), offset_mm: plane.offset() * MM_PER_M }
}
