//! `robot.csv`: base_from_tool over time, with rotations in any form of `rotation_columns`.

use crate::dialect::plain_file;
use crate::error::{Error, Problem};
use crate::recording::RobotSample;
use crate::rotation_columns::RotationColumns;
pub use crate::rotation_columns::unit_quaternion;
use crate::source_file;
use crate::stamp;
use crate::table::{self, ColumnSpec, Header, optional, required};
use crate::unit::{MM_PER_M, Quantity};
use nalgebra::Vector3;
use std::io::Write;
use std::path::Path;
use trueline_geometry::se3;

const TIME: usize = 0;
const POSITION: [usize; 3] = [1, 2, 3];
const DEVICE_TIME: usize = 4;
/// First column of the rotation.
const ROTATION: usize = 5;

const COLUMNS: [ColumnSpec<'static>; 5] = [
    required("time", Quantity::Time),
    required("x", Quantity::Length),
    required("y", Quantity::Length),
    required("z", Quantity::Length),
    optional("device_time", Quantity::Time),
];

/// Whether a name is that of a column of this file.
#[must_use]
pub(crate) fn is_column(name: &str) -> bool {
    table::is_one_of(name, &COLUMNS) || RotationColumns::is_one(name)
}

/// Reads the robot's poses.
///
/// # Errors
/// Anything that is not a clean table with rising stamps and one rotation in a form of `rotation_columns`.
pub fn read(file: &Path, bytes: &[u8]) -> Result<Vec<RobotSample>, Error> {
    let header = Header::read(file, bytes)?;
    if header.names().iter().any(|name| name == "u_px" || name == "v_px") {
        return Err(header.error(Problem::OtherTable { looks_like: "features.csv" }));
    }
    let rotation_columns = RotationColumns::find(header.names()).map_err(|problem| header.error(problem))?;
    let specs: Vec<ColumnSpec<'_>> = COLUMNS.into_iter().chain(rotation_columns.specs()).collect();
    let mut table = header.find(&specs)?;
    let mut samples: Vec<RobotSample> = table.room();
    while table.next_row()? {
        let stamp_ns = table.stamp_ns(TIME)?;
        if let Some(last) = samples.last()
            && stamp_ns < last.stamp_ns
        {
            let (previous_s, this_s) = (stamp::seconds(last.stamp_ns), stamp::seconds(stamp_ns));
            return Err(table.error_in(TIME, Problem::TimeRunsBackwards { previous_s, this_s }));
        }
        let mut position = Vector3::zeros();
        for (value, column) in position.iter_mut().zip(POSITION) {
            *value = table.required_number(column)?;
        }
        let rotation = rotation_columns.read(&table, ROTATION)?;
        let device_ns = table.optional_stamp_ns(DEVICE_TIME)?;
        samples.push(RobotSample {
            stamp_ns,
            device_ns,
            base_from_tool: se3::from_parts(rotation, position),
        });
    }
    if samples.is_empty() {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    Ok(samples)
}

/// Reads the robot's poses from a file that a user named: a path, say.
///
/// # Errors
/// As [`read`], and a file that is missing.
pub fn read_file(file: &Path) -> Result<Vec<RobotSample>, Error> {
    read(file, &source_file::named(plain_file(file))?)
}

/// Writes the robot's poses so that reading gives them back to the last nanosecond and 1e-15.
///
/// # Errors
/// Error of the writer.
pub fn write(mut out: impl Write, samples: &[RobotSample]) -> std::io::Result<()> {
    let device = samples.iter().all(|s| s.device_ns.is_some());
    writeln!(out, "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz{}", if device { ",device_time_s" } else { "" })?;
    for sample in samples {
        let p = sample.base_from_tool.translation.vector * MM_PER_M;
        let q = sample.base_from_tool.rotation.quaternion();
        let time = stamp::format_seconds(sample.stamp_ns);
        write!(out, "{time},{},{},{},{},{},{},{}", p.x, p.y, p.z, q.w, q.i, q.j, q.k)?;
        if let (true, Some(device_ns)) = (device, sample.device_ns) {
            write!(out, ",{}", stamp::format_seconds(device_ns))?;
        }
        writeln!(out)?;
    }
    Ok(())
}
