//! `initial.toml` and `truth.toml`: time offset, hand-eye transform and lines, if known.

use crate::axes::AxisRecord;
use crate::error::{Error, Problem};
use crate::recording::{Guess, Truth};
use crate::robot_csv::unit_quaternion;
use crate::sensor_toml::{parse_toml, read_text};
use crate::toml_place::in_toml;
use crate::unit::MM_PER_M;
use nalgebra::{UnitVector3, Vector3};
use serde::{Deserialize, Serialize};
use std::path::Path;
use trueline_geometry::{AxisKind, Line, Pose, se3};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct KnownFile {
    time_offset_s: f64,
    tool_from_camera: PoseTable,
    // For pose sightings; a calibration does not use it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    base_from_target: Option<PoseTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    lines: Vec<LineTable>,
    // For a cell with external axes; a guess does not use them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    axes: Vec<AxisTable>,
}

/// An external axis; other programs may say more of it.
#[derive(Serialize, Deserialize)]
struct AxisTable {
    name: String,
    direction: [f64; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    point_mm: Option<[f64; 3]>,
    #[serde(default)]
    time_offset_s: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PoseTable {
    translation_mm: [f64; 3],
    rotation_wxyz: [f64; 4],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LineTable {
    point_mm: [f64; 3],
    direction: [f64; 3],
}

/// Reads a guess's file.
///
/// # Errors
/// A file that is missing, and as [`parse_guess`].
pub fn read_guess(file: &Path) -> Result<Guess, Error> {
    parse_guess(file, &read_text(file)?)
}

/// Reads a guess.
///
/// # Errors
/// Broken TOML, unknown keys, numbers that are not finite, a quaternion that is not of length 1.
pub fn parse_guess(file: &Path, text: &str) -> Result<Guess, Error> {
    Ok(parse_truth(file, text)?.parameters)
}

/// Reads the truth of a simulation.
///
/// # Errors
/// As [`parse_guess`].
pub fn parse_truth(file: &Path, text: &str) -> Result<Truth, Error> {
    let wire: KnownFile = parse_toml(file, text)?;
    let at = |problem| in_toml(file, text, problem);
    if !wire.time_offset_s.is_finite() {
        return Err(at(not_finite("time_offset_s", &[wire.time_offset_s])));
    }
    let pose = pose_from(&wire.tool_from_camera).map_err(at)?;
    wire.base_from_target.as_ref().map(pose_from).transpose().map_err(at)?;
    let lines = wire.lines.iter().map(line_from).collect::<Result<_, _>>().map_err(at)?;
    Ok(Truth { parameters: Guess { time_offset_s: wire.time_offset_s, tool_from_camera: pose }, lines })
}

/// The text of a truth or, without lines, of a guess.
#[must_use]
pub fn format(parameters: &Guess, lines: &[Line]) -> String {
    format_with_axes(parameters, lines, &[])
}

/// The text of a truth with the axes of its cell.
pub(crate) fn format_with_axes(parameters: &Guess, lines: &[Line], axes: &[AxisRecord]) -> String {
    let lines = lines
        .iter()
        .map(|line| LineTable {
            point_mm: (line.anchor() * MM_PER_M).into(),
            direction: line.direction().into(),
        })
        .collect();
    let table = |axis: &AxisRecord| {
        let known = axis.known?;
        Some(AxisTable {
            name: axis.name.clone(),
            direction: known.direction.into_inner().into(),
            point_mm: (known.kind == AxisKind::Rotary).then(|| (known.point_m * MM_PER_M).into()),
            time_offset_s: known.time_offset_s,
        })
    };
    text(parameters, None, lines, axes.iter().filter_map(table).collect())
}

/// The text of the truth of pose sightings.
#[must_use]
pub fn format_poses(parameters: &Guess, base_from_target: &Pose) -> String {
    text(parameters, Some(base_from_target), Vec::new(), Vec::new())
}

fn text(parameters: &Guess, target: Option<&Pose>, lines: Vec<LineTable>, axes: Vec<AxisTable>) -> String {
    let wire = KnownFile {
        time_offset_s: parameters.time_offset_s,
        tool_from_camera: pose_to(&parameters.tool_from_camera),
        base_from_target: target.map(pose_to),
        lines,
        axes,
    };
    toml::to_string(&wire).unwrap_or_default()
}

fn pose_to(pose: &Pose) -> PoseTable {
    let q = pose.rotation.quaternion();
    PoseTable {
        translation_mm: (pose.translation.vector * MM_PER_M).into(),
        rotation_wxyz: [q.w, q.i, q.j, q.k],
    }
}

fn not_finite(key: &'static str, found: &[f64]) -> Problem {
    Problem::Value { key, expected: "finite numbers", found: format!("{found:?}") }
}

fn pose_from(wire: &PoseTable) -> Result<Pose, Problem> {
    let rotation = unit_quaternion(wire.rotation_wxyz)?;
    Ok(se3::from_parts(rotation, mounted_at_m(wire.translation_mm)?))
}

/// No sensor is mounted further from its tool, or from the robot's base, than this, mm.
const FURTHEST_MM: f64 = 1e6;

/// Position of a sensor, m, from a translation in mm.
///
/// # Errors
/// Numbers that are not finite, or beyond a kilometre: squares of later results would not be finite.
pub(crate) fn mounted_at_m(translation_mm: [f64; 3]) -> Result<Vector3<f64>, Problem> {
    if translation_mm.iter().all(|x| x.abs() <= FURTHEST_MM) {
        return Ok(Vector3::from(translation_mm) / MM_PER_M);
    }
    Err(Problem::Value {
        key: "tool_from_camera.translation_mm",
        expected: "three numbers of at most a kilometre",
        found: format!("{translation_mm:?}"),
    })
}

fn line_from(wire: &LineTable) -> Result<Line, Problem> {
    let direction = Vector3::from(wire.direction);
    if !wire.point_mm.iter().all(|x| x.is_finite()) {
        return Err(not_finite("lines.point_mm", &wire.point_mm));
    }
    let unit = UnitVector3::try_new(direction, 1e-6).filter(|u| u.iter().all(|x| x.is_finite()));
    let unit = unit.ok_or_else(|| not_finite("lines.direction", &wire.direction))?;
    Ok(Line::new(Vector3::from(wire.point_mm) / MM_PER_M, &unit))
}
