//! A cell's file with some statements replaced: comments are lost, values are not.

use super::cell_file::{sensor_file, sensor_name};
use crate::cell::Cell;
use nalgebra::Vector3;
use std::path::Path;
use trueline_dataset::Error;
use trueline_dataset::sensor_toml::parse_toml;
use trueline_dataset::unit::MM_PER_M;

/// The same text for a sensor's file of the usual name.
///
/// # Errors
/// Broken TOML.
pub fn with_usual_sensor(file: &Path, text: &str) -> Result<String, Error> {
    if sensor_name(file, text)? == sensor_file() {
        return Ok(text.to_owned());
    }
    let mut table: toml::Table = parse_toml(file, text)?;
    table.insert("sensor".to_owned(), sensor_file().into());
    Ok(table.to_string())
}

/// An example's text with its two plates in use, which are commented out in it.
#[must_use]
pub fn with_plates(example: &str) -> String {
    let mut is_plate = false;
    let line = |line: &str| {
        is_plate = line.starts_with("# [[plates]]") || is_plate && line.starts_with("# ");
        format!("{}\n", line.strip_prefix("# ").filter(|_| is_plate).unwrap_or(line))
    };
    example.lines().map(line).collect()
}

/// The same text with the guess of a cell in it: hand-eye, seam, attitude and how wrong they may be.
///
/// # Errors
/// Broken TOML.
pub fn with_guess(file: &Path, text: &str, cell: &Cell) -> Result<String, Error> {
    let mut table: toml::Table = parse_toml(file, text)?;
    let numbers = |values: &[f64]| toml::Value::from(values.to_vec());
    let wxyz = |q: &nalgebra::UnitQuaternion<f64>| numbers(&[q.w, q.i, q.j, q.k]);
    let mm = |m: &Vector3<f64>| numbers((m * MM_PER_M).as_slice());
    let mut set = |name: &str, values: Vec<(&str, toml::Value)>| {
        let values = values.into_iter().map(|(key, value)| (key.to_owned(), value));
        table.insert(name.to_owned(), toml::Value::Table(values.collect()));
    };
    set("seam", vec![("from_mm", mm(&cell.seam.from_m)), ("to_mm", mm(&cell.seam.to_m))]);
    let mounted = &cell.tool_from_camera;
    set(
        "tool_from_camera",
        vec![("translation_mm", mm(&mounted.translation.vector)), ("rotation_wxyz", wxyz(&mounted.rotation))],
    );
    set("attitude", vec![("base_from_tool_wxyz", wxyz(&cell.sensor_pose.nominal_attitude()))]);
    let error = &cell.guess_error;
    set(
        "guess_error",
        vec![
            ("translation_mm", (error.translation_m * MM_PER_M).into()),
            ("rotation_deg", error.rotation_rad.to_degrees().into()),
            ("line_mm", (error.line_m * MM_PER_M).into()),
        ],
    );
    Ok(table.to_string())
}
