//! `sensor.toml`: what the sensor is.

use crate::error::{Error, Problem};
use crate::recording::Sensor;
use crate::unit::MM_PER_M;
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::path::Path;
use trueline_geometry::Plane;
use trueline_model::{BrownConrady, Camera};

#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum SensorFile {
    CameraLaser {
        camera: CameraTable,
        laser_plane: PlaneTable,
    },
    Profiler {},
    Points {
        #[serde(skip_serializing_if = "Option::is_none")]
        laser_plane: Option<PlaneTable>,
    },
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

/// Reads a sensor from the text of its file.
///
/// # Errors
/// Broken TOML, unknown keys, or values that no sensor has.
pub fn parse(file: &Path, text: &str) -> Result<Sensor, Error> {
    let wire: SensorFile = parse_toml(file, text)?;
    let at = |problem| Error::in_file(file, problem);
    match wire {
        SensorFile::CameraLaser { camera, laser_plane } => Ok(Sensor::CameraLaser {
            camera: camera_from(&camera).map_err(at)?,
            laser_plane_in_camera: plane_from(&laser_plane).map_err(at)?,
        }),
        SensorFile::Profiler {} => Ok(Sensor::Profiler),
        SensorFile::Points { laser_plane } => Ok(Sensor::Points {
            laser_plane_in_camera: laser_plane.map(|p| plane_from(&p).map_err(at)).transpose()?,
        }),
    }
}

/// The text of a sensor's file.
#[must_use]
pub fn format(sensor: &Sensor) -> String {
    let wire = match sensor {
        Sensor::CameraLaser { camera, laser_plane_in_camera } => SensorFile::CameraLaser {
            camera: CameraTable {
                width: camera.size[0],
                height: camera.size[1],
                fx: camera.focal.x,
                fy: camera.focal.y,
                cx: camera.centre.x,
                cy: camera.centre.y,
                distortion: camera.distortion.to_opencv(),
            },
            laser_plane: plane_to(laser_plane_in_camera),
        },
        Sensor::Profiler => SensorFile::Profiler {},
        Sensor::Points { laser_plane_in_camera } => {
            SensorFile::Points { laser_plane: laser_plane_in_camera.as_ref().map(plane_to) }
        }
    };
    toml::to_string(&wire).unwrap_or_default()
}

/// Parses TOML with the line of the error.
///
/// # Errors
/// Broken TOML, unknown or missing keys.
pub fn parse_toml<T: serde::de::DeserializeOwned>(file: &Path, text: &str) -> Result<T, Error> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map(|span| 1 + text[..span.start].matches('\n').count() as u64);
        let problem = Problem::Toml(error.message().to_owned());
        Error { file: file.to_owned(), line, column: None, problem }
    })
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
        focal: Vector2::new(positive("camera.fx", wire.fx)?, positive("camera.fy", wire.fy)?),
        centre: Vector2::new(finite("camera.cx", wire.cx)?, finite("camera.cy", wire.cy)?),
        distortion: BrownConrady::from_opencv(wire.distortion),
    })
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
