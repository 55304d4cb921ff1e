//! TUM trajectories: rows `timestamp tx ty tz qx qy qz qw`, seconds and metres, as robot poses.

use super::rows::{Rows, check_order};
use crate::error::{Error, Problem};
use crate::recording::RobotSample;
use crate::robot_csv::unit_quaternion;
use crate::stamp::{parse_nanoseconds, problem_of};
use nalgebra::Vector3;
use std::path::Path;
use trueline_geometry::se3;

const FORMAT: &str = "a TUM trajectory (timestamp tx ty tz qx qy qz qw)";

/// Reads base_from_tool from a TUM file. Mind the quaternion: w comes last there.
///
/// # Errors
/// The first line that cannot be used.
pub fn read_robot(file: &Path) -> Result<Vec<RobotSample>, Error> {
    let rows = Rows::open(file)?;
    let mut samples: Vec<RobotSample> = Vec::new();
    for row in rows.iter() {
        rows.expect_fields(&row, FORMAT, &[8])?;
        let text = row.fields[0];
        let stamp_ns = parse_nanoseconds(text, 9).ok_or_else(|| rows.error(&row, problem_of(text)))?;
        check_order(&rows, &row, samples.last().map(|s| s.stamp_ns), stamp_ns)?;
        let position = Vector3::from(rows.numbers::<3>(&row, 1)?);
        let [x, y, z, w] = rows.numbers::<4>(&row, 4)?;
        let rotation = unit_quaternion([w, x, y, z]).map_err(|p| rows.error(&row, p))?;
        samples.push(RobotSample {
            stamp_ns,
            device_ns: None,
            base_from_tool: se3::from_parts(rotation, position),
        });
    }
    if samples.is_empty() {
        return Err(rows.file_error(Problem::NoRows));
    }
    Ok(samples)
}
